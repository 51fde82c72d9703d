//! How the ego kept the rules of the road.

use schemas::{ActorId, Frame};
use serde_json::{Value, json};

/// Counts of the ego since the first frame, when they change.
#[derive(Debug, Default)]
pub(crate) struct Scores {
    /// What the world had counted before.
    begun: Option<[u32; 4]>,
    collisions: u32,
    changes: Vec<(i64, [u32; 5])>,
}

impl Scores {
    pub(crate) fn frame(&mut self, frame: &Frame, millis: i64, ego: Option<ActorId>) {
        let Some(ego) = ego else { return };
        let met = frame.collisions.iter().filter(|collision| {
            collision.started && (collision.actor == ego || collision.other == Some(ego))
        });
        self.collisions += met.count() as u32;
        let broken = frame.rules_broken.iter().find(|broken| broken.actor == ego);
        let broken = broken.map_or([0; 4], |broken| {
            [broken.red_lights, broken.stop_signs, broken.right_of_way, broken.crossings]
        });
        let begun = *self.begun.get_or_insert(broken);
        let mut now = [self.collisions, 0, 0, 0, 0];
        for ((now, broken), begun) in now.iter_mut().skip(1).zip(broken).zip(begun) {
            *now = broken.saturating_sub(begun);
        }
        if self.changes.last().is_none_or(|(_, last)| *last != now) {
            self.changes.push((millis, now));
        }
    }

    /// Milliseconds, collisions, red lights, stop signs, rights of way, crossings.
    pub(crate) fn told(&self) -> Value {
        let line = |(millis, [collisions, red, stop, way, crossings]): &(i64, [u32; 5])| {
            json!([millis, collisions, red, stop, way, crossings])
        };
        self.changes.iter().map(line).collect()
    }
}
