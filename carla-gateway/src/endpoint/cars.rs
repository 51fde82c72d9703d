//! The cars that clients spawn: CARLA's tyres, steering and engines, where they are wanted.

mod engines;

use blueprints::Class;
use schemas::{ActorId, Command, Handling, VehicleCommand, VehiclePhysics};

use super::Endpoint;
use crate::config::Cars;
use crate::rpc::Refusal;

/// `tire_friction` of CARLA's cars.
const CARLA_FRICTION: f32 = 3.5;
/// `max_steer_angle` of CARLA's cars: 70°.
const CARLA_STEER_RAD: f32 = 70.0 * std::f32::consts::PI / 180.0;
/// Cornering stiffness over load of its tyres, per radian, front as rear: rear wheels of CARLA's
/// Lincoln slide 1/11 rad sideways for 1 g at speed, and more when slow.
const CARLA_LATERAL_STIFFNESS: f32 = 10.0;
/// Slip stiffness along the wheel over load: 29 kN of the Lincoln's tyres, 39 kN of the Patrol's.
const CARLA_LONGITUDINAL_STIFFNESS: f32 = 7.0;
/// `lat_stiff_max_load` of CARLA's cars.
const CARLA_LATERAL_LOAD_MAX: f32 = 3.0;

impl Endpoint {
    /// Tells of the option once real cars are to drive a town of CARLA's.
    pub(crate) fn mention_cars(&self, map: &roads::Map) {
        if self.config.cars == Cars::Real && is_carlas_town(map.name(), map.text()) {
            tracing::info!(
                port = self.port,
                map = map.name(),
                "real tyres do not hold its corners at its speeds: --cars carla does"
            );
        }
    }

    /// Makes those of these new actors that are cars CARLA's, where that is wanted.
    pub(crate) async fn fit_cars(&mut self, spawned: &[ActorId]) -> Result<(), Refusal> {
        if self.config.cars == Cars::Real {
            return Ok(());
        }
        let episode = self.episode()?;
        let fit = |actor: &ActorId| {
            let blueprint = &episode.actor(*actor)?.description.type_id;
            Some(Command::Vehicle(VehicleCommand::Physics {
                actor: *actor,
                physics: Box::new(as_in_carla(blueprint)?),
            }))
        };
        let commands: Vec<Command> = spawned.iter().filter_map(fit).collect();
        if commands.is_empty() {
            return Ok(());
        }
        for refusal in self.run_now(commands).await?.into_iter().filter_map(Result::err) {
            tracing::warn!(%refusal, "a car stays a real one");
        }
        Ok(())
    }
}

/// Whether this is a file of CARLA's for one of its towns, and not a town of ours.
fn is_carlas_town(name: &str, text: &str) -> bool {
    name.starts_with("Town")
        && !text.lines().take(4).any(|line| line.contains("vendor=\"Causeway\""))
}

/// The centre of mass is so low that tyres slide before the car tips over: with so much grip a van
/// would lie down in a corner. `None` for what has not four wheels: riders lean no further for any
/// tyre.
fn as_in_carla(blueprint: &str) -> Option<VehiclePhysics> {
    let Class::Vehicle(model) = blueprints::find(blueprint)?.class else { return None };
    let mut physics = model.physics.clone();
    if physics.wheels.len() < 4 {
        return None;
    }
    physics.handling = Handling::Carla;
    // CARLA's cars have neither. Anti-lock brakes that spare the rear wheel with less load would
    // take both rear brakes from a car in a bend that leans as hard as these tyres let it.
    (physics.anti_lock, physics.stability_control) = (false, false);
    engines::fit(blueprint, &mut physics, model.wheel_radius_m);
    let half_track_m = model.track_m / 2.0;
    physics.centre_of_mass_m.z = physics.centre_of_mass_m.z.min(half_track_m / CARLA_FRICTION);
    for wheel in &mut physics.wheels {
        wheel.tyre_friction = CARLA_FRICTION;
        wheel.lateral_stiffness = CARLA_LATERAL_STIFFNESS;
        wheel.lateral_stiffness_load_max = CARLA_LATERAL_LOAD_MAX;
        wheel.longitudinal_stiffness = CARLA_LONGITUDINAL_STIFFNESS;
        if wheel.steer_rad_max > 0.0 {
            wheel.steer_rad_max = CARLA_STEER_RAD;
        }
    }
    Some(physics)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_town_of_ours_is_not_taken_for_carlas() {
        let ours = roads::town::build("Town01").unwrap();
        assert!(!is_carlas_town("Town01", &ours));
        let carlas = "<OpenDRIVE>\n<header revMajor=\"1\" revMinor=\"4\" name=\"\" version=\"1\">";
        assert!(is_carlas_town("Town10HD_Opt", carlas));
        assert!(!is_carlas_town("Mine", carlas));
    }

    #[test]
    fn none_tips_over_before_its_tyres_slide() {
        for blueprint in
            ["vehicle.volkswagen.t2", "vehicle.mini.cooper_s", "vehicle.mitsubishi.fusorosa"]
        {
            let physics = as_in_carla(blueprint).unwrap();
            let half_track_m = physics.wheels[0].position_m.y.abs();
            assert!(half_track_m >= 3.5 * physics.centre_of_mass_m.z * 0.999, "{blueprint}");
        }
    }

    #[test]
    fn cars_get_carlas_tyres_and_only_their_front_wheels_its_lock() {
        let physics = as_in_carla("vehicle.tesla.model3").unwrap();
        assert_eq!(physics.handling, Handling::Carla);
        assert!(!physics.anti_lock && !physics.stability_control, "as CARLA's");
        assert!(physics.wheels.iter().all(|wheel| wheel.tyre_friction == 3.5));
        let locks: Vec<f32> =
            physics.wheels.iter().map(|wheel| wheel.steer_rad_max.to_degrees().round()).collect();
        assert_eq!(locks, [70.0, 70.0, 0.0, 0.0]);
        assert_eq!(as_in_carla("vehicle.kawasaki.ninja"), None);
        assert_eq!(as_in_carla("walker.pedestrian.0001"), None);
    }
}
