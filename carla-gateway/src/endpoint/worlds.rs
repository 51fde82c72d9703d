//! Work with the world of the episode.

use schemas::{ActorId, Command, CommandReply, Error, ErrorCode, Frame, RayHit, Reply, Request};
use schemas::{SharedFrame, TickItem, TickOutcome, Vec3, VehicleReport, WorldId, limits};

use super::{Endpoint, PENDING_MAX, check};
use crate::dialect::ActorRef;
use crate::rpc::Refusal;
use crate::stream::StreamId;

/// What the bus refuses, as a script reads it.
pub(crate) fn refused(error: &Error) -> Refusal {
    Refusal(error.to_string())
}

fn unexpected() -> Refusal {
    refused(&unexpected_answer())
}

pub(super) fn unexpected_answer() -> Error {
    Error::new(ErrorCode::InvalidMessage, "the world service answered something else")
}

fn spawned(replies: &[CommandReply]) -> impl Iterator<Item = ActorId> {
    replies.iter().filter_map(|reply| reply.as_ref().ok().copied().flatten())
}

/// Of the only world that was ticked.
pub(super) fn first_result(ticked: Reply) -> Result<TickOutcome, Error> {
    let Reply::Ticked(mut results) = ticked else { return Err(unexpected_answer()) };
    results.pop().ok_or_else(unexpected_answer)?.outcome
}

impl Endpoint {
    /// Asks the world of the episode; when it is gone, one that is made again. When that cannot be,
    /// the episode is lost.
    pub(super) async fn ask(
        &mut self,
        request: impl Fn(WorldId) -> Request,
    ) -> Result<Reply, Refusal> {
        let world = self.episode()?.world;
        let mut asked = self.site.ask(request(world)).await;
        if let Err(error) = &asked
            && worlds::is_gone(error.code)
            && self.come_back(error).await
        {
            let world = self.episode()?.world;
            asked = self.site.ask(request(world)).await;
        }
        asked.map_err(|error| self.refusal_of(&error))
    }

    /// What a client reads of an error of the world, which may be gone.
    pub(super) fn refusal_of(&mut self, error: &Error) -> Refusal {
        if let Some(why) = &self.lost {
            return Refusal(why.clone());
        }
        if worlds::is_gone(error.code) || error.code == ErrorCode::WorldQuarantined {
            self.note_loss(error);
        }
        refused(error)
    }

    /// One tick item of the episode's world, with all commands that wait. The frame of the outcome
    /// is the episode's now.
    pub(super) async fn tick_world(
        &mut self,
        tick_count: u32,
        dt_secs: Option<f64>,
    ) -> Result<TickOutcome, Refusal> {
        self.episode()?;
        let mut commands = std::mem::take(&mut self.pending);
        let mut replies = Vec::new();
        // A replay of a recording with many actors has more to say than one request can hold.
        while commands.len() > limits::COMMANDS_PER_REQUEST_MAX {
            let rest = commands.split_off(limits::COMMANDS_PER_REQUEST_MAX);
            match self.tick_item(commands, 0, None).await {
                Ok(mut outcome) => replies.append(&mut outcome.replies),
                Err(refusal) => {
                    self.wait_again(rest);
                    return Err(refusal);
                }
            }
            commands = rest;
        }
        let mut outcome = self.tick_item(commands, tick_count, dt_secs).await?;
        replies.append(&mut outcome.replies);
        Ok(TickOutcome { replies, ..outcome })
    }

    async fn tick_item(
        &mut self,
        commands: Vec<Command>,
        tick_count: u32,
        dt_secs: Option<f64>,
    ) -> Result<TickOutcome, Refusal> {
        let world = self.episode()?.world;
        let item = TickItem { commands, dt_secs, ..TickItem::new(world, tick_count) };
        let mut ticked = self.try_tick(item.clone()).await;
        if let Err(error) = &ticked
            && worlds::is_gone(error.code)
            && self.come_back(error).await
        {
            let world = self.episode()?.world;
            ticked = self.try_tick(TickItem { world, ..item.clone() }).await;
        }
        let mut outcome = match ticked {
            Ok(outcome) => outcome,
            Err(error) => return Err(self.tick_refused(&error, item.commands)),
        };
        let frame = SharedFrame::decode(std::mem::take(&mut outcome.frame));
        let frame = frame.map_err(|error| refused(&error))?;
        match &mut self.visit {
            Some(visit) => visit.deeds.note(&frame, item.commands, &outcome.replies),
            None => self.keep.note(item.commands, item.tick_count, item.dt_secs),
        }
        self.take_frame(frame, &outcome.replies)?;
        Ok(outcome)
    }

    /// The episode goes on with a frame; what was spawned for it.
    ///
    /// # Errors
    /// There is no episode.
    pub(super) fn take_frame(
        &mut self,
        frame: SharedFrame,
        replies: &[CommandReply],
    ) -> Result<(), Refusal> {
        let before = self.episode()?.frame.tick;
        for halt in frame.halted_since(before) {
            let (actor, tick, reason) = (halt.actor.get(), halt.tick.0, halt.reason);
            tracing::warn!(actor, tick, %reason, "an actor was put to rest; its physics is off");
        }
        self.note_actors(&frame, replies);
        if let Some(visit) = &mut self.visit {
            visit.note(&frame, spawned(replies));
        }
        self.recorder.see(&frame);
        self.episode()?.show(frame);
        Ok(())
    }

    /// What becomes of a tick item that was refused.
    fn tick_refused(&mut self, error: &Error, commands: Vec<Command>) -> Refusal {
        match error.code {
            // Nothing was done.
            ErrorCode::Capacity | ErrorCode::WrongTick => self.wait_again(commands),
            code if worlds::is_gone(code) => {}
            // It may have been done, or still be.
            _ => self.keep.doubt(),
        }
        self.refusal_of(error)
    }

    /// Commands that were not carried out go with the next tick; if too many wait, none does.
    fn wait_again(&mut self, commands: Vec<Command>) {
        self.pending.extend(commands);
        if self.pending.len() > PENDING_MAX {
            tracing::warn!(port = self.port, "too many commands wait for a tick: they are dropped");
            self.pending.clear();
        }
    }

    async fn try_tick(&self, item: TickItem) -> Result<TickOutcome, Error> {
        first_result(self.site.ask(Request::TickWorlds(vec![item])).await?)
    }

    /// Remembers which ids were given: those of a frame, and of actors that came and went since the
    /// one before.
    pub(super) fn note_actors(&mut self, frame: &Frame, replies: &[CommandReply]) {
        let in_frame = frame.actors.last().map(|actor| actor.id);
        spawned(replies).chain(in_frame).for_each(|id| self.given.note(id));
    }

    /// Logs what was refused of commands whose clients wait for no answer.
    pub(super) fn tell_refusals(&self, replies: &[CommandReply]) {
        for refusal in replies.iter().filter_map(|reply| reply.as_ref().err()) {
            tracing::info!(port = self.port, %refusal, "a command that nobody waits for is refused");
        }
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
        self.tell_refusals(&outcome.replies);
        self.keep_state_if_due().await;
        Ok(())
    }

    /// Carries out commands at once, after those that wait; one reply each.
    ///
    /// # Errors
    /// No request may hold one of them; those of the world as a whole.
    pub(crate) async fn run_now(
        &mut self,
        commands: Vec<Command>,
    ) -> Result<Vec<CommandReply>, Refusal> {
        self.episode()?;
        commands.iter().try_for_each(check)?;
        let count = commands.len();
        self.pending.extend(commands);
        let ticked = self.tick_world(0, None).await;
        if ticked.is_err() {
            // The caller is told that these, the last ones, were not carried out.
            self.pending.truncate(self.pending.len().saturating_sub(count));
        }
        let mut outcome = ticked?;
        self.keep_state_if_due().await;
        let first = outcome.replies.len().checked_sub(count).ok_or_else(unexpected)?;
        Ok(outcome.replies.split_off(first))
    }

    /// Learns about actors and opens the streams of those that measure. No ids: all of them.
    pub(crate) async fn learn(&mut self, actors: Vec<ActorId>) -> Result<(), Refusal> {
        let asked = |world| Request::DescribeActors { world, actors: actors.clone() };
        let Reply::Actors(described) = self.ask(asked).await? else {
            return Err(unexpected());
        };
        let stream_port = self.stream_port;
        for actor in &described {
            let next = self.next_stream();
            if let Some(stream) = self.episode()?.learn(actor, next, stream_port) {
                self.open_stream(stream);
            }
            let known = self.episode.as_ref().and_then(|episode| episode.actor(actor.id));
            if let Some(known) = known {
                self.given.learn(known);
            }
        }
        Ok(())
    }

    /// The stream that is opened next: none is ever opened again.
    pub(crate) fn next_stream(&self) -> StreamId {
        self.newest_stream.next()
    }

    /// Opens the next stream, or one that is open already.
    pub(crate) fn open_stream(&mut self, stream: StreamId) {
        self.newest_stream = self.newest_stream.max(stream);
        self.hub.open(stream, false);
    }

    /// Forgets an actor that is gone, and ends its streams.
    pub(crate) fn forget(&mut self, actor: ActorId) {
        let streams = self.episode.as_mut().map(|episode| episode.forget(actor));
        for stream in streams.into_iter().flatten() {
            self.expected.forget(stream);
            self.hub.close(stream);
            self.event_memories.forget(stream);
        }
    }

    /// Parameters and measurements of a vehicle, after everything that waits.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn inspect(&mut self, actor: ActorRef) -> Result<VehicleReport, Refusal> {
        self.flush().await?;
        let actor = self.episode()?.found(actor)?.id;
        self.reports(&[actor]).await?.pop().ok_or_else(unexpected)
    }

    /// Parameters and measurements of vehicles, in the same order.
    ///
    /// # Errors
    /// Those of the world, also when it does not know one of them.
    pub(super) async fn reports(
        &mut self,
        vehicles: &[ActorId],
    ) -> Result<Vec<VehicleReport>, Refusal> {
        let mut reports = Vec::with_capacity(vehicles.len());
        for some in vehicles.chunks(limits::VEHICLES_PER_REQUEST_MAX) {
            let asked = |world| Request::InspectVehicles { world, actors: some.to_vec() };
            match self.ask(asked).await? {
                Reply::Vehicles(told) if told.len() == some.len() => reports.extend(told),
                _ => return Err(unexpected()),
            }
        }
        Ok(reports)
    }

    /// What a ray meets, nearest first.
    ///
    /// # Errors
    /// Those of the world.
    pub(crate) async fn cast_ray(&mut self, from: Vec3, to: Vec3) -> Result<Vec<RayHit>, Refusal> {
        self.flush().await?;
        match self.ask(|world| Request::CastRays { world, rays: vec![(from, to)] }).await? {
            Reply::RayHits(hits) => Ok(hits),
            _ => Err(unexpected()),
        }
    }
}
