//! Commands for driving, for bodies, and for what surrounds them.

use schemas::{
    AckermannControl, AgentBehaviour, AgentOptions, BodySwitch, Command, PushKind,
    TrafficLightColour, Vec3,
};

use super::vehicles::{gains, physics};
use super::{actor, walker_control};

pub(crate) fn driving_commands() -> Vec<Command> {
    let control = AckermannControl {
        steer_rad: 0.1,
        steer_radps: 0.2,
        speed_mps: -3.0,
        acceleration_mps2: 1.5,
        jerk_mps3: 0.5,
    };
    vec![
        Command::SetAckermann { actor: actor(1), control },
        Command::SetAckermannGains { actor: actor(1), gains: gains() },
        Command::SetVehiclePhysics { actor: actor(1), physics: Box::new(physics()) },
        Command::SetVehicleLights { actor: actor(1), lights: 0x801 },
        Command::SetDoors { actor: actor(1), doors: 0b11, open: true },
        Command::SetAgent { actor: actor(1), options: agent_options(), keep_route: true },
        Command::SetAgent { actor: actor(1), options: AgentOptions::default(), keep_route: false },
        Command::SetAgentRoute { actor: actor(1), places_m: vec![Vec3::x(), Vec3::y()] },
        Command::SetAgentRoute { actor: actor(1), places_m: Vec::new() },
        Command::DriveAgent { actor: actor(1), on: true },
        Command::SetTraffic { actor: actor(1), behaviour: AgentBehaviour::Aggressive },
        Command::SpawnTraffic { count: 9, behaviour: None },
        Command::SetHybridTraffic { radius_m: Some(70.0) },
        Command::SetHybridTraffic { radius_m: None },
        Command::SpawnTraffic { count: 9, behaviour: Some(AgentBehaviour::Normal) },
    ]
}

fn agent_options() -> AgentOptions {
    AgentOptions {
        behaviour: AgentBehaviour::Cautious,
        target_speed_mps: Some(12.5),
        follow_speed_limits: true,
        ignore_lights: true,
        ignore_stop_signs: true,
        ignore_vehicles: true,
        light_distance_m: Some(4.0),
        vehicle_distance_m: Some(6.0),
    }
}

pub(crate) fn body_commands(pose: schemas::Pose) -> Vec<Command> {
    let push = |kind| Command::Push { actor: actor(1), kind, amount: Vec3::x() };
    let switch = |switch| Command::SetSwitch { actor: actor(1), switch, on: true };
    vec![
        Command::SetWalkerControl { actor: actor(2), control: walker_control() },
        Command::SetWalkerAgent {
            actor: actor(2),
            goal_m: Some(Vec3::y()),
            speed_mps: Some(1.5),
            crossing_share: 0.25,
        },
        Command::SetWalkerAgent {
            actor: actor(2),
            goal_m: None,
            speed_mps: None,
            crossing_share: 0.0,
        },
        Command::SetWalkerState { actor: actor(2), world_from_actor: pose, speed_mps: 1.4 },
        Command::SetConstantVelocity { actor: actor(1), velocity_mps: Some(Vec3::x()) },
        Command::SetConstantVelocity { actor: actor(1), velocity_mps: None },
        push(PushKind::Impulse),
        push(PushKind::Force),
        push(PushKind::AngularImpulse),
        push(PushKind::Torque),
        switch(BodySwitch::Physics),
        switch(BodySwitch::Gravity),
        switch(BodySwitch::Collisions),
    ]
}

pub(crate) fn scene_commands() -> Vec<Command> {
    vec![
        Command::SetTrafficLight {
            actor: actor(9),
            colour: Some(TrafficLightColour::Off),
            green_secs: Some(8.0),
            yellow_secs: None,
            red_secs: Some(0.0),
        },
        Command::FreezeTrafficLights { frozen: true },
        Command::ResetTrafficLights { actor: None },
        Command::ResetTrafficLights { actor: Some(actor(9)) },
        Command::SetTimeStep { dt_secs: 0.1, substep_secs_max: Some(0.02), substeps_max: None },
        Command::Listen { sensor: actor(5), on: false },
        Command::IgnoreVehicles { sensor: actor(5), vehicles: vec![actor(1), actor(4)] },
        Command::IgnoreVehicles { sensor: actor(5), vehicles: Vec::new() },
        Command::SendV2x { sensor: actor(5), text: "grüß dich".to_owned() },
        Command::SetMapLayers { layers: 0x11, loaded: false },
        Command::SetEnvironmentObjects { objects: vec![1, u64::MAX], enabled: true },
        Command::SetEnvironmentObjects { objects: Vec::new(), enabled: false },
    ]
}
