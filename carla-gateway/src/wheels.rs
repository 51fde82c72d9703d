//! How the wheels of a vehicle stand, and how far they have rolled.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::f32::consts::TAU;

use blueprints::{Class, VehicleModel};
use schemas::{ActorId, ActorKind, ActorState, Frame, Vec3};

/// The data of a vehicle's blueprint.
pub(crate) fn model(type_id: &str) -> Option<&'static VehicleModel> {
    match blueprints::find(type_id)?.class {
        Class::Vehicle(model) => Some(model),
        _ => None,
    }
}

/// The angle of one wheel: all front wheels roll around one point (Ackermann).
pub(crate) fn wheel_rad(model: &VehicleModel, index: usize, mean_rad: f32) -> f32 {
    let wheels = &model.physics.wheels;
    let Some(wheel) = wheels.get(index).filter(|wheel| wheel.steer_rad_max > 0.0) else {
        return 0.0;
    };
    if mean_rad == 0.0 || wheel.position_m.x <= 0.0 {
        return mean_rad;
    }
    let (sine, cosine) = mean_rad.sin_cos();
    (sine * model.wheelbase_m).atan2(cosine * model.wheelbase_m - sine * wheel.position_m.y)
}

/// Angles are told within so many turns to either side, as by PhysX.
const TURNS_MAX: f32 = 5.0;

/// How far the wheels of one vehicle have turned, in radians, positive ahead.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rolling {
    turned_rad: Vec<f32>,
}

impl Rolling {
    /// Turns each wheel as fast as its hub moves along it, whether or not it slips.
    pub(crate) fn advance(&mut self, model: &VehicleModel, state: &ActorState, dt_secs: f32) {
        let wheels = &model.physics.wheels;
        let actor_from_world = state.world_from_actor.rotation.inverse();
        let velocity_mps = actor_from_world * state.linear_velocity_mps;
        let yaw_radps = Vec3::z() * (actor_from_world * state.angular_velocity_radps).z;
        self.turned_rad.resize(wheels.len(), 0.0);
        for (index, (turned, wheel)) in self.turned_rad.iter_mut().zip(wheels).enumerate() {
            let hub_mps = velocity_mps + yaw_radps.cross(&wheel.position_m);
            let (sine, cosine) = wheel_rad(model, index, state.road_wheel_rad).sin_cos();
            let rolled_m = (hub_mps.x * cosine + hub_mps.y * sine) * dt_secs;
            *turned = (*turned + rolled_m / model.wheel_radius_m) % (TURNS_MAX * TAU);
        }
    }

    /// As Unreal Engine tells it: in degrees, negative ahead.
    pub(crate) fn rotation_deg(&self, index: usize) -> f32 {
        -self.turned_rad.get(index).copied().unwrap_or_default().to_degrees()
    }
}

/// [`Rolling`] of all vehicles.
#[derive(Debug, Default)]
pub(crate) struct RollingOfAll {
    of: BTreeMap<ActorId, (&'static VehicleModel, Rolling)>,
}

impl RollingOfAll {
    /// Goes on to a frame that is so much later; wheels of vehicles that `stand` begin anew.
    pub(crate) fn advance(
        &mut self,
        frame: &Frame,
        dt_secs: f32,
        stand: impl Fn(&ActorId) -> bool,
    ) {
        self.of.retain(|id, _| !stand(id) && frame.actor(*id).is_some());
        let vehicles = frame.actors.iter().filter(|actor| actor.kind == ActorKind::Vehicle);
        for state in vehicles.filter(|actor| !stand(&actor.id)) {
            let (model, rolling) = match self.of.entry(state.id) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(unknown) => match model(frame.type_of(state)) {
                    Some(model) => unknown.insert((model, Rolling::default())),
                    None => continue,
                },
            };
            rolling.advance(model, state, dt_secs);
        }
    }

    /// As [`Rolling::rotation_deg`], 0 for wheels that nothing is known of.
    pub(crate) fn rotation_deg(&self, vehicle: ActorId, index: usize) -> f32 {
        self.of.get(&vehicle).map_or(0.0, |(_, rolling)| rolling.rotation_deg(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outer_wheels_of_a_curve_roll_further_and_angles_stay_within_five_turns() {
        let model = model("vehicle.lincoln.mkz_2020").unwrap();
        let id = ActorId::new(1).unwrap();
        let mut state = ActorState::at_rest(id, ActorKind::Vehicle, 0, schemas::Pose::identity());
        state.linear_velocity_mps = Vec3::new(10.0, 0.0, 0.0);
        state.angular_velocity_radps = Vec3::new(0.0, 0.0, 0.5);
        let mut rolling = Rolling::default();
        rolling.advance(model, &state, 0.05);
        let [left, right] = [2, 3].map(|index| rolling.rotation_deg(index));
        let apart_m = (left - right).to_radians() * model.wheel_radius_m;
        assert!(right < left && left < 0.0, "{left} {right}");
        assert!((apart_m - 0.5 * 0.05 * model.track_m).abs() < 1e-3, "{apart_m}");
        (0..2_000).for_each(|_| rolling.advance(model, &state, 0.05));
        assert!((0..4).all(|index| rolling.rotation_deg(index).abs() <= 1_800.0));
    }

    #[test]
    fn the_inner_wheel_is_steered_further() {
        let model = model("vehicle.lincoln.mkz_2020").unwrap();
        let [left, right] = [0, 1].map(|index| wheel_rad(model, index, 0.4));
        assert!(left > 0.4 && right < 0.4 && right > 0.3, "{left} {right}");
        assert_eq!(wheel_rad(model, 2, 0.4), 0.0);
        assert_eq!(wheel_rad(model, 9, 0.4), 0.0);
    }
}
