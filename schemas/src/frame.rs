//! The immutable result of one tick.

use serde::{Deserialize, Serialize};

use crate::{ActorId, Halt, HiddenScenery, Paint, Pose, Tick, Vec3, WalkerPose, WorldId};

/// What an actor is, coarsely.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum ActorKind {
    /// Anything with wheels and a driver.
    Vehicle,
    /// A pedestrian.
    Walker,
    /// A thing that only stands or lies.
    Prop,
    /// A traffic light of the map.
    TrafficLight,
    /// A sign of the map.
    TrafficSign,
    /// Something that measures.
    Sensor,
    /// A bodyless thing that clients keep in the world: a controller, a trigger, the spectator.
    Marker,
}

/// CARLA's vehicle controls with ISO 8855 signs: positive steer turns left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct VehicleControl {
    /// 0 to 1.
    pub throttle: f32,
    /// -1 (full right) to 1 (full left).
    pub steer: f32,
    /// 0 to 1.
    pub brake: f32,
    /// Locks the rear wheels.
    pub hand_brake: bool,
    /// Drives backwards.
    pub reverse: bool,
    /// Engages [`gear`](Self::gear) whatever the engine's speed.
    pub manual_gear: bool,
    /// -1 reverse, 0 neutral; counts with [`manual_gear`](Self::manual_gear) only.
    pub gear: i8,
}

/// How a pedestrian wants to move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct WalkerControl {
    /// In the world; the speed is multiplied by its length. Zero to stand.
    pub direction: Vec3,
    /// Metres per second.
    pub speed_mps: f32,
    /// Leaves the ground once.
    pub jump: bool,
}

/// Why a vehicle does not drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum VehicleFailure {
    /// It does.
    #[default]
    None,
    /// It lies on its side or roof.
    Rollover,
    /// Its engine is broken.
    Engine,
    /// A tyre is flat.
    TyrePuncture,
}

/// What a traffic light shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the colours speak for themselves")]
pub enum TrafficLightColour {
    Red,
    Yellow,
    Green,
    Off,
    Unknown,
}

/// What one traffic light shows and when it will change.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrafficLightState {
    /// Which light.
    pub actor: ActorId,
    /// What it shows.
    pub colour: TrafficLightColour,
    /// Lights of one junction share a group and take turns.
    pub group: u16,
    /// Stays as it is.
    pub frozen: bool,
    /// Since the last change of colour.
    pub elapsed_secs: f32,
    /// How long it shows green.
    pub green_secs: f32,
    /// How long it shows yellow.
    pub yellow_secs: f32,
    /// How long everything stays red before the next lights' turn.
    pub red_secs: f32,
}

/// One actor at the end of a tick.
#[derive(Clone, Debug, PartialEq)]
pub struct ActorState {
    /// Who.
    pub id: ActorId,
    /// What, coarsely.
    pub kind: ActorKind,
    /// Engaged gear: -1 reverse, 0 neutral.
    pub gear: i8,
    /// Index into [`Frame::types`].
    pub type_index: u16,
    /// Actor origin: vehicles at ground level under the box centre, walkers at the box centre.
    pub world_from_actor: Pose,
    /// Metres per second, world frame.
    pub linear_velocity_mps: Vec3,
    /// Radians per second, world frame.
    pub angular_velocity_radps: Vec3,
    /// Metres per second squared, world frame; mean over the tick.
    pub linear_acceleration_mps2: Vec3,
    /// Centre of the bounding box in the actor's frame.
    pub box_centre_m: Vec3,
    /// Half size of the bounding box.
    pub box_half_extent_m: Vec3,
    /// What drives a vehicle now; zero for others.
    pub control: VehicleControl,
    /// Mean angle of the steered road wheels, positive left.
    pub road_wheel_rad: f32,
    /// Paint, `0xRRGGBB`.
    pub colour_rgb: u32,
    /// The actor it is attached to.
    pub parent: Option<ActorId>,
    /// CARLA's `VehicleLightState` flags.
    pub lights: u32,
    /// Open doors, one bit each: front left, front right, rear left, rear right, hood, trunk.
    pub doors: u8,
    /// Why a vehicle does not drive.
    pub failure: VehicleFailure,
    /// Of the road under a vehicle; 0 where none is posted.
    pub speed_limit_mps: f32,
    /// The traffic light in whose trigger box a vehicle is, or the stop sign that holds it.
    pub traffic_light: Option<ActorId>,
    /// How a walker wants to move; zero for others.
    pub walker: WalkerControl,
    /// Phase of a walker's walk cycle.
    pub gait_rad: f32,
}

impl ActorState {
    /// An actor of a kind at a place, at rest, with nothing else to tell.
    pub fn at_rest(id: ActorId, kind: ActorKind, type_index: u16, world_from_actor: Pose) -> Self {
        Self {
            id,
            kind,
            gear: 0,
            type_index,
            world_from_actor,
            linear_velocity_mps: Vec3::zeros(),
            angular_velocity_radps: Vec3::zeros(),
            linear_acceleration_mps2: Vec3::zeros(),
            box_centre_m: Vec3::zeros(),
            box_half_extent_m: Vec3::zeros(),
            control: VehicleControl::default(),
            road_wheel_rad: 0.0,
            colour_rgb: 0,
            parent: None,
            lights: 0,
            doors: 0,
            failure: VehicleFailure::None,
            speed_limit_mps: 0.0,
            traffic_light: None,
            walker: WalkerControl::default(),
            gait_rad: 0.0,
        }
    }
}

/// What a navigation agent is about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum AgentStatus {
    /// It has no route and takes any way.
    #[default]
    Wandering,
    /// On its way to a place.
    OnRoute,
    /// It stands at the end of its route.
    Arrived,
}

/// A vehicle's navigation agent at the end of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AgentState {
    /// Whose.
    pub actor: ActorId,
    /// What it is about.
    pub status: AgentStatus,
    /// Whether it drives now.
    pub driving: bool,
    /// To the end of its route; 0 without one.
    pub distance_left_m: f32,
    /// What it steers for, world frame.
    pub target_m: Vec3,
}

/// A contact that pushed during this tick, once per pair of actors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Collision {
    /// The actor with the smaller id, or the only one.
    pub actor: ActorId,
    /// `None` for static scenery.
    pub other: Option<ActorId>,
    /// True in the first tick of a contact.
    pub started: bool,
    /// Where, world frame.
    pub position_m: Vec3,
    /// Impulse on `actor`, newton seconds, world frame, summed over the tick.
    pub impulse_ns: Vec3,
    /// Closing speed just before the tick in which the contact started.
    pub closing_speed_mps: f32,
}

/// CARLA's fourteen weather parameters in SI angles; percentages run from 0 to 100.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names are CARLA's, with units")]
pub struct Weather {
    pub cloudiness_percent: f32,
    pub precipitation_percent: f32,
    pub precipitation_deposits_percent: f32,
    pub wind_intensity_percent: f32,
    pub sun_azimuth_rad: f32,
    pub sun_altitude_rad: f32,
    pub fog_density_percent: f32,
    pub fog_distance_m: f32,
    pub wetness_percent: f32,
    pub fog_falloff: f32,
    pub scattering_intensity: f32,
    pub mie_scattering_scale: f32,
    pub rayleigh_scattering_scale: f32,
    pub dust_storm_percent: f32,
}

impl Weather {
    /// CARLA 0.9.16's `ClearNoon`.
    pub const CLEAR_NOON: Self = Self {
        cloudiness_percent: 5.0,
        precipitation_percent: 0.0,
        precipitation_deposits_percent: 0.0,
        wind_intensity_percent: 10.0,
        sun_azimuth_rad: -0.017_453_292,
        sun_altitude_rad: std::f32::consts::FRAC_PI_4,
        fog_density_percent: 2.0,
        fog_distance_m: 0.75,
        wetness_percent: 0.0,
        fog_falloff: 0.1,
        scattering_intensity: 1.0,
        mie_scattering_scale: 0.03,
        rayleigh_scattering_scale: 0.0331,
        dust_storm_percent: 0.0,
    };
}

/// A map by name and by the BLAKE3 digest of its OpenDRIVE text.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct MapRef {
    /// As clients name it, e.g. `Town10HD_Opt`.
    pub name: String,
    /// Lower-case hexadecimal, 64 characters.
    pub digest: String,
}

/// How often a vehicle has broken rules of the road, in all of its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RulesBroken {
    /// Which vehicle.
    pub actor: ActorId,
    /// Lights that showed red from when it came to their line until it had passed it.
    pub red_lights: u32,
    /// Stop signs at which it did not stand.
    pub stop_signs: u32,
    /// Junctions that it drove into before traffic or an agent that was to go first and came soon.
    pub right_of_way: u32,
    /// Crossings that it drove onto before people whom it could have let over.
    pub crossings: u32,
}

/// The state of one world after one tick. Self-contained: it can be drawn, recorded and scored
/// alone.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Which world.
    pub world: WorldId,
    /// Which state of it.
    pub tick: Tick,
    /// Changes whenever the process that owns the world is a new one.
    pub epoch: u64,
    /// Length of the last tick in seconds, or of the next one at tick 0.
    pub dt_secs: f64,
    /// Simulated seconds since tick 0.
    pub sim_secs: f64,
    /// Equal for equal states.
    pub state_hash: u64,
    /// Root of all randomness of the world.
    pub seed: u64,
    /// Where.
    pub map: MapRef,
    /// What the sky does.
    pub weather: Weather,
    /// Blueprint ids in use, in order of first appearance.
    pub types: Vec<String>,
    /// Ordered by id.
    pub actors: Vec<ActorState>,
    /// Ordered by (actor, other).
    pub collisions: Vec<Collision>,
    /// Ordered by actor. In a world that has the map's lights, all of them in the map's order;
    /// those that were destroyed with the colour `Unknown`.
    pub traffic_lights: Vec<TrafficLightState>,
    /// Navigation agents of vehicles, ordered by actor.
    pub agents: Vec<AgentState>,
    /// Things of the map that are not there.
    pub hidden: HiddenScenery,
    /// Textures of things of the map.
    pub paint: Paint,
    /// Who is at rest because its motion became impossible, ordered by actor.
    pub halted: Vec<Halt>,
    /// Of those vehicles that have broken any rule of the road, in a world that has the map's
    /// lights and signs; ordered by actor.
    pub rules_broken: Vec<RulesBroken>,
    /// Of those walkers that somebody posed, ordered by walker.
    pub walker_poses: Vec<WalkerPose>,
}

impl Frame {
    /// The first frame of a world with nobody in it, which goes on in ticks of 50 ms.
    pub fn empty(world: WorldId, map: MapRef) -> Self {
        Self {
            world,
            tick: Tick(0),
            epoch: 0,
            dt_secs: 0.05,
            sim_secs: 0.0,
            state_hash: 0,
            seed: 0,
            map,
            weather: Weather::CLEAR_NOON,
            types: Vec::new(),
            actors: Vec::new(),
            collisions: Vec::new(),
            traffic_lights: Vec::new(),
            agents: Vec::new(),
            hidden: HiddenScenery::default(),
            paint: Paint::default(),
            halted: Vec::new(),
            rules_broken: Vec::new(),
            walker_poses: Vec::new(),
        }
    }

    /// How somebody posed a walker; `None` for one that walks with all its bones.
    pub fn walker_pose(&self, walker: ActorId) -> Option<&WalkerPose> {
        let at = self.walker_poses.binary_search_by_key(&walker, |pose| pose.walker).ok()?;
        self.walker_poses.get(at)
    }

    /// How often a vehicle has broken rules of the road; `None` for one that never has.
    pub fn broken_by(&self, actor: ActorId) -> Option<&RulesBroken> {
        let at = self.rules_broken.binary_search_by_key(&actor, |broken| broken.actor).ok()?;
        self.rules_broken.get(at)
    }

    /// The state of one actor.
    pub fn actor(&self, id: ActorId) -> Option<&ActorState> {
        let at = self.actors.binary_search_by_key(&id, |actor| actor.id).ok()?;
        self.actors.get(at)
    }

    /// Who was put to rest in ticks after this one.
    pub fn halted_since(&self, tick: Tick) -> impl Iterator<Item = &Halt> {
        self.halted.iter().filter(move |halt| halt.tick > tick)
    }

    /// The blueprint id of an actor of this frame.
    pub fn type_of(&self, actor: &ActorState) -> &str {
        self.types.get(usize::from(actor.type_index)).map_or("", String::as_str)
    }
}
