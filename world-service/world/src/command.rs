//! Commands: checked whole before the first change, so that a refused one changes nothing.

mod body;
mod scenery;
mod settings;
mod vehicle;
mod walker;

use schemas::{ActorId, Command, CommandReply, Error, ErrorCode};

use crate::actor::Actor;
use crate::physics::BodyHandle;
use crate::spawn::Wish;
use crate::world::World;

impl World {
    /// Carries out one command.
    ///
    /// # Errors
    /// Says what was wanted and what was found; the world is unchanged.
    pub fn apply(&mut self, command: &Command) -> CommandReply {
        let Command::SpawnActor {
            blueprint,
            world_from_actor: pose,
            linear_velocity_mps,
            attributes,
            attachment,
        } = command
        else {
            return self.change(command).map(|()| None);
        };
        let (linear_mps, attachment) = (*linear_velocity_mps, *attachment);
        self.spawn(&Wish { blueprint, pose, linear_mps, attributes, attachment }).map(Some)
    }

    /// Carries out a command that spawns nothing.
    fn change(&mut self, command: &Command) -> Result<(), Error> {
        match command {
            Command::DestroyActor { actor } => self.destroy(*actor),
            Command::SetControl { actor, control } => self.set_control(*actor, *control),
            Command::SetPilot { actor, mode, target_speed_mps } => {
                self.set_pilot(*actor, *mode, *target_speed_mps)
            }
            Command::SetAgent { actor, options, keep_route } => {
                self.set_agent(*actor, *options, *keep_route)
            }
            Command::SetAgentRoute { actor, places_m } => self.set_agent_route(*actor, places_m),
            Command::DriveAgent { actor, on } => self.drive_agent(*actor, *on),
            Command::SetTraffic { actor, behaviour } => self.set_traffic(*actor, *behaviour),
            Command::SetHybridTraffic { radius_m } => self.set_hybrid_traffic(*radius_m),
            Command::SpawnTraffic { count, behaviour } => self.spawn_traffic(*count, *behaviour),
            Command::SetWalkerAgent { actor, goal_m, speed_mps, crossing_share } => {
                self.set_walker_agent(*actor, *goal_m, *speed_mps, *crossing_share)
            }
            Command::SetWalkerControl { actor, control } => {
                self.set_walker_control(*actor, *control)
            }
            Command::SetWalkerState { actor, world_from_actor, speed_mps } => {
                self.set_walker_state(*actor, world_from_actor, *speed_mps)
            }
            Command::SetAckermann { actor, control } => self.set_ackermann(*actor, *control),
            Command::SetAckermannGains { actor, gains } => self.set_gains(*actor, *gains),
            Command::SetVehiclePhysics { actor, physics } => {
                self.set_vehicle_physics(*actor, physics)
            }
            Command::SetVelocity { actor, linear_mps, angular_radps } => {
                self.set_velocity(*actor, *linear_mps, *angular_radps)
            }
            Command::SetConstantVelocity { actor, velocity_mps } => {
                self.set_constant_velocity(*actor, *velocity_mps)
            }
            Command::Push { actor, kind, amount } => self.push(*actor, *kind, *amount),
            Command::SetPose { actor, world_from_actor } => self.set_pose(*actor, world_from_actor),
            Command::SetSwitch { actor, switch, on } => self.set_switch(*actor, *switch, *on),
            Command::SetVehicleLights { actor, lights } => self.set_vehicle_lights(*actor, *lights),
            Command::SetDoors { actor, doors, open } => self.set_doors(*actor, *doors, *open),
            Command::SetWeather { weather } => self.set_weather(*weather),
            Command::SetTimeStep { dt_secs, substep_secs_max, substeps_max } => {
                self.set_time_step(*dt_secs, *substep_secs_max, *substeps_max)
            }
            Command::SetTrafficLight { actor, colour, green_secs, yellow_secs, red_secs } => {
                let times_secs = [*green_secs, *yellow_secs, *red_secs];
                self.set_traffic_light(*actor, *colour, times_secs)
            }
            Command::FreezeTrafficLights { frozen } => {
                self.freeze_traffic_lights(*frozen);
                Ok(())
            }
            Command::ResetTrafficLights { actor } => self.reset_traffic_lights(*actor),
            Command::Listen { .. } | Command::IgnoreVehicles { .. } | Command::SendV2x { .. } => {
                self.change_sensor(command)
            }
            other => self.change_scenery(other),
        }
    }

    fn change_sensor(&mut self, command: &Command) -> Result<(), Error> {
        match command {
            Command::Listen { sensor, on } => {
                self.state.index_of(*sensor)?;
                self.state.sensors.listen(*sensor, *on)
            }
            Command::IgnoreVehicles { sensor, vehicles } => {
                self.state.index_of(*sensor)?;
                for vehicle in vehicles {
                    self.vehicle_mut(*vehicle)?;
                }
                self.state.sensors.ignore(*sensor, vehicles)
            }
            Command::SendV2x { sensor, text } => {
                self.state.index_of(*sensor)?;
                self.state.sensors.send(*sensor, text)
            }
            other => unreachable!("{other:?} is not for a sensor"),
        }
    }

    fn change_scenery(&mut self, command: &Command) -> Result<(), Error> {
        match command {
            Command::SetMapLayers { layers, loaded } => {
                self.set_map_layers(*layers, *loaded);
                Ok(())
            }
            Command::SetEnvironmentObjects { objects, enabled } => {
                self.set_environment_objects(objects, *enabled)
            }
            other => Err(Error::new(ErrorCode::Unsupported, "the world cannot do this")
                .found(format!("{other:?}"))),
        }
    }

    fn destroy(&mut self, id: ActorId) -> Result<(), Error> {
        self.check_spawned(id)?;
        let index = self.state.index_of(id)?;
        self.state.remove(index);
        Ok(())
    }
}

/// # Errors
/// `InvalidArgument` for an actor that is not in the physics.
fn rigid(actor: &Actor) -> Result<BodyHandle, Error> {
    actor.rigid().ok_or_else(|| {
        Error::new(ErrorCode::InvalidArgument, "the actor has no body of its own")
            .wanted("a vehicle, a walker or a prop that stands alone")
            .found(format!("{}, {}", actor.id, actor.blueprint().id))
    })
}
