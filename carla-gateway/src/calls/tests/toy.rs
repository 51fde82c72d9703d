//! A world service that does whatever it is told, and only looks whether it could read it.

use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock, Mutex};

use monitoring::Monitor;
use schemas::wire::{decode_request, encode_frame, encode_request};
use schemas::{
    ActorDescription, ActorId, ActorKind, ActorState, Command, EncodedFrame, Error, ErrorCode,
    Frame, MapRef, Pose, Reply, SharedFrame, TickOutcome, TickResult, TrafficLightColour,
    TrafficLightState, VehicleReport, WorldId,
};

use crate::allowance::Allowance;
use crate::config::{AfterReplays, Cars, Pacing, Ports, WorldConfig};
use crate::dialect::ClientVersion;
use crate::endpoint::Endpoint;
use crate::figures::{StreamFigures, WorldFigures};
use crate::latitudes::Latitudes;
use crate::maps::Maps;
use crate::recorder::RecordingFolder;
use crate::site::{Later, Site};

/// Built once for all tests.
static TOWN: LazyLock<(String, MapRef)> = LazyLock::new(|| {
    let xodr = roads::town::build("Town10HD").unwrap();
    let digest = roads::Map::parse("Town10HD", &xodr).unwrap().digest().to_owned();
    (xodr, MapRef { name: "Town10HD".to_owned(), digest })
});

/// Never dropped, as a runtime may not be inside another.
static WORKERS: LazyLock<tokio::runtime::Runtime> = LazyLock::new(runtime);

pub(super) fn runtime() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap()
}

/// Who is in the world, by id from 1 on.
const ACTORS: [(ActorKind, &str); 6] = [
    (ActorKind::TrafficLight, "traffic.traffic_light"),
    (ActorKind::Marker, "spectator"),
    (ActorKind::Vehicle, "vehicle.lincoln.mkz_2020"),
    (ActorKind::Walker, "walker.pedestrian.0001"),
    (ActorKind::Sensor, "sensor.camera.rgb"),
    (ActorKind::Sensor, "sensor.other.v2x_custom"),
];

#[derive(Default)]
pub(super) struct Toy {
    /// The highest id that it gave.
    pub(super) newest_actor: AtomicU32,
    /// As the newest world was to begin.
    pub(super) first_actor: AtomicU32,
    /// Requests that a world service would not have understood.
    pub(super) garbled: AtomicUsize,
    /// How often it has lost all worlds.
    crashes: AtomicU32,
    /// How often it still has no room for a new world.
    pub(super) refusals: AtomicU32,
    /// How often it is still too busy for a tick.
    pub(super) busy: AtomicU32,
    /// New worlds are on another version of the map.
    pub(super) has_other_map: AtomicBool,
    /// Of journals that it was to keep.
    pub(super) journals: Mutex<Vec<String>>,
    /// What was done in the present world.
    done: Mutex<Vec<(Vec<Command>, u32)>>,
}

impl Toy {
    /// An endpoint with one for its world service.
    pub(super) fn endpoint() -> (Endpoint, Arc<Self>) {
        let toy = Arc::new(Self::default());
        let site: Arc<dyn Site> = Arc::clone(&toy) as Arc<dyn Site>;
        let config = WorldConfig {
            version: ClientVersion::V0_9,
            map: "Town10HD".to_owned(),
            seed: 0,
            cars: Cars::Real,
            latitudes: Latitudes::default(),
            pacing: Pacing {
                period: std::time::Duration::from_secs(1),
                sync_lease: None,
                clock_lease: None,
            },
            after_replays: AfterReplays::Stand,
            recordings: RecordingFolder::new(std::env::temp_dir().join("causeway-toy"), false),
            owner: "toy".parse().unwrap(),
            recovery: worlds::Budget::new(1 << 20),
            allowance: Allowance::open("local".parse().unwrap()),
        };
        let maps = Arc::new(Maps::new(Arc::clone(&site)));
        (
            Endpoint::new(
                site,
                maps,
                config,
                Ports { calls: 2000, streams: 2001 },
                WORKERS.handle().clone(),
                (StreamFigures::default(), WorldFigures::new(Monitor::default().metrics())),
            ),
            toy,
        )
    }

    /// The service loses all worlds.
    pub(super) fn crash(&self) {
        self.crashes.fetch_add(1, Ordering::Relaxed);
        self.done.lock().unwrap().clear();
    }

    /// What was done in the present world: commands and ticks, one after the other.
    pub(super) fn done(&self) -> (Vec<Command>, u32) {
        let done = self.done.lock().unwrap();
        let commands = done.iter().flat_map(|(commands, _)| commands.clone()).collect();
        (commands, done.iter().map(|(_, ticks)| ticks).sum())
    }

    /// How many commands and ticks that was.
    pub(super) fn count_done(&self) -> (usize, u32) {
        let done = self.done.lock().unwrap();
        let commands = done.iter().map(|(commands, _)| commands.len()).sum();
        (commands, done.iter().map(|(_, ticks)| ticks).sum())
    }

    /// The only one there is.
    fn world(&self) -> WorldId {
        WorldId::of_host(0, u64::from(1 + self.crashes.load(Ordering::Relaxed)))
    }

    fn frame() -> EncodedFrame {
        Self::frame_on(TOWN.1.digest.clone())
    }

    fn frame_on(digest: String) -> EncodedFrame {
        let map = MapRef { name: "Town10HD".to_owned(), digest };
        let state = |(index, (kind, _)): (usize, &(ActorKind, &str))| {
            ActorState::at_rest(id(index as u32 + 1), *kind, index as u16, Pose::identity())
        };
        encode_frame(&Frame {
            types: ACTORS.iter().map(|(_, blueprint)| (*blueprint).to_owned()).collect(),
            actors: ACTORS.iter().enumerate().map(state).collect(),
            traffic_lights: vec![TrafficLightState {
                actor: id(1),
                colour: TrafficLightColour::Red,
                group: 0,
                frozen: false,
                elapsed_secs: 0.0,
                green_secs: 10.0,
                yellow_secs: 3.0,
                red_secs: 2.0,
            }],
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        })
    }

    /// What was spawned is a car.
    fn description(id: ActorId) -> ActorDescription {
        let known = ACTORS.get(id.get() as usize - 1);
        let (kind, blueprint) = known.copied().unwrap_or(ACTORS[2]);
        ActorDescription {
            id,
            attachment: None,
            kind,
            blueprint: blueprint.to_owned(),
            attributes: Vec::new(),
            box_centre_m: schemas::Vec3::zeros(),
            box_half_extent_m: schemas::Vec3::new(2.0, 1.0, 0.7),
            tag: 14,
            signal: None,
        }
    }

    fn report() -> VehicleReport {
        let blueprint = blueprints::find(ACTORS[2].1).unwrap();
        let blueprints::Class::Vehicle(model) = blueprint.class else { panic!("a car") };
        let physics = model.physics.clone();
        VehicleReport {
            physics,
            telemetry: schemas::VehicleTelemetry::default(),
            gains: schemas::AckermannGains {
                speed_kp: 0.15,
                speed_ki: 0.0,
                speed_kd: 0.25,
                acceleration_kp: 0.01,
                acceleration_ki: 0.0,
                acceleration_kd: 0.01,
            },
        }
    }

    fn carry_out(&self, command: &Command) -> schemas::CommandReply {
        match command {
            Command::SpawnActor { blueprint, .. } if blueprint == "spectator" => Ok(Some(id(2))),
            Command::SpawnActor { .. } => {
                Ok(Some(id(1 + self.newest_actor.fetch_add(1, Ordering::Relaxed))))
            }
            _ => Ok(None),
        }
    }
}

/// Whether there was one left, which is gone now.
fn takes_one(left: &AtomicU32) -> bool {
    let order = Ordering::Relaxed;
    left.fetch_update(order, order, |left| left.checked_sub(1)).is_ok()
}

fn id(number: u32) -> ActorId {
    ActorId::new(number).unwrap()
}

impl Site for Toy {
    fn ask(&self, request: schemas::Request) -> Later<'_, Reply> {
        let world = self.world();
        let makes = |request: &schemas::Request| {
            use schemas::Request::{CreateWorld, RestoreWorld};
            matches!(request, CreateWorld { .. } | RestoreWorld { .. })
        };
        if makes(&request) && takes_one(&self.refusals) {
            let full = Error::new(ErrorCode::Capacity, "no room");
            return Box::pin(std::future::ready(Err(full)));
        }
        let answer = decode_request(&encode_request(&request)).map(|request| match request {
            schemas::Request::ListMaps => Reply::Maps(vec![TOWN.1.clone()]),
            schemas::Request::CreateWorld { first_actor, .. } => {
                self.first_actor.store(first_actor.get(), Ordering::Relaxed);
                self.newest_actor.fetch_max(ACTORS.len() as u32, Ordering::Relaxed);
                let frame = match self.has_other_map.load(Ordering::Relaxed) {
                    true => Self::frame_on("0".repeat(64)),
                    false => Self::frame(),
                };
                Reply::WorldCreated { world, frame, replies: Vec::new() }
            }
            schemas::Request::DescribeActors { actors, .. } if actors.is_empty() => {
                Reply::Actors((1..=ACTORS.len() as u32).map(id).map(Self::description).collect())
            }
            schemas::Request::DescribeActors { actors, .. } => {
                Reply::Actors(actors.into_iter().map(Self::description).collect())
            }
            schemas::Request::InspectVehicles { actors, .. } => {
                Reply::Vehicles(vec![Self::report(); actors.len()])
            }
            schemas::Request::CastRays { .. } => Reply::RayHits(Vec::new()),
            schemas::Request::SnapshotWorld { .. } => Reply::Snapshot(Vec::new()),
            schemas::Request::RestoreWorld { .. } => {
                Reply::WorldCreated { world, frame: Self::frame(), replies: Vec::new() }
            }
            schemas::Request::TickWorlds(items) if items[0].world != world => {
                let unknown = Error::new(ErrorCode::UnknownWorld, "it is gone");
                Reply::Ticked(vec![TickResult { world: items[0].world, outcome: Err(unknown) }])
            }
            schemas::Request::TickWorlds(items) if takes_one(&self.busy) => {
                let busy = Error::new(ErrorCode::Capacity, "nothing was done");
                Reply::Ticked(vec![TickResult { world: items[0].world, outcome: Err(busy) }])
            }
            schemas::Request::TickWorlds(items) => {
                let done = (items[0].commands.clone(), items[0].tick_count);
                self.done.lock().unwrap().push(done);
                let replies = items[0].commands.iter().map(|command| self.carry_out(command));
                let replies = replies.collect();
                let outcome = TickOutcome { replies, ..TickOutcome::new(Self::frame()) };
                Reply::Ticked(vec![TickResult { world, outcome: Ok(outcome) }])
            }
            schemas::Request::RecordWorld { name: Some(name), .. } => {
                self.journals.lock().unwrap().push(name.clone());
                Reply::JournalBegun { name, digest: 1, tick: schemas::Tick(0), state_hash: 0 }
            }
            _ => Reply::Done,
        });
        if answer.is_err() {
            self.garbled.fetch_add(1, Ordering::Relaxed);
        }
        Box::pin(std::future::ready(answer))
    }

    fn draw(
        &self,
        _: SharedFrame,
        _: Vec<schemas::Camera>,
        _: schemas::Staging,
    ) -> Later<'_, Vec<schemas::Image>> {
        Box::pin(std::future::ready(Err(Error::new(ErrorCode::RendererUnavailable, "a toy"))))
    }

    fn map_text(&self, _digest: String) -> Later<'_, Vec<u8>> {
        Box::pin(std::future::ready(Ok(TOWN.0.clone().into_bytes())))
    }

    fn can_draw(&self) -> bool {
        true
    }

    fn should_move(&self, _: WorldId) -> bool {
        false
    }

    fn is_gone(&self, world: WorldId) -> bool {
        world != self.world()
    }

    fn changes(&self) -> tokio::sync::watch::Receiver<u64> {
        tokio::sync::watch::Sender::new(0).subscribe()
    }
}
