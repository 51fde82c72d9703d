//! Commands of every kind, good and bad, near the origin.
#![allow(unreachable_pub, clippy::unwrap_used, reason = "test code")]

use std::sync::Arc;

use proptest::prelude::*;
use schemas::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, Attachment, AttachmentKind, Attribute,
    BodyCommand, BodySwitch, BonePose, BonesChange, Command, MaterialParameter, PilotMode,
    PushKind, SceneryCommand, SensorCommand, Texture, TrafficCommand, Vec3, VehicleCommand,
    VehicleControl, WalkerCommand, WalkerControl, Weather, level_pose,
};

fn any_actor() -> impl Strategy<Value = ActorId> + Clone {
    (1u32..8).prop_map(|id| ActorId::new(id).unwrap())
}

/// A vector that is mostly within `size`, and sometimes not one.
fn any_vector(size: f32) -> impl Strategy<Value = Vec3> + Clone {
    let part = prop_oneof![12 => -1.0f32..1.0, 4 => Just(0.0), 1 => Just(f32::NAN)];
    [part.clone(), part.clone(), part].prop_map(move |parts| Vec3::from(parts) * size)
}

/// Sensors and props, alone or on another actor, with good and bad attributes.
fn any_thing() -> impl Strategy<Value = Command> {
    let blueprint = prop_oneof![
        Just("sensor.other.imu"),
        Just("static.prop.constructioncone"),
        Just("spectator"),
        Just("vehicle.audi.tt"),
    ];
    let kind = prop_oneof![
        Just(AttachmentKind::Rigid),
        Just(AttachmentKind::SpringArm),
        Just(AttachmentKind::SpringArmGhost)
    ];
    let attachment = prop::option::of((any_actor(), kind));
    let colour = prop::option::of(prop_oneof![Just("1,2,3"), Just("blue")]);
    let id = prop_oneof![8 => Just(None), 1 => (1u32..20).prop_map(ActorId::new)];
    (blueprint, attachment, colour, id, 0.0f32..30.0, -6.0f32..6.0).prop_map(
        |(blueprint, attachment, colour, id, x_m, y_m)| Command::SpawnActor {
            blueprint: blueprint.to_owned(),
            reference_from_actor: level_pose(Vec3::new(x_m, y_m, 0.4), 0.3),
            linear_velocity_mps: Vec3::zeros(),
            attributes: colour
                .map(|value| Attribute { id: "color".to_owned(), value: value.to_owned() })
                .into_iter()
                .collect(),
            attachment: attachment.map(|(parent, kind)| Attachment { parent, kind }),
            id,
        },
    )
}

/// Poses of bones, now and then one that no walker has.
fn any_bones() -> impl Strategy<Value = Command> {
    let turn = -3.2f32..3.2;
    let bone = (0u8..67, any_vector(0.5), turn).prop_map(|(bone, at_m, yaw_rad)| BonePose {
        bone,
        parent_from_bone: level_pose(at_m, yaw_rad),
    });
    let bones = prop::collection::vec(bone, 0..4);
    (any_actor(), any::<bool>(), bones, prop::option::of(-0.1f32..1.1)).prop_map(
        |(actor, afresh, bones, share)| {
            let change = BonesChange { afresh, bones, share };
            Command::Walker(WalkerCommand::Bones { actor, change })
        },
    )
}

/// What is done to bodies and walkers from outside.
fn any_handling() -> impl Strategy<Value = Command> {
    let kind = prop_oneof![
        Just(PushKind::Impulse),
        Just(PushKind::Force),
        Just(PushKind::AngularImpulse),
        Just(PushKind::Torque)
    ];
    let switch = prop_oneof![
        Just(BodySwitch::Physics),
        Just(BodySwitch::Gravity),
        Just(BodySwitch::Collisions)
    ];
    let walk = (any_actor(), any_vector(1.0), 0.0f32..4.0, any::<bool>()).prop_map(
        |(actor, direction, speed_mps, jump)| {
            Command::Walker(WalkerCommand::Control {
                actor,
                control: WalkerControl { direction, speed_mps, jump },
            })
        },
    );
    let place = (any_actor(), 0.0f32..30.0, -6.0f32..6.0, -1.0f32..3.0).prop_map(
        |(actor, x_m, y_m, speed_mps)| {
            Command::Walker(WalkerCommand::State {
                actor,
                world_from_actor: level_pose(Vec3::new(x_m, y_m, 0.9), 2.0),
                speed_mps,
            })
        },
    );
    prop_oneof![
        3 => walk,
        1 => place,
        2 => any_bones(),
        2 => (any_actor(), prop::option::of(any_vector(12.0)))
            .prop_map(|(actor, velocity_mps)| Command::Body(BodyCommand::SetConstantVelocity { actor, velocity_mps })),
        2 => (any_actor(), kind, any_vector(9_000.0))
            .prop_map(|(actor, kind, amount)| Command::Body(BodyCommand::Push { actor, kind, amount })),
        3 => (any_actor(), switch, any::<bool>())
            .prop_map(|(actor, switch, on)| Command::Body(BodyCommand::SetSwitch { actor, switch, on })),
        1 => (any_actor(), any::<u8>(), any::<bool>())
            .prop_map(|(actor, doors, open)| Command::Vehicle(VehicleCommand::Doors { actor, doors, open })),
        1 => (any_actor(), any::<u32>())
            .prop_map(|(actor, lights)| Command::Vehicle(VehicleCommand::Lights { actor, lights })),
        1 => (0.0005f64..0.12, prop::option::of(0.0f64..0.05), prop::option::of(0u32..40)).prop_map(
            |(dt_secs, substep_secs_max, substeps_max)| Command::SetTimeStep {
                dt_secs,
                substep_secs_max,
                substeps_max,
            },
        ),
    ]
}

fn any_pilot() -> impl Strategy<Value = Command> {
    let mode = prop_oneof![
        Just(PilotMode::KeepLane),
        Just(PilotMode::ChangeLaneLeft),
        Just(PilotMode::ChangeLaneRight)
    ];
    (any_actor(), mode, prop::option::of(-2.0f32..20.0)).prop_map(
        |(actor, mode, target_speed_mps)| {
            Command::Vehicle(VehicleCommand::Pilot { actor, mode, target_speed_mps })
        },
    )
}

fn any_agent() -> impl Strategy<Value = Command> {
    let behaviour = prop_oneof![Just(AgentBehaviour::Basic), Just(AgentBehaviour::Aggressive)];
    let set = (any_actor(), behaviour, prop::option::of(-2.0f32..20.0), any::<bool>()).prop_map(
        |(actor, behaviour, target_speed_mps, keep_route)| {
            Command::Agent(AgentCommand::Set {
                actor,
                options: AgentOptions { behaviour, target_speed_mps, ..AgentOptions::default() },
                keep_route,
            })
        },
    );
    let place = (-20.0f32..200.0, -9.0f32..9.0).prop_map(|(x_m, y_m)| Vec3::new(x_m, y_m, 0.0));
    let route = (any_actor(), prop::collection::vec(place, 0..3))
        .prop_map(|(actor, places_m)| Command::Agent(AgentCommand::SetRoute { actor, places_m }));
    let drive = (any_actor(), prop::bool::weighted(0.8))
        .prop_map(|(actor, on)| Command::Agent(AgentCommand::Drive { actor, on }));
    prop_oneof![set, route, drive]
}

fn any_traffic() -> impl Strategy<Value = Command> {
    let behaviour = AgentBehaviour::Normal;
    prop_oneof![
        3 => any_actor().prop_map(move |actor| Command::Traffic(TrafficCommand::Join { actor, behaviour })),
        1 => (0u32..3).prop_map(|count| Command::Traffic(TrafficCommand::Spawn { count, behaviour: None })),
        1 => prop::option::of(-5.0f32..30.0)
            .prop_map(|radius_m| Command::Traffic(TrafficCommand::SetHybrid { radius_m })),
    ]
}

/// The house and the wall of the straight road, its surface, and what is not there.
fn any_scenery() -> impl Strategy<Value = Command> {
    use MaterialParameter::{Diffuse, Emissive};
    let object = prop_oneof![
        4 => (0u64..2).prop_map(|position| 2 << 56 | 1 << 24 | position),
        1 => Just(1 << 56 | 1 << 24),
        1 => any::<u64>(),
    ];
    let painted = object.clone();
    prop_oneof![
        (any::<u16>(), any::<bool>()).prop_map(|(layers, loaded)| Command::Scenery(
            SceneryCommand::Layers { layers, loaded }
        )),
        (prop::collection::vec(object, 0..3), any::<bool>()).prop_map(|(objects, enabled)| {
            Command::Scenery(SceneryCommand::Objects { objects, enabled })
        }),
        (prop::collection::vec(painted, 0..3), any::<bool>(), any::<u8>()).prop_map(
            |(objects, shines, grey)| {
                let parameter = if shines { Emissive } else { Diffuse };
                let texture = Arc::new(Texture::new([1, 1], 1.0, &[grey % 3; 3]).unwrap());
                Command::Scenery(SceneryCommand::Paint { objects, parameter, texture })
            }
        ),
        (1u32..8, prop::collection::vec(any_actor(), 0..3)).prop_map(|(sensor, vehicles)| {
            Command::Sensor(SensorCommand::IgnoreVehicles {
                sensor: ActorId::new(sensor).unwrap(),
                vehicles,
            })
        }),
        (1u32..8, ".{0,60}").prop_map(|(sensor, text)| Command::Sensor(SensorCommand::SendV2x {
            sensor: ActorId::new(sensor).unwrap(),
            text,
        })),
    ]
}

fn any_pose() -> impl Strategy<Value = Command> {
    (any_actor(), 0.0f32..40.0, -9.0f32..6.0, 0.0f32..3.0).prop_map(|(actor, x_m, y_m, z_m)| {
        Command::Body(BodyCommand::SetPose {
            actor,
            reference_from_actor: level_pose(Vec3::new(x_m, y_m, z_m), 1.0),
        })
    })
}

/// Any command, good or bad.
pub fn command() -> impl Strategy<Value = Command> {
    let actor = any_actor();
    let number = prop_oneof![8 => -1.2f32..1.2, 1 => Just(f32::NAN), 1 => Just(f32::INFINITY)];
    let blueprint = prop_oneof![
        3 => Just("vehicle.lincoln.mkz"),
        1 => Just("vehicle.audi.tt"),
        3 => Just("walker.pedestrian.0007"),
        1 => Just("vehicle.unknown"),
    ];
    let spawn = (blueprint, 0.0f32..40.0, -9.0f32..6.0, -3.2f32..3.2, -5.0f32..25.0).prop_map(
        |(blueprint, x_m, y_m, yaw_rad, forward_mps)| {
            let pose = level_pose(Vec3::new(x_m, y_m, 0.5), yaw_rad);
            Command::spawn(blueprint, pose, pose.rotation * Vec3::new(forward_mps, 0.0, 0.0))
        },
    );
    let drive = (actor.clone(), number.clone(), number.clone(), any::<bool>(), any::<bool>())
        .prop_map(|(actor, steer, pedal, hand_brake, reverse)| {
            Command::Vehicle(VehicleCommand::Control {
                actor,
                control: VehicleControl {
                    throttle: pedal.max(0.0),
                    steer,
                    brake: (-pedal).max(0.0),
                    hand_brake,
                    reverse,
                    ..VehicleControl::default()
                },
            })
        });
    let velocity = (actor.clone(), number.clone(), number).prop_map(|(actor, x, z)| {
        let linear_mps = Vec3::new(20.0 * x, 0.0, 3.0 * z);
        Command::Body(BodyCommand::SetVelocity {
            actor,
            linear_mps: Some(linear_mps),
            angular_radps: Some(Vec3::zeros()),
        })
    });
    let weather = (-10.0f32..110.0).prop_map(|wetness_percent| Command::SetWeather {
        weather: Weather { wetness_percent, ..Weather::CLEAR_NOON },
    });
    prop_oneof![
        4 => spawn,
        2 => any_thing(),
        6 => any_handling(),
        4 => drive,
        2 => any_pilot(),
        3 => any_agent(),
        3 => any_traffic(),
        2 => any_scenery(),
        1 => velocity,
        1 => any_pose(),
        1 => weather,
        1 => actor.prop_map(|actor| Command::DestroyActor { actor }),
    ]
}
