//! Commands for driving, for bodies, and for what surrounds them.

use std::sync::Arc;

use schemas::{
    AckermannControl, AgentBehaviour, AgentCommand, AgentOptions, BodyCommand, BodySwitch,
    BonesChange, Command, MaterialParameter, Proximity, PushKind, SceneryCommand, SensorCommand,
    Texture, TrafficCommand, TrafficLightColour, TrafficLightCommand, Vec3, VehicleCommand,
    WalkerCommand, WalkerStage,
};

use super::vehicles::{gains, physics};
use super::{actor, bones, walker_control};

pub(crate) fn driving_commands() -> Vec<Command> {
    let control = AckermannControl {
        steer_rad: 0.1,
        steer_radps: 0.2,
        speed_mps: -3.0,
        acceleration_mps2: 1.5,
        jerk_mps3: 0.5,
    };
    vec![
        Command::Vehicle(VehicleCommand::Ackermann { actor: actor(1), control }),
        Command::Vehicle(VehicleCommand::AckermannGains { actor: actor(1), gains: gains() }),
        Command::Vehicle(VehicleCommand::Physics { actor: actor(1), physics: Box::new(physics()) }),
        Command::Vehicle(VehicleCommand::Lights { actor: actor(1), lights: 0x801 }),
        Command::Vehicle(VehicleCommand::Doors { actor: actor(1), doors: 0b11, open: true }),
        Command::Agent(AgentCommand::Set {
            actor: actor(1),
            options: agent_options(),
            keep_route: true,
        }),
        Command::Agent(AgentCommand::Set {
            actor: actor(1),
            options: AgentOptions::default(),
            keep_route: false,
        }),
        Command::Agent(AgentCommand::SetRoute {
            actor: actor(1),
            places_m: vec![Vec3::x(), Vec3::y()],
        }),
        Command::Agent(AgentCommand::SetRoute { actor: actor(1), places_m: Vec::new() }),
        Command::Agent(AgentCommand::Drive { actor: actor(1), on: true }),
        Command::Traffic(TrafficCommand::Join {
            actor: actor(1),
            behaviour: AgentBehaviour::Aggressive,
        }),
        Command::Traffic(TrafficCommand::Spawn { count: 9, behaviour: None }),
        Command::Traffic(TrafficCommand::SetHybrid { radius_m: Some(70.0) }),
        Command::Traffic(TrafficCommand::SetHybrid { radius_m: None }),
        Command::Traffic(TrafficCommand::Spawn {
            count: 9,
            behaviour: Some(AgentBehaviour::Normal),
        }),
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
    let push = |kind| Command::Body(BodyCommand::Push { actor: actor(1), kind, amount: Vec3::x() });
    let switch =
        |switch| Command::Body(BodyCommand::SetSwitch { actor: actor(1), switch, on: true });
    vec![
        Command::Walker(WalkerCommand::Control { actor: actor(2), control: walker_control() }),
        Command::Walker(WalkerCommand::Agent {
            actor: actor(2),
            goal_m: Some(Vec3::y()),
            speed_mps: Some(1.5),
            crossing_share: 0.25,
        }),
        Command::Walker(WalkerCommand::Agent {
            actor: actor(2),
            goal_m: None,
            speed_mps: None,
            crossing_share: 0.0,
        }),
        Command::Walker(WalkerCommand::Trajectory {
            actor: actor(2),
            stages: vec![
                WalkerStage { to_m: Vec3::x(), speed_mps: 1.5, wait_secs: 2.0 },
                WalkerStage { to_m: Vec3::y(), speed_mps: 0.5, wait_secs: 0.0 },
            ],
            trigger: Some(Proximity { actor: actor(1), within_m: 25.0 }),
        }),
        Command::Walker(WalkerCommand::Trajectory {
            actor: actor(2),
            stages: vec![WalkerStage { to_m: Vec3::z(), speed_mps: 1.0, wait_secs: 0.0 }],
            trigger: None,
        }),
        Command::Walker(WalkerCommand::State {
            actor: actor(2),
            world_from_actor: pose,
            speed_mps: 1.4,
        }),
        Command::Walker(WalkerCommand::Bones {
            actor: actor(2),
            change: BonesChange { afresh: true, bones: bones(), share: None },
        }),
        Command::Walker(WalkerCommand::Bones {
            actor: actor(2),
            change: BonesChange { share: Some(0.0), ..BonesChange::default() },
        }),
        Command::Body(BodyCommand::SetConstantVelocity {
            actor: actor(1),
            velocity_mps: Some(Vec3::x()),
        }),
        Command::Body(BodyCommand::SetConstantVelocity { actor: actor(1), velocity_mps: None }),
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
        Command::TrafficLight(TrafficLightCommand::Set {
            actor: actor(9),
            colour: Some(TrafficLightColour::Off),
            green_secs: Some(8.0),
            yellow_secs: None,
            red_secs: Some(0.0),
        }),
        Command::TrafficLight(TrafficLightCommand::Freeze { frozen: true }),
        Command::TrafficLight(TrafficLightCommand::Reset { actor: None }),
        Command::TrafficLight(TrafficLightCommand::Reset { actor: Some(actor(9)) }),
        Command::SetTimeStep { dt_secs: 0.1, substep_secs_max: Some(0.02), substeps_max: None },
        Command::Sensor(SensorCommand::Listen { sensor: actor(5), on: false }),
        Command::Sensor(SensorCommand::IgnoreVehicles {
            sensor: actor(5),
            vehicles: vec![actor(1), actor(4)],
        }),
        Command::Sensor(SensorCommand::IgnoreVehicles { sensor: actor(5), vehicles: Vec::new() }),
        Command::Sensor(SensorCommand::SendV2x {
            sensor: actor(5), text: "grüß dich".to_owned()
        }),
        Command::Scenery(SceneryCommand::Layers { layers: 0x11, loaded: false }),
        Command::Scenery(SceneryCommand::Objects { objects: vec![1, u64::MAX], enabled: true }),
        Command::Scenery(SceneryCommand::Objects { objects: Vec::new(), enabled: false }),
        paint(MaterialParameter::Diffuse),
        paint(MaterialParameter::Emissive),
    ]
}

fn paint(parameter: MaterialParameter) -> Command {
    let texture = Texture::new([2, 1], 1.5, &[255, 0, 128, 1, 2, 3]);
    let texture = Arc::new(texture.expect("two pixels"));
    Command::Scenery(SceneryCommand::Paint { objects: vec![7, u64::MAX], parameter, texture })
}
