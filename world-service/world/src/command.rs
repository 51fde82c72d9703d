//! Commands: checked whole before the first change, so that a refused one changes nothing.

mod body;
mod light;
mod scenery;
mod settings;
mod vehicle;
mod walker;

use schemas::{
    ActorId, AgentCommand, Command, CommandReply, Error, ErrorCode, SensorCommand, TrafficCommand,
    TrafficLightCommand,
};

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
        let done = match command {
            Command::SpawnActor {
                blueprint,
                reference_from_actor: pose,
                linear_velocity_mps,
                attributes,
                attachment,
                id,
            } => {
                let (linear_mps, attachment, id) = (*linear_velocity_mps, *attachment, *id);
                let wish = Wish { blueprint, pose, linear_mps, attributes, attachment, id };
                return self.spawn(&wish).map(Some);
            }
            Command::DestroyActor { actor } => self.destroy(*actor),
            Command::Body(command) => self.change_body(command),
            Command::Vehicle(command) => self.change_vehicle(command),
            Command::Agent(command) => self.change_agent(command),
            Command::Traffic(command) => self.change_traffic(command),
            Command::Walker(command) => self.change_walker(command),
            Command::TrafficLight(command) => self.change_traffic_light(command),
            Command::Scenery(command) => self.change_scenery(command),
            Command::Sensor(command) => self.change_sensor(command),
            Command::SetWeather { weather } => self.set_weather(*weather),
            Command::SetTimeStep { dt_secs, substep_secs_max, substeps_max } => {
                self.set_time_step(*dt_secs, *substep_secs_max, *substeps_max)
            }
        };
        done.map(|()| None)
    }

    fn change_agent(&mut self, command: &AgentCommand) -> Result<(), Error> {
        match command {
            AgentCommand::Set { actor, options, keep_route } => {
                self.set_agent(*actor, *options, *keep_route)
            }
            AgentCommand::SetRoute { actor, places_m } => self.set_agent_route(*actor, places_m),
            AgentCommand::Drive { actor, on } => self.drive_agent(*actor, *on),
        }
    }

    fn change_traffic(&mut self, command: &TrafficCommand) -> Result<(), Error> {
        match *command {
            TrafficCommand::Join { actor, behaviour } => self.set_traffic(actor, behaviour, false),
            TrafficCommand::Spawn { count, behaviour } => self.spawn_traffic(count, behaviour),
            TrafficCommand::SetHybrid { radius_m } => self.set_hybrid_traffic(radius_m),
        }
    }

    fn change_traffic_light(&mut self, command: &TrafficLightCommand) -> Result<(), Error> {
        match *command {
            TrafficLightCommand::Set { actor, colour, green_secs, yellow_secs, red_secs } => {
                self.set_traffic_light(actor, colour, [green_secs, yellow_secs, red_secs])
            }
            TrafficLightCommand::Freeze { frozen } => {
                self.freeze_traffic_lights(frozen);
                Ok(())
            }
            TrafficLightCommand::Reset { actor } => self.reset_traffic_lights(actor),
        }
    }

    fn change_sensor(&mut self, command: &SensorCommand) -> Result<(), Error> {
        match command {
            SensorCommand::Listen { sensor, on } => {
                self.state.index_of(*sensor)?;
                self.state.sensors.listen(*sensor, *on)
            }
            SensorCommand::IgnoreVehicles { sensor, vehicles } => {
                self.state.index_of(*sensor)?;
                for vehicle in vehicles {
                    self.vehicle_mut(*vehicle)?;
                }
                self.state.sensors.ignore(*sensor, vehicles)
            }
            SensorCommand::SendV2x { sensor, text } => {
                self.state.index_of(*sensor)?;
                self.state.sensors.send(*sensor, text)
            }
        }
    }

    fn destroy(&mut self, id: ActorId) -> Result<(), Error> {
        if let Some(position) = self.fixed_position(id) {
            self.destroy_signal(id, position);
            return Ok(());
        }
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
