//! Landmarks: signals where they apply to lanes, and those ahead of a place.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use crate::kinds::{LaneType, LaneTypes};
use crate::lanes::LaneIndex;
use crate::limits;
use crate::map::Map;
use crate::model::{Model, Road};
use crate::place::Waypoint;
use crate::signals::{Orientation, Reference, Signal, SignalPose, is_traffic_light};

/// A signal at a place on a road where it applies.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    /// OpenDRIVE id of the signal; several landmarks may share it.
    pub id: String,
    /// Its name in the map.
    pub name: String,
    /// Its type: 1000001 is a traffic light, 206 stop, 205 yield, 274 a speed limit.
    pub signal_type: String,
    /// Its subtype, for a speed limit the limit.
    pub subtype: String,
    /// The catalogue of its type.
    pub country: String,
    /// Its value in `unit`.
    pub value: f64,
    /// Unit of the value as the map gives it.
    pub unit: String,
    /// What is written on it.
    pub text: String,
    /// Whether it changes, as a light does.
    pub dynamic: bool,
    /// The road it applies to.
    pub road: u32,
    /// Where on that road, in metres.
    pub s: f64,
    /// Lateral place on that road, left positive, in metres.
    pub t: f64,
    /// To which direction it is turned.
    pub orientation: Orientation,
    /// Height of its foot above the road in metres.
    pub z_offset_m: f64,
    /// Turn against the road, as the map gives it.
    pub heading_offset_rad: f64,
    /// Height in metres.
    pub height_m: f64,
    /// Width in metres.
    pub width_m: f64,
    /// First and last id of the lanes it applies to.
    pub validities: Vec<[i32; 2]>,
    /// Where the signal itself stands.
    pub pose: SignalPose,
}

impl Landmark {
    /// Whether it applies to lanes with this id.
    #[must_use]
    pub fn applies_to(&self, lane: i32) -> bool {
        self.validities.iter().any(|[from, to]| (*from..=*to).contains(&lane))
    }

    /// The foot of its post: x along the traffic it addresses, z up.
    #[must_use]
    pub fn foot(&self) -> Isometry3<f64> {
        let foot = self.pose.point - Vector3::z() * self.z_offset_m;
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.pose.heading_rad);
        Isometry3::from_parts(Translation3::from(foot), turn)
    }

    /// The middle of a light's lamps, whose housing is [`LIGHT_HEAD_HALF_M`] large.
    #[must_use]
    pub fn light_head(&self) -> Isometry3<f64> {
        let [before_m, above_m] = LIGHT_HEAD_M;
        self.foot() * Translation3::new(-before_m, 0.0, above_m)
    }
}

/// Half of the size of the housing of a light's lamps, in metres: along the traffic, across, up.
pub const LIGHT_HEAD_HALF_M: [f64; 3] = [0.21, 0.30, 0.66];
/// Where that housing hangs at its post, in metres: before it, and above its foot.
const LIGHT_HEAD_M: [f64; 2] = [0.2, 3.3];

/// A landmark ahead of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct LandmarkAhead<'m> {
    /// The landmark.
    pub landmark: &'m Landmark,
    /// Way to it along the lanes, in metres.
    pub distance_m: f64,
    /// The place on the lane where it applies.
    pub at: Waypoint,
}

/// Landmarks by road, and the signals that change together.
#[derive(Debug, Default)]
pub(crate) struct Landmarks {
    pub(crate) all: Vec<Landmark>,
    /// Where each signal stands, by its id; also of posts that no landmark is made of.
    pub(crate) poses: BTreeMap<String, SignalPose>,
    /// Positions in `all`, by road, by s.
    by_road: BTreeMap<u32, Vec<usize>>,
    groups: BTreeMap<String, BTreeSet<String>>,
}

impl Landmarks {
    pub(crate) fn new(map: &Map) -> Self {
        let signals = &map.model.signals;
        let poses: BTreeMap<String, SignalPose> = signals
            .definitions
            .iter()
            .map(|(id, signal)| (id.clone(), pose(map, signal)))
            .collect();
        let all: Vec<Landmark> = signals
            .references
            .iter()
            .filter_map(|reference| {
                let signal = signals.definitions.get(&reference.signal)?;
                let validities = validities(&map.model, reference)?;
                let pose = *poses.get(&reference.signal)?;
                Some(landmark(reference, signal, validities, pose))
            })
            .collect();
        let mut by_road: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (index, landmark) in all.iter().enumerate() {
            by_road.entry(landmark.road).or_default().push(index);
        }
        let mut groups: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        let shown: BTreeSet<&str> = all.iter().map(|landmark| landmark.id.as_str()).collect();
        for members in &signals.controllers {
            let members =
                || members.signals.iter().filter(|member| shown.contains(member.as_str()));
            for member in members() {
                groups.entry(member.clone()).or_default().extend(members().cloned());
            }
        }
        Self { all, poses, by_road, groups }
    }
}

/// The lanes a reference holds; `None` for a post that holds none itself.
fn validities(model: &Model, reference: &Reference) -> Option<Vec<[i32; 2]>> {
    if !reference.validities.is_empty() {
        let holds_none = reference.validities.iter().all(|lanes| *lanes == [0, 0]);
        return (!holds_none).then(|| reference.validities.clone());
    }
    let road = model.road(reference.road)?;
    let section = road.sections.get(road.section_index(reference.s))?;
    let lowest = section.lanes.first().map_or(0, |lane| lane.id);
    let highest = section.lanes.last().map_or(0, |lane| lane.id);
    let left =
        (reference.orientation != Orientation::Negative && highest > 0).then_some([1, highest]);
    let right =
        (reference.orientation != Orientation::Positive && lowest < 0).then_some([lowest, -1]);
    Some(left.into_iter().chain(right).collect())
}

fn landmark(
    reference: &Reference,
    signal: &Signal,
    validities: Vec<[i32; 2]>,
    pose: SignalPose,
) -> Landmark {
    Landmark {
        id: reference.signal.clone(),
        name: signal.name.clone(),
        signal_type: signal.signal_type.clone(),
        subtype: signal.subtype.clone(),
        country: signal.country.clone(),
        value: signal.value,
        unit: signal.unit.clone(),
        text: signal.text.clone(),
        dynamic: signal.dynamic,
        road: reference.road,
        s: reference.s,
        t: reference.t,
        orientation: reference.orientation,
        z_offset_m: signal.z_offset_m,
        heading_offset_rad: signal.heading_offset_rad,
        height_m: signal.height_m,
        width_m: signal.width_m,
        validities,
        pose,
    }
}

/// How far traffic lights are moved forward by the client, in metres.
const LIGHT_FORWARD_M: f64 = 0.25;

/// Where a signal stands, as the client places it.
fn pose(map: &Map, signal: &Signal) -> SignalPose {
    if let Some(inertial) = signal.inertial {
        return inertial;
    }
    let mut pose = map.model.road(signal.road).map_or(
        SignalPose { point: Point3::origin(), heading_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 },
        |road| pose_on_road(road, signal),
    );
    if is_traffic_light(&signal.signal_type) {
        pose.point += forward(&pose) * LIGHT_FORWARD_M;
    }
    if signal.name.contains("STATIC") || signal.name.contains("Stencil_STOP") {
        return pose;
    }
    beside_the_lanes(map, pose)
}

/// The lane offset does not move signals.
fn pose_on_road(road: &Road, signal: &Signal) -> SignalPose {
    let heading_rad = road.reference(signal.s).heading_rad + signal.heading_offset_rad;
    SignalPose {
        point: crate::lanes::lateral_point(road, signal.s, signal.t, signal.z_offset_m),
        heading_rad,
        pitch_rad: signal.pitch_rad,
        roll_rad: signal.roll_rad,
    }
}

fn forward(pose: &SignalPose) -> Vector3<f64> {
    let (sin, cos) = pose.heading_rad.sin_cos();
    let (sin_pitch, cos_pitch) = pose.pitch_rad.sin_cos();
    Vector3::new(cos * cos_pitch, sin * cos_pitch, sin_pitch)
}

/// Pushes a signal that stands in a lane sideways, as the client does.
fn beside_the_lanes(map: &Map, before: SignalPose) -> SignalPose {
    const TRIES: u32 = 10;
    /// Nearer to the middle of a lane, in lane widths, a signal counts as standing in it.
    const CLEAR: f64 = 0.7;
    const STEP: f64 = 0.2;
    let types = LaneTypes::DRIVING.union(LaneType::Shoulder.into());
    let mut pose = before;
    for _ in 0..TRIES {
        let Some(place) = map.nearest(pose.point, types) else { return pose };
        let Some(lane) = map.lane_pose(&place) else { return pose };
        let width_m = map.lane(&place).width_m;
        if (lane.point - pose.point).norm() >= width_m * CLEAR {
            return pose;
        }
        let driving = |beside: Option<Waypoint>| {
            beside.is_some_and(|beside| map.lane(&beside).lane_type == LaneType::Driving)
        };
        let side = match (driving(map.right(&place)), driving(map.left(&place))) {
            (false, _) => 1.0,
            (true, false) => -1.0,
            (true, true) => 0.0,
        };
        let (sin, cos) = lane.heading_rad.sin_cos();
        pose.point += Vector3::new(sin, -cos, 0.0) * (side * STEP * width_m);
        pose.heading_rad = lane.heading_rad;
        pose.pitch_rad = lane.pitch_rad;
        pose.roll_rad = 0.0;
        if side == 0.0 {
            return pose;
        }
    }
    before
}

impl Map {
    /// All landmarks, in the order of the file.
    #[must_use]
    pub fn landmarks(&self) -> &[Landmark] {
        &self.landmarks.all
    }

    /// Ids of the landmarks that share a controller with this one, itself included.
    pub fn landmark_group(&self, id: &str) -> impl Iterator<Item = &str> {
        self.landmarks.groups.get(id).into_iter().flatten().map(String::as_str)
    }

    /// Landmarks that apply to the lanes ahead, each once, nearest first.
    ///
    /// With `stop_at_junction` the lanes inside junctions are not entered.
    #[must_use]
    pub fn landmarks_ahead(
        &self,
        from: &Waypoint,
        distance_m: f64,
        stop_at_junction: bool,
    ) -> Vec<LandmarkAhead<'_>> {
        let Some(start) = self.lane_index(from) else { return Vec::new() };
        let mut nearest: BTreeMap<usize, LandmarkAhead<'_>> = BTreeMap::new();
        let mut pending = vec![(start, from.s, 0.0)];
        let mut entered = 0;
        while let Some((lane, s, travelled_m)) = pending.pop() {
            entered += 1;
            if entered > limits::WALK_LANES_MAX {
                break;
            }
            let rest_m: f64 = distance_m - travelled_m;
            let Some(left_m) = self.collect_on_lane(lane, s, rest_m, travelled_m, &mut nearest)
            else {
                continue;
            };
            if rest_m <= left_m {
                continue;
            }
            for next in self.links.listed_next_of(lane).iter().rev() {
                let Some(entry) = self.table.get(*next) else { continue };
                let in_junction = self
                    .model
                    .roads
                    .get(entry.road as usize)
                    .is_some_and(|road| road.junction.is_some());
                if !(in_junction && stop_at_junction) {
                    pending.push((*next, entry.entry_s(), travelled_m + left_m));
                }
            }
        }
        let mut found: Vec<LandmarkAhead<'_>> = nearest.into_values().collect();
        found.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        found
    }

    /// Adds the landmarks within `rest_m` on one lane; returns how much of the lane is left.
    fn collect_on_lane<'m>(
        &'m self,
        lane: LaneIndex,
        s: f64,
        rest_m: f64,
        travelled_m: f64,
        nearest: &mut BTreeMap<usize, LandmarkAhead<'m>>,
    ) -> Option<f64> {
        let entry = self.table.get(lane)?;
        let road = self.model.roads.get(entry.road as usize)?.id;
        let left_m = (entry.exit_s() - s).abs();
        let reach_m = rest_m.min(left_m);
        for index in self.landmarks.by_road.get(&road).into_iter().flatten() {
            let Some(landmark) = self.landmarks.all.get(*index) else { continue };
            let ahead_m = if entry.forward { landmark.s - s } else { s - landmark.s };
            if !(0.0..=reach_m).contains(&ahead_m) || !landmark.applies_to(entry.lane_id) {
                continue;
            }
            let at = Waypoint { road, section: entry.section, lane: entry.lane_id, s: landmark.s };
            let found = LandmarkAhead { landmark, distance_m: travelled_m + ahead_m, at };
            nearest
                .entry(*index)
                .and_modify(|known| {
                    if found.distance_m < known.distance_m {
                        *known = found.clone();
                    }
                })
                .or_insert(found);
        }
        Some(left_m)
    }
}
