//! Time in which nobody drives: the ego keeps its last control.

use schemas::{Collision, Command, SharedFrame};

use super::Episode;

impl Episode {
    /// What begins the world's life, where nothing has happened in it.
    pub(crate) fn opening(&self) -> &[Command] {
        &self.start.opening
    }

    /// Takes in time that passed before an action. It is judged with that action's step; who has
    /// hit something meanwhile decides nothing any more.
    pub(crate) fn pass(
        &mut self,
        frame: SharedFrame,
        tick_count: u32,
        collisions: &[Collision],
        events: &mut Vec<String>,
    ) {
        self.start.opening.clear();
        let before = self.hits.count();
        self.take_in(frame, tick_count, collisions, events);
        self.is_too_late |= self.hits.count() > before;
    }

    /// Another frame of the world, and what has happened until then.
    pub(super) fn take_in(
        &mut self,
        frame: SharedFrame,
        tick_count: u32,
        collisions: &[Collision],
        events: &mut Vec<String>,
    ) {
        let before_m = self.ego_position_m();
        for halt in frame.halted_since(self.frame.tick) {
            let who = frame.actor(halt.actor).map_or("", |actor| frame.type_of(actor));
            events.push(format!("{who} was put to rest: {}", halt.reason));
        }
        let before = std::mem::replace(&mut self.frame, frame);
        self.note_lights((&before, before_m), events);
        self.note_rules(&before, events);
        let collisions = if tick_count > 1 { collisions } else { &self.frame.collisions };
        self.hits.note(self.ego, &self.frame, collisions, self.counters.num_turns, events);
        self.counters.note_distance((self.ego_position_m() - before_m).norm());
        self.find_lane();
    }
}
