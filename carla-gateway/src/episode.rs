//! One world as clients see it: its map, its newest frame, and what is known of its actors.

use std::collections::BTreeMap;
use std::sync::Arc;

use schemas::{ActorDescription, ActorId, ActorState, Frame, WorldId};

use crate::catalogue;
use crate::dialect::Actor;
use crate::navigation::Navigation;
use crate::stream::token;

/// Descriptions of actors that are gone are kept up to this number.
const GONE_MAX: usize = 256;

/// One episode.
pub(crate) struct Episode {
    pub(crate) world: WorldId,
    pub(crate) map: Arc<roads::Map>,
    /// For walkers.
    pub(crate) navigation: Arc<Navigation>,
    /// As clients name the map.
    pub(crate) map_name: String,
    /// The newest state; kept true while commands change it between ticks.
    pub(crate) frame: Frame,
    pub(crate) spectator: Option<ActorId>,
    actors: BTreeMap<u32, Actor>,
    signals: BTreeMap<u32, String>,
    stream_of_actor: BTreeMap<u32, u32>,
    actor_of_stream: BTreeMap<u32, u32>,
}

impl Episode {
    /// An episode that knows none of its actors yet.
    pub(crate) fn new(
        world: WorldId,
        map: Arc<roads::Map>,
        map_name: String,
        frame: Frame,
    ) -> Self {
        let navigation = Arc::new(Navigation::new(Arc::clone(&map)));
        Self {
            world,
            map,
            navigation,
            map_name,
            frame,
            spectator: None,
            actors: BTreeMap::new(),
            signals: BTreeMap::new(),
            stream_of_actor: BTreeMap::new(),
            actor_of_stream: BTreeMap::new(),
        }
    }

    /// Learns what an actor is. Gives the stream that is to be opened for it, with `next_stream`.
    pub(crate) fn learn(
        &mut self,
        described: &ActorDescription,
        next_stream: &mut u32,
        stream_port: u16,
    ) -> Option<u32> {
        let mut actor = catalogue::actor(described);
        let id = actor.id;
        let mut opened = None;
        if catalogue::has_stream(&described.blueprint) {
            let stream = *self.stream_of_actor.entry(id).or_insert_with(|| {
                *next_stream += 1;
                opened = Some(*next_stream);
                *next_stream
            });
            self.actor_of_stream.insert(stream, id);
            actor.stream_token = token(stream, stream_port).to_vec();
        }
        if let Some(signal) = &described.signal {
            self.signals.insert(id, signal.clone());
        }
        self.actors.insert(id, actor);
        self.forget_the_gone();
        opened
    }

    fn forget_the_gone(&mut self) {
        if self.actors.len() > self.frame.actors.len() + GONE_MAX {
            let frame = &self.frame;
            self.actors
                .retain(|id, _| ActorId::new(*id).is_some_and(|id| frame.actor(id).is_some()));
        }
    }

    /// Forgets an actor; gives its stream, which is to be closed.
    pub(crate) fn forget(&mut self, actor: u32) -> Option<u32> {
        self.actors.remove(&actor);
        self.signals.remove(&actor);
        let stream = self.stream_of_actor.remove(&actor)?;
        self.actor_of_stream.remove(&stream);
        Some(stream)
    }

    /// What is known of an actor.
    pub(crate) fn actor(&self, id: u32) -> Option<&Actor> {
        self.actors.get(&id)
    }

    /// The OpenDRIVE signal that a light or sign stands for.
    pub(crate) fn signal(&self, id: u32) -> Option<&str> {
        self.signals.get(&id).map(String::as_str)
    }

    /// Where an actor's measurements go.
    pub(crate) fn stream(&self, actor: u32) -> Option<u32> {
        self.stream_of_actor.get(&actor).copied()
    }

    /// The sensor behind a stream.
    pub(crate) fn sensor(&self, stream: u32) -> Option<ActorId> {
        self.actor_of_stream.get(&stream).and_then(|id| ActorId::new(*id))
    }

    /// All streams of sensors.
    pub(crate) fn streams(&self) -> impl Iterator<Item = u32> {
        self.actor_of_stream.keys().copied()
    }

    /// The newest state of an actor.
    pub(crate) fn state(&self, id: u32) -> Option<&ActorState> {
        self.frame.actor(ActorId::new(id)?)
    }

    /// As [`state`](Self::state), to keep it true between ticks.
    pub(crate) fn state_mut(&mut self, id: u32) -> Option<&mut ActorState> {
        let id = ActorId::new(id)?;
        let at = self.frame.actors.binary_search_by_key(&id, |actor| actor.id).ok()?;
        self.frame.actors.get_mut(at)
    }

    /// Actors of the newest frame that nothing is known of.
    pub(crate) fn strangers(&self) -> Vec<ActorId> {
        let ids = self.frame.actors.iter().map(|actor| actor.id);
        ids.filter(|id| !self.actors.contains_key(&id.get())).collect()
    }
}
