//! Work with the world of the episode.

use schemas::wire::decode_frame;
use schemas::{ActorId, Command, CommandReply, Error, ErrorCode, RayHit, Reply, Request};
use schemas::{TickItem, TickOutcome, Vec3, VehicleReport};

use super::Endpoint;
use crate::rpc::Refusal;

/// What the bus refuses, as a script reads it.
pub(crate) fn refused(error: &Error) -> Refusal {
    Refusal(error.to_string())
}

fn unexpected() -> Refusal {
    Refusal("the world service answered something else".to_owned())
}

impl Endpoint {
    /// Asks the world; when it is gone, the episode is lost.
    pub(super) async fn ask(&mut self, request: Request) -> Result<Reply, Refusal> {
        let asked = self.site.ask(request).await;
        asked.map_err(|error| {
            let is_gone = matches!(
                error.code,
                ErrorCode::Unreachable | ErrorCode::UnknownWorld | ErrorCode::WorldQuarantined
            );
            if is_gone {
                self.note_loss(&error);
            }
            refused(&error)
        })
    }

    /// One tick item of the episode's world, with all commands that wait.
    pub(super) async fn tick_world(
        &mut self,
        tick_count: u32,
        dt_secs: Option<f64>,
    ) -> Result<TickOutcome, Refusal> {
        let world = self.episode()?.world;
        let commands = std::mem::take(&mut self.pending);
        let item = TickItem { commands, dt_secs, ..TickItem::new(world, tick_count) };
        let Reply::Ticked(mut results) = self.ask(Request::TickWorlds(vec![item])).await? else {
            return Err(unexpected());
        };
        let result = results.pop().ok_or_else(unexpected)?;
        let outcome = match result.outcome {
            Ok(outcome) => outcome,
            Err(error) => {
                self.note_loss(&error);
                return Err(refused(&error));
            }
        };
        let frame = decode_frame(&outcome.frame.0).map_err(|error| refused(&error))?;
        let before = self.episode()?.frame.tick;
        for halt in frame.halted_since(before) {
            let (actor, tick, reason) = (halt.actor.get(), halt.tick.0, halt.reason);
            tracing::warn!(actor, tick, %reason, "an actor was put to rest; its physics is off");
        }
        self.episode()?.frame = frame;
        Ok(outcome)
    }

    /// Carries out what waits, without a tick.
    ///
    /// # Errors
    /// Only those of the world as a whole: refused commands of earlier calls are nobody's business.
    pub(crate) async fn flush(&mut self) -> Result<(), Refusal> {
        if self.pending.is_empty() {
            return self.episode().map(drop);
        }
        let outcome = self.tick_world(0, None).await?;
        for refusal in outcome.replies.iter().filter_map(|reply| reply.as_ref().err()) {
            tracing::debug!(%refusal, "a command that nobody waits for was refused");
        }
        Ok(())
    }

    /// Carries out commands at once, after those that wait; one reply each.
    ///
    /// # Errors
    /// Those of the world as a whole.
    pub(crate) async fn run_now(
        &mut self,
        commands: Vec<Command>,
    ) -> Result<Vec<CommandReply>, Refusal> {
        self.episode()?;
        let count = commands.len();
        self.pending.extend(commands);
        let mut outcome = self.tick_world(0, None).await?;
        let first = outcome.replies.len().checked_sub(count).ok_or_else(unexpected)?;
        Ok(outcome.replies.split_off(first))
    }

    /// Learns about actors and opens the streams of those that measure. No ids: all of them.
    pub(crate) async fn learn(&mut self, actors: Vec<ActorId>) -> Result<(), Refusal> {
        let world = self.episode()?.world;
        let Reply::Actors(described) = self.ask(Request::DescribeActors { world, actors }).await?
        else {
            return Err(unexpected());
        };
        let stream_port = self.stream_port();
        let mut streams_opened = self.streams_opened;
        let episode = self.episode()?;
        let learned: Vec<u32> = described
            .iter()
            .filter_map(|actor| episode.learn(actor, &mut streams_opened, stream_port))
            .collect();
        self.streams_opened = streams_opened;
        for stream in learned {
            self.hub.open(stream, false);
        }
        Ok(())
    }

    /// How many streams were ever opened: the number of the last one.
    pub(crate) fn streams_opened(&self) -> u32 {
        self.streams_opened
    }

    /// Opens a stream beside those of [`learn`](Self::learn).
    pub(crate) fn open_stream(&mut self, stream: u32) {
        self.streams_opened = self.streams_opened.max(stream);
        self.hub.open(stream, false);
    }

    /// Forgets an actor that is gone, and ends its streams.
    pub(crate) fn forget(&mut self, actor: u32) {
        let streams = self.episode.as_mut().map(|episode| episode.forget(actor));
        for stream in streams.into_iter().flatten() {
            self.expected.remove(&stream);
            self.hub.close(stream);
            self.darkroom.forget(stream);
        }
    }

    /// Parameters and measurements of a vehicle, after everything that waits.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn inspect(&mut self, actor: u32) -> Result<VehicleReport, Refusal> {
        self.flush().await?;
        let episode = self.episode()?;
        let actor = episode.state(actor).ok_or_else(|| unknown_actor(actor))?.id;
        let world = episode.world;
        match self.ask(Request::InspectVehicle { world, actor }).await? {
            Reply::Vehicle(report) => Ok(*report),
            _ => Err(unexpected()),
        }
    }

    /// What a ray meets, nearest first.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn cast_ray(&mut self, from: Vec3, to: Vec3) -> Result<Vec<RayHit>, Refusal> {
        self.flush().await?;
        let world = self.episode()?.world;
        match self.ask(Request::CastRays { world, rays: vec![(from, to)] }).await? {
            Reply::RayHits(hits) => Ok(hits),
            _ => Err(unexpected()),
        }
    }
}

/// CARLA's words for an id that nobody has.
pub(crate) fn unknown_actor(id: u32) -> Refusal {
    Refusal(format!("Actor could not be found in the registry.  Actor Id: {id}"))
}
