//! Where one actor was, frame by frame.

use schemas::{ActorKind, ActorState};
use serde_json::{Value, json};

/// Whole numbers of a metre, and of a metre per second.
const PER_METRE: f32 = 100.0;
/// Whole numbers of a degree.
const PER_DEGREE: f32 = 10.0;
/// Half of those who have no box, in metres.
const HALF_M: f32 = 0.3;

/// An actor's places, each as the difference to the one before: centimetres east and north, tenths
/// of a degree counter-clockwise from east, centimetres per second.
#[derive(Debug)]
pub(crate) struct Track {
    first: usize,
    kind: ActorKind,
    blueprint: String,
    role: String,
    colour_rgb: u32,
    box_m: [f32; 4],
    last: [i32; 4],
    differences: [Vec<i32>; 4],
}

impl Track {
    /// Of who is there for the first time in the frame of this index.
    pub(crate) fn begin(first: usize, actor: &ActorState, blueprint: &str, role: &str) -> Self {
        let (centre, half) = (actor.box_centre_m, actor.box_half_extent_m);
        let [half_x, half_y] =
            [half.x, half.y].map(|half_m| if half_m > 0.0 { half_m } else { HALF_M });
        Self {
            first,
            kind: actor.kind,
            blueprint: blueprint.to_owned(),
            role: role.to_owned(),
            colour_rgb: actor.colour_rgb,
            box_m: [centre.x, centre.y, half_x, half_y],
            last: [0; 4],
            differences: Default::default(),
        }
    }

    pub(crate) fn put(&mut self, actor: &ActorState) {
        let (place, velocity) = (actor.world_from_actor.translation, actor.linear_velocity_mps);
        let (_, _, yaw_rad) = actor.world_from_actor.rotation.euler_angles();
        let now = [
            place.x * PER_METRE,
            place.y * PER_METRE,
            yaw_rad.to_degrees() * PER_DEGREE,
            velocity.x.hypot(velocity.y) * PER_METRE,
        ];
        let now = now.map(|value| value.round() as i32);
        for ((differences, now), last) in self.differences.iter_mut().zip(now).zip(self.last) {
            differences.push(now - last);
        }
        self.last = now;
    }

    pub(crate) fn told(&self, id: u32) -> Value {
        let [x, y, yaw, speed] = &self.differences;
        let box_cm = self.box_m.map(|value_m| (value_m * PER_METRE).round() as i32);
        json!({
            "id": id,
            "kind": match self.kind {
                ActorKind::Vehicle => "vehicle",
                ActorKind::Walker => "walker",
                _ => "prop",
            },
            "type": self.blueprint,
            "role": self.role,
            "rgb": format!("#{:06x}", self.colour_rgb & 0xFF_FFFF),
            "box": box_cm,
            "first": self.first,
            "x": x, "y": y, "yaw": yaw, "speed": speed,
        })
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, Pose, Vec3};

    use super::*;

    #[test]
    fn differences_add_up_to_places_and_turns() {
        let actor = |x_m: f32, yaw_deg: f32| {
            let mut pose = Pose::translation(x_m, -1.0, 0.0);
            pose.rotation =
                schemas::UnitQuaternion::from_axis_angle(&Vec3::z_axis(), yaw_deg.to_radians());
            ActorState::at_rest(ActorId::new(1).unwrap(), ActorKind::Walker, 0, pose)
        };
        let mut track = Track::begin(3, &actor(1.0, 0.0), "walker.pedestrian.0001", "");
        for (x_m, yaw_deg) in [(1.0, 0.0), (1.5, 90.0), (1.5, -170.0)] {
            track.put(&actor(x_m, yaw_deg));
        }
        let told = track.told(9);
        assert_eq!(told["x"], json!([100, 50, 0]));
        assert_eq!(told["y"], json!([-100, 0, 0]));
        assert_eq!(told["yaw"], json!([0, 900, -2600]));
        assert_eq!(told["box"], json!([0, 0, 30, 30]));
        assert_eq!((&told["first"], &told["kind"]), (&json!(3), &json!("walker")));
    }
}
