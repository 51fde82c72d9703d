//! Going on in a branch: a world that a journal takes back to a recorded state, bit for bit.

use recording::{JournalLink, WorldState};
use schemas::{ActorId, Command, Reply, Request, SensorCommand, SharedFrame, Tick, WorldId};

use super::Endpoint;
use super::worlds::refused;
use crate::catalogue;
use crate::dialect::WeatherParameters;
use crate::rpc::Refusal;

impl Endpoint {
    /// Goes on in a world that is as the recorded one was, in which all have the ids of the
    /// recording. The old world goes only when the new one is there.
    ///
    /// # Errors
    /// Why not; then nothing has changed.
    pub(crate) async fn branch(
        &mut self,
        link: &JournalLink,
        state: WorldState,
    ) -> Result<(), Refusal> {
        let request = Request::BranchJournal {
            name: link.name.clone(),
            tick: Some(Tick(state.tick)),
            lease: Some(self.config.lease()),
        };
        let made = self.site.ask(request).await.map_err(|error| refused(&error))?;
        let Reply::WorldCreated { world, frame, .. } = made else {
            return Err(Refusal("the world service answered something else".to_owned()));
        };
        let frame = SharedFrame::decode(frame).map_err(|error| refused(&error));
        let fitting = frame.and_then(|frame| self.fits(state, &frame).map(|()| frame));
        match fitting {
            Ok(frame) => self.move_to(world, frame).await,
            Err(why) => {
                self.destroy(world).await;
                Err(why)
            }
        }
    }

    /// Whether a branch is what the recording says, and clients know nobody in it as somebody else.
    fn fits(&mut self, state: WorldState, frame: &SharedFrame) -> Result<(), Refusal> {
        if frame.state_hash != state.state_hash {
            let found = frame.state_hash;
            let wanted = state.state_hash;
            return Err(Refusal(format!("wanted state {wanted:016x} of it, found {found:016x}")));
        }
        let episode = self.episode()?;
        let known = frame.actors.iter().find_map(|actor| {
            let known = &episode.actor(actor.id)?.description.type_id;
            (known != frame.type_of(actor)).then(|| format!("{} is {known} here", actor.id))
        });
        known.map_or(Ok(()), |why| Err(Refusal(why)))
    }

    async fn move_to(&mut self, world: WorldId, frame: SharedFrame) -> Result<(), Refusal> {
        self.pending.clear();
        self.shown = None;
        self.weather = WeatherParameters::of(&frame.weather);
        let all: Vec<ActorId> = frame.actors.iter().map(|actor| actor.id).collect();
        let is_spectator = |id: &&ActorId| {
            frame.actor(**id).is_some_and(|actor| frame.type_of(actor) == "spectator")
        };
        let spectator = all.iter().find(is_spectator).copied();
        self.note_actors(&frame, &[]);
        let episode = self.episode()?;
        let is_gone = |id: &ActorId| frame.actor(*id).is_none();
        let gone: Vec<ActorId> = episode.states().map(|state| state.id).filter(is_gone).collect();
        let before = std::mem::replace(&mut episode.world, world);
        self.keep.end();
        let episode = self.episode()?;
        all.iter().for_each(|actor| episode.note_physics(*actor, true));
        let is_lost = |id: &ActorId| episode.actor(*id).is_none();
        let lost: Vec<ActorId> = all.iter().copied().filter(is_lost).collect();
        episode.spectator = spectator.or(episode.spectator);
        episode.show(frame);
        gone.into_iter().for_each(|actor| self.forget(actor));
        self.leave_sensors(&lost).await?;
        self.learn(Vec::new()).await?;
        // Whoever listened then may not now, and the other way round.
        for sensor in all {
            if self.episode()?.stream(sensor).is_some() {
                let on = self.is_wanted(sensor);
                self.pending.push(Command::Sensor(SensorCommand::Listen { sensor, on }));
            }
        }
        self.queue_substeps();
        self.keep_state().await;
        self.destroy(before).await;
        Ok(())
    }

    /// Destroys the sensors among actors that clients have not now: the streams that clients knew
    /// of them have ended.
    async fn leave_sensors(&mut self, actors: &[ActorId]) -> Result<(), Refusal> {
        let frame = &self.episode()?.frame;
        let is_sensor = |id: &&ActorId| {
            frame.actor(**id).is_some_and(|actor| catalogue::has_stream(frame.type_of(actor)))
        };
        let gone = actors.iter().filter(is_sensor);
        let commands: Vec<Command> =
            gone.map(|actor| Command::DestroyActor { actor: *actor }).collect();
        self.run_now(commands).await.map(drop)
    }

    async fn destroy(&mut self, world: WorldId) {
        if let Err(error) = self.site.ask(Request::DestroyWorld { world }).await {
            tracing::debug!(%error, "a world could not be destroyed");
        }
    }
}
