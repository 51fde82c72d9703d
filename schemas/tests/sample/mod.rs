//! One of everything that crosses the wire.

#![allow(clippy::unwrap_used, reason = "constants that are valid by inspection")]

mod commands;
mod sensors;
mod vehicles;

use schemas::{
    ActorDescription, ActorId, ActorKind, ActorState, AgentState, AgentStatus, Alive, Attachment,
    AttachmentKind, Attribute, BodyCommand, BonePose, Camera, Coat, Collision, Command,
    EncodedFrame, Error, ErrorCode, Exposure, Frame, Halt, HaltReason, HiddenScenery, Image,
    ImageEncoding, ImageKind, Images, Lease, MapRef, Paint, PictureQuality, PilotMode, RayHit,
    RenderJob, Reply, Request, RulesBroken, ServiceKind, Staging, StreetLight, Tick, TickItem,
    TickOutcome, TickResult, TrafficLightColour, TrafficLightState, Vec3, VehicleCommand,
    VehicleControl, VehicleFailure, VehicleReport, WalkerControl, WalkerPose, Weather, WorldId,
    WorldInfo, level_pose, wire,
};

use commands::{body_commands, driving_commands, scene_commands};
use sensors::sensors;
use vehicles::{gains, physics, telemetry};

fn world() -> WorldId {
    WorldId::new(0x1234_5678_9abc_def0).unwrap()
}

fn actor(id: u32) -> ActorId {
    ActorId::new(id).unwrap()
}

fn map() -> MapRef {
    MapRef { name: "Town10HD_Opt".into(), digest: "ab".repeat(32) }
}

fn lease() -> Option<Lease> {
    Some(Lease { owner: "scenario-1".parse().unwrap(), millis: 5_000 })
}

fn walker_control() -> WalkerControl {
    WalkerControl { direction: Vec3::y(), speed_mps: 1.4, jump: true }
}

fn traffic_light() -> TrafficLightState {
    TrafficLightState {
        actor: actor(9),
        colour: TrafficLightColour::Yellow,
        group: 3,
        frozen: true,
        elapsed_secs: 0.5,
        green_secs: 10.0,
        yellow_secs: 3.0,
        red_secs: 2.0,
    }
}

fn vehicle() -> ActorState {
    ActorState {
        id: actor(1),
        kind: ActorKind::Vehicle,
        gear: 3,
        type_index: 0,
        world_from_actor: level_pose(Vec3::new(1.5, -2.25, 0.125), 0.5),
        linear_velocity_mps: Vec3::new(11.0, 0.5, -0.25),
        angular_velocity_radps: Vec3::new(0.01, 0.02, 0.3),
        linear_acceleration_mps2: Vec3::new(-8.5, 0.0, 0.0),
        box_centre_m: Vec3::new(0.0, 0.0, 0.75),
        box_half_extent_m: Vec3::new(2.45, 0.95, 0.75),
        control: VehicleControl {
            throttle: 0.25,
            steer: -0.5,
            brake: 1.0,
            hand_brake: true,
            reverse: false,
            manual_gear: true,
            gear: -1,
        },
        road_wheel_rad: -0.125,
        colour_rgb: 0x00c0_ffee,
        parent: Some(actor(7)),
        lights: 0x8001,
        doors: 0b10_0001,
        failure: VehicleFailure::Rollover,
        speed_limit_mps: 13.5,
        traffic_light: Some(actor(9)),
        walker: walker_control(),
        gait_rad: 0.75,
    }
}

fn walker() -> ActorState {
    ActorState {
        id: actor(2),
        kind: ActorKind::Walker,
        gear: 0,
        type_index: 1,
        control: VehicleControl::default(),
        ..vehicle()
    }
}

fn bones() -> Vec<BonePose> {
    let bone = |bone, yaw_rad| BonePose {
        bone,
        parent_from_bone: level_pose(Vec3::new(0.0, 0.125, -0.25), yaw_rad),
    };
    vec![bone(5, 0.5), bone(65, -0.25)]
}

fn collision() -> Collision {
    Collision {
        actor: actor(1),
        other: Some(actor(2)),
        started: true,
        position_m: Vec3::new(3.0, 0.0, 0.5),
        impulse_ns: Vec3::new(-420.0, 3.0, 0.0),
        closing_speed_mps: 11.0,
    }
}

fn agent() -> AgentState {
    AgentState {
        actor: actor(1),
        status: AgentStatus::OnRoute,
        driving: true,
        distance_left_m: 120.5,
        target_m: Vec3::new(5.0, -2.0, 0.25),
    }
}

pub(crate) fn frame() -> Frame {
    Frame {
        world: world(),
        tick: Tick(42),
        epoch: 7,
        dt_secs: 0.05,
        state_hash: 0xfeed_beef_dead_cafe,
        seed: 11,
        map: map(),
        weather: Weather::CLEAR_NOON,
        types: vec!["vehicle.lincoln.mkz".into(), "walker.pedestrian.0015".into()],
        actors: vec![vehicle(), walker()],
        collisions: vec![collision(), Collision { other: None, started: false, ..collision() }],
        traffic_lights: vec![traffic_light()],
        agents: vec![agent()],
        hidden: HiddenScenery::default(),
        paint: paint(),
        halted: vec![Halt { tick: Tick(7), actor: actor(1), reason: HaltReason::TooFast }],
        rules_broken: vec![RulesBroken {
            actor: actor(1),
            red_lights: 1,
            stop_signs: 2,
            right_of_way: 3,
            crossings: 4,
        }],
        walker_poses: vec![WalkerPose { walker: actor(2), share: 0.5, bones: bones() }],
        sim_secs: 2.1,
    }
}

fn paint() -> Paint {
    Paint {
        textures: vec!["a".repeat(64), "b".repeat(64)],
        coats: vec![
            Coat { place: 3, diffuse: Some(1), emissive: None },
            Coat { place: 700_000, diffuse: Some(0), emissive: Some(1) },
        ],
    }
}

fn commands() -> Vec<Command> {
    let pose = level_pose(Vec3::new(1.0, 2.0, 3.0), -1.0);
    vec![
        Command::SpawnActor {
            blueprint: "vehicle.lincoln.mkz".into(),
            reference_from_actor: pose,
            linear_velocity_mps: Vec3::new(11.0, 0.0, 0.0),
            attributes: attributes(),
            attachment: attachment(),
            id: Some(actor(77)),
        },
        Command::DestroyActor { actor: actor(3) },
        Command::Vehicle(VehicleCommand::Control { actor: actor(1), control: vehicle().control }),
        Command::Vehicle(VehicleCommand::Pilot {
            actor: actor(1),
            mode: PilotMode::ChangeLaneLeft,
            target_speed_mps: Some(0.0),
        }),
        Command::Vehicle(VehicleCommand::Pilot {
            actor: actor(1),
            mode: PilotMode::KeepLane,
            target_speed_mps: None,
        }),
        Command::Body(BodyCommand::SetVelocity {
            actor: actor(1),
            linear_mps: Some(Vec3::x()),
            angular_radps: None,
        }),
        Command::Body(BodyCommand::SetPose { actor: actor(1), reference_from_actor: pose }),
        Command::SetWeather { weather: Weather::CLEAR_NOON },
    ]
    .into_iter()
    .chain(driving_commands())
    .chain(body_commands(pose))
    .chain(scene_commands())
    .collect()
}

fn attributes() -> Vec<Attribute> {
    vec![Attribute { id: "role_name".into(), value: "hero".into() }]
}

fn attachment() -> Option<Attachment> {
    Some(Attachment { parent: actor(1), kind: AttachmentKind::SpringArm })
}

fn description() -> ActorDescription {
    ActorDescription {
        id: actor(1),
        attachment: attachment(),
        kind: ActorKind::TrafficLight,
        blueprint: "traffic.traffic_light".into(),
        attributes: attributes(),
        box_centre_m: Vec3::z(),
        box_half_extent_m: Vec3::x(),
        tag: 7,
        signal: Some("1042".into()),
    }
}

fn camera() -> Camera {
    Camera {
        id: 9,
        carrier: Some(actor(1)),
        carrier_from_camera: level_pose(Vec3::new(2.5, 0.0, 1.0), 0.0),
        width_px: 640,
        height_px: 360,
        horizontal_fov_rad: 1.5,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Jpeg,
        jpeg_quality: 75,
        ignored: vec![actor(1), actor(4)],
        quality: Some(PictureQuality::Low),
        exposure: Exposure::PLAIN,
    }
}

pub(crate) fn requests() -> Vec<Request> {
    let item = TickItem {
        world: world(),
        tick_count: 1,
        commands: commands(),
        expected_tick: Some(Tick(0)),
        dt_secs: Some(0.02),
        participant: Some("left".parse().unwrap()),
    };
    let bare = TickItem::new(world(), 1);
    vec![
        Request::CreateWorld {
            map: "Town10HD_Opt".into(),
            seed: u64::MAX,
            dt_secs: 0.05,
            commands: commands(),
            lease: lease(),
            traffic: true,
            first_actor: actor(9),
        },
        Request::ListWorlds,
        Request::ListMaps,
        Request::DestroyWorld { world: world() },
        Request::SnapshotWorld { world: world() },
        Request::RestoreWorld { snapshot: vec![1, 2, 3], lease: None },
        Request::ForkWorld { world: world(), count: 8, lease: lease() },
        Request::RunCommands { world: world(), commands: commands() },
        Request::TickWorlds(vec![item, bare]),
        Request::DescribeActors { world: world(), actors: vec![actor(1), actor(2)] },
        Request::InspectVehicles { world: world(), actors: vec![actor(1), actor(2)] },
        Request::CastRays { world: world(), rays: vec![(Vec3::x(), Vec3::z())] },
        Request::ShareClock {
            world: world(),
            participant: "left".parse().unwrap(),
            lease_millis: 500,
            stands_for: WorldId::new(3),
        },
        Request::RecordWorld { world: world(), on: true, name: None },
        Request::RecordWorld { world: world(), on: false, name: Some("a.journal".to_owned()) },
        Request::BranchJournal { name: "a.journal".to_owned(), tick: Some(Tick(7)), lease: None },
    ]
}

pub(crate) fn replies() -> Vec<Reply> {
    let error = Error::new(ErrorCode::WrongTick, "no").wanted("tick 3").found("tick 4");
    let encoded = wire::encode_frame(&frame());
    let replies = vec![Ok(Some(actor(1))), Ok(None), Err(error.clone())];
    let outcome = TickOutcome {
        frame: encoded.clone(),
        replies: replies.clone(),
        collisions: vec![collision()],
        sensors: sensors(),
        cameras_due: vec![actor(30)],
        guests: vec!["carla-1".parse().unwrap()],
        is_changed_by_others: true,
    };
    let image = Image {
        camera: 9,
        width_px: 2,
        height_px: 1,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        data: (0..8).collect(),
    };
    vec![
        Reply::Error(error.clone()),
        Reply::Done,
        Reply::CommandReplies(replies.clone()),
        Reply::WorldCreated { world: world(), frame: encoded, replies },
        Reply::Worlds(vec![WorldInfo {
            world: world(),
            map: "Town10HD_Opt".into(),
            tick: Tick(4),
            actor_count: 2,
            owner: lease().map(|lease| lease.owner),
            quarantined: Some("it diverged".into()),
            stands_for: WorldId::new(2),
        }]),
        Reply::Maps(vec![map()]),
        Reply::Snapshot(vec![0; 100]),
        Reply::Forked(vec![world(), WorldId::new(1).unwrap()]),
        Reply::Ticked(vec![
            TickResult { world: world(), outcome: Ok(outcome) },
            TickResult { world: world(), outcome: Err(error) },
        ]),
        Reply::Images(Images { tick: Tick(3), state_hash: 5, images: vec![image] }),
        Reply::Actors(vec![description(), ActorDescription { signal: None, ..description() }]),
        Reply::Vehicles(vec![VehicleReport {
            physics: physics(),
            telemetry: telemetry(),
            gains: gains(),
        }]),
        Reply::RayHits(vec![RayHit {
            ray: 0,
            actor: Some(actor(1)),
            tag: 14,
            position_m: Vec3::x(),
        }]),
        Reply::Forked(Vec::new()),
        Reply::Snapshot(EncodedFrame(Vec::new()).0),
    ]
}

pub(crate) fn render_job() -> RenderJob {
    let fixed =
        Camera { carrier: None, encoding: ImageEncoding::Rgba8, ignored: Vec::new(), ..camera() };
    let exposure = Exposure {
        fixed_ev100: Some(9.5),
        range_ev100: [1.0, 2.0],
        compensation_ev: -0.5,
        temperature_k: 4_000.0,
        tint: 0.25,
    };
    let mut cameras = vec![camera(), Camera { exposure, ..fixed.clone() }, fixed.clone()];
    for kind in [ImageKind::Depth, ImageKind::Semantic, ImageKind::Instance, ImageKind::Normals] {
        cameras.push(Camera { kind, encoding: kind.encodings()[0], ..fixed.clone() });
    }
    let light = StreetLight { index: 3, on: true, colour_rgb: 0x01_02_03, brightness: 0.5 };
    let staging = Staging { street_lights: vec![light] };
    RenderJob { tenant: "lab-1".parse().unwrap(), frame: frame(), cameras, staging }
}

pub(crate) fn alive() -> Alive {
    Alive {
        kind: ServiceKind::Render,
        id: "render-0".parse().unwrap(),
        version: "0.1.0".into(),
        pid: 4242,
        capacity: 64,
        detail: "llvmpipe".into(),
        number: 7,
    }
}
