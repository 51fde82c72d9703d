//! What is known of one agent's episode when it ends.

use crate::end::Cause;
use crate::motion::Contacts;

/// Numbers of an ended episode, in their order.
///
/// `cause` is 1 arrived, 2 collision, 3 off route, 4 overturned, 5 time, 6 fault of the world,
/// 7 a red light. `weather` is 1 to 22, the place of the preset among CARLA's: the first fourteen
/// as CARLA 0.8 numbers them.
pub const EPISODE_COLUMNS: [&str; 18] = [
    "return",
    "steps",
    "secs",
    "length_m",
    "completion",
    "success",
    "cause",
    "collisions_vehicle",
    "collisions_walker",
    "collisions_static",
    "off_route_secs",
    "speeding_secs",
    "driven_m",
    "mean_speed_mps",
    "mean_beside_m",
    "pair",
    "red_lights",
    "weather",
];

/// Sums over an episode so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Tally {
    pub reward: f32,
    pub steps: u32,
    pub secs: f32,
    pub vehicles: u32,
    pub walkers: u32,
    pub things: u32,
    pub off_route_secs: f32,
    pub speeding_secs: f32,
    pub driven_m: f32,
    pub beside_m: f32,
    pub red_lights: u32,
}

impl Tally {
    pub(crate) fn hit(&mut self, contacts: Contacts) {
        self.vehicles += contacts.vehicles;
        self.walkers += contacts.walkers;
        self.things += contacts.things;
    }

    /// Writes the row of an episode that ended.
    pub(crate) fn write(
        &self,
        row: &mut [f32],
        cause: Cause,
        (length_m, completion): (f32, f32),
        (pair, weather): (usize, u32),
    ) {
        let success = cause == Cause::By(crate::end::End::Arrived);
        let values: [f32; EPISODE_COLUMNS.len()] = [
            self.reward,
            self.steps as f32,
            self.secs,
            length_m,
            completion,
            f32::from(u8::from(success)),
            f32::from(cause.number()),
            self.vehicles as f32,
            self.walkers as f32,
            self.things as f32,
            self.off_route_secs,
            self.speeding_secs,
            self.driven_m,
            self.driven_m / self.secs.max(1.0e-3),
            self.beside_m / (self.steps as f32).max(1.0),
            pair as f32,
            self.red_lights as f32,
            weather as f32,
        ];
        row.copy_from_slice(&values);
    }
}
