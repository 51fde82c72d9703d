//! One of everything that crosses the wire.

#![allow(clippy::unwrap_used, reason = "constants that are valid by inspection")]

use schemas::{
    AckermannControl, AckermannGains, ActorDescription, ActorId, ActorKind, ActorState, Alive,
    Attachment, AttachmentKind, Attribute, BodySwitch, Camera, Collision, Command, EncodedFrame,
    Error, ErrorCode, Frame, Gear, Image, ImageEncoding, ImageKind, Images, Lease, LidarPoint,
    MapRef, Measurement, PilotMode, PushKind, RadarDetection, RayHit, RenderJob, Reply, Request,
    Scan, SemanticLidarPoint, SensorDatum, ServiceKind, Tick, TickItem, TickOutcome, TickResult,
    TrafficLightColour, TrafficLightState, Vec3, VehicleControl, VehicleFailure, VehiclePhysics,
    VehicleReport, VehicleTelemetry, WalkerControl, Weather, WheelPhysics, WheelTelemetry, WorldId,
    WorldInfo, level_pose, wire,
};

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
        sim_secs: 2.1,
    }
}

fn commands() -> Vec<Command> {
    let pose = level_pose(Vec3::new(1.0, 2.0, 3.0), -1.0);
    vec![
        Command::SpawnActor {
            blueprint: "vehicle.lincoln.mkz".into(),
            world_from_actor: pose,
            linear_velocity_mps: Vec3::new(11.0, 0.0, 0.0),
            attributes: attributes(),
            attachment: attachment(),
        },
        Command::DestroyActor { actor: actor(3) },
        Command::SetControl { actor: actor(1), control: vehicle().control },
        Command::SetPilot {
            actor: actor(1),
            mode: PilotMode::ChangeLaneLeft,
            target_speed_mps: Some(0.0),
        },
        Command::SetPilot { actor: actor(1), mode: PilotMode::KeepLane, target_speed_mps: None },
        Command::SetVelocity { actor: actor(1), linear_mps: Some(Vec3::x()), angular_radps: None },
        Command::SetPose { actor: actor(1), world_from_actor: pose },
        Command::SetWeather { weather: Weather::CLEAR_NOON },
    ]
    .into_iter()
    .chain(driving_commands())
    .chain(body_commands(pose))
    .chain(scene_commands())
    .collect()
}

fn driving_commands() -> Vec<Command> {
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
    ]
}

fn body_commands(pose: schemas::Pose) -> Vec<Command> {
    let push = |kind| Command::Push { actor: actor(1), kind, amount: Vec3::x() };
    let switch = |switch| Command::SetSwitch { actor: actor(1), switch, on: true };
    vec![
        Command::SetWalkerControl { actor: actor(2), control: walker_control() },
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

fn scene_commands() -> Vec<Command> {
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
    ]
}

fn attributes() -> Vec<Attribute> {
    vec![Attribute { id: "role_name".into(), value: "hero".into() }]
}

fn attachment() -> Option<Attachment> {
    Some(Attachment { parent: actor(1), kind: AttachmentKind::SpringArm })
}

fn gains() -> AckermannGains {
    AckermannGains {
        speed_kp: 0.15,
        speed_ki: 0.0,
        speed_kd: 0.25,
        acceleration_kp: 0.01,
        acceleration_ki: 0.02,
        acceleration_kd: 0.03,
    }
}

fn physics() -> VehiclePhysics {
    let wheel = WheelPhysics {
        tyre_friction: 3.5,
        damping_rate: 0.25,
        steer_rad_max: 1.2,
        radius_m: 0.335,
        brake_nm_max: 800.0,
        hand_brake_nm_max: 1_600.0,
        lateral_stiffness_load_max: 3.0,
        lateral_stiffness: 20.0,
        longitudinal_stiffness: 3_000.0,
        position_m: Vec3::new(1.4, 0.8, 0.3),
    };
    VehiclePhysics {
        torque_curve: vec![(0.0, 300.0), (6_000.0, 200.0)],
        engine_rpm_max: 6_000.0,
        engine_inertia_kgm2: 1.0,
        damping_full_throttle: 0.15,
        damping_closed_throttle_clutch_engaged: 2.0,
        damping_closed_throttle_clutch_disengaged: 0.35,
        automatic_gearbox: true,
        gear_switch_secs: 0.5,
        clutch_strength: 10.0,
        final_ratio: 4.0,
        forward_gears: vec![Gear { ratio: 3.6, down_share: 0.5, up_share: 0.65 }],
        mass_kg: 1_800.0,
        drag_coefficient: 0.3,
        centre_of_mass_m: Vec3::new(0.1, 0.0, 0.5),
        steering_curve: vec![(0.0, 1.0), (33.0, 0.7)],
        wheels: vec![wheel; 4],
        sweep_wheel_collision: true,
    }
}

fn telemetry() -> VehicleTelemetry {
    let wheel = WheelTelemetry { load_n: 4_400.0, spin_radps: 30.0, ..Default::default() };
    VehicleTelemetry {
        speed_mps: 10.0,
        steer: -0.5,
        engine_rpm: 2_000.0,
        gear: 3,
        drag_n: 60.0,
        wheels: vec![wheel; 4],
        ..VehicleTelemetry::default()
    }
}

fn sensors() -> Vec<SensorDatum> {
    let lidar = Scan {
        end_angle_rad: 1.0,
        points_per_channel: vec![1, 0],
        points: vec![LidarPoint { position_m: [1.0, 2.0, 3.0], intensity: 0.5 }],
    };
    let semantic =
        SemanticLidarPoint { position_m: [1.0, 2.0, 3.0], incidence_cos: 0.25, actor: 4, tag: 14 };
    let echo =
        RadarDetection { speed_mps: -3.0, azimuth_rad: 0.1, altitude_rad: 0.2, depth_m: 30.0 };
    let measurements = [
        Measurement::Lidar(lidar),
        Measurement::SemanticLidar(Scan {
            end_angle_rad: 2.0,
            points_per_channel: vec![1],
            points: vec![semantic],
        }),
        Measurement::Radar(vec![echo]),
        Measurement::Imu {
            acceleration_mps2: Vec3::z() * 9.81,
            angular_velocity_radps: Vec3::x(),
            compass_rad: 0.5,
        },
        Measurement::Gnss { latitude_deg: 42.0, longitude_deg: 2.0, altitude_m: 3.0 },
        Measurement::Collision { other: None, tag: 3, impulse_ns: Vec3::x() },
        Measurement::Obstacle { other: Some(actor(2)), tag: 12, distance_m: 4.0 },
        Measurement::LaneInvasion { marks: vec!["broken".into()] },
    ];
    let datum = |(index, measurement)| SensorDatum {
        sensor: actor(20 + index as u32),
        tick: Tick(42),
        sim_secs: 2.1,
        world_from_sensor: level_pose(Vec3::x(), 0.25),
        measurement,
    };
    measurements.into_iter().enumerate().map(datum).collect()
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
    }
}

pub(crate) fn requests() -> Vec<Request> {
    let item = TickItem {
        world: world(),
        tick_count: 1,
        commands: commands(),
        expected_tick: Some(Tick(0)),
        dt_secs: Some(0.02),
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
        },
        Request::ListWorlds,
        Request::ListMaps,
        Request::DestroyWorld { world: world() },
        Request::SnapshotWorld { world: world() },
        Request::RestoreWorld { snapshot: vec![1, 2, 3], lease: None },
        Request::ForkWorld { world: world(), count: 8, lease: lease() },
        Request::RunCommands { world: world(), commands: commands() },
        Request::TickWorlds(vec![item, bare]),
        Request::Capture { world: world(), cameras: vec![camera()] },
        Request::DescribeActors { world: world(), actors: vec![actor(1), actor(2)] },
        Request::InspectVehicle { world: world(), actor: actor(1) },
        Request::CastRays { world: world(), rays: vec![(Vec3::x(), Vec3::z())] },
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
        Reply::Vehicle(Box::new(VehicleReport {
            physics: physics(),
            telemetry: telemetry(),
            gains: gains(),
        })),
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
    let fixed = Camera { carrier: None, encoding: ImageEncoding::Rgba8, ..camera() };
    RenderJob { tenant: "lab-1".parse().unwrap(), frame: frame(), cameras: vec![camera(), fixed] }
}

pub(crate) fn alive() -> Alive {
    Alive {
        kind: ServiceKind::Render,
        id: "render-0".parse().unwrap(),
        version: "0.1.0".into(),
        pid: 4242,
        capacity: 64,
        detail: "llvmpipe".into(),
    }
}
