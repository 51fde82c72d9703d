//! A map and the questions it answers.

use std::sync::{Arc, OnceLock};

use nalgebra::{Isometry3, Point3};

use crate::crosswalks;
use crate::environment::{self, EnvironmentObject};
use crate::error::{MapError, Report, TooManyWaypoints};
use crate::index::ProjectionIndex;
use crate::kinds::LaneTypes;
use crate::landmarks::Landmarks;
use crate::lanes::{LaneEntry, LaneIndex, LanePose, LaneTable, lane_pose};
use crate::levelling;
use crate::links::Links;
use crate::mesh::kerbs::Kerbs;
use crate::model::{Model, Object, Road};
use crate::neighbours::{self, Side};
use crate::place::{LaneInfo, Waypoint};
use crate::post::Post;
use crate::scenery::{self, SceneryBox};
use crate::shapes::Shapes;
use crate::size;
use crate::spawn::SpawnPoints;
use crate::speed_limits::SpeedLimits;
use crate::surroundings;
use crate::topology;
use crate::walk::{Way, walk};
use crate::xml;

/// A road network, immutable once read.
///
/// **Frame:** right-handed metres, x east, y north, z up. **Determinism:** the same text gives the
/// same answers on every machine with the same floating-point library.
#[derive(Debug)]
pub struct Map {
    name: String,
    text: Arc<str>,
    digest: OnceLock<String>,
    pub(crate) model: Model,
    pub(crate) table: LaneTable,
    shapes: Shapes,
    pub(crate) links: Links,
    pub(crate) index: ProjectionIndex,
    pub(crate) landmarks: Landmarks,
    speed_limits: OnceLock<SpeedLimits>,
    spawn_points: OnceLock<SpawnPoints>,
    surroundings: OnceLock<Vec<Vec<Object>>>,
    scenery: OnceLock<Vec<SceneryBox>>,
    kerbs: OnceLock<Kerbs>,
    pub(crate) posts: OnceLock<Vec<Post>>,
    environment: OnceLock<Vec<EnvironmentObject>>,
}

impl Map {
    /// Reads OpenDRIVE text. A map without houses and trees gets some beside its roads.
    ///
    /// # Errors
    /// [`MapError`] with the faults of a text that cannot be used.
    pub fn parse(name: &str, xodr: &str) -> Result<Self, MapError> {
        Self::parse_shared(name, Arc::from(xodr))
    }

    /// As [`Map::parse`], without a copy of the text.
    ///
    /// # Errors
    /// As there.
    pub fn parse_shared(name: &str, xodr: Arc<str>) -> Result<Self, MapError> {
        let mut report = Report::default();
        let mut model = xml::read(&xodr, &mut report);
        size::check(&model, &mut report);
        if !report.is_empty() {
            return Err(MapError {
                name: name.to_owned(),
                diagnostics: report.diagnostics,
                count: report.count,
            });
        }
        levelling::level(&mut model);
        let table = LaneTable::new(&model);
        let shapes = Shapes::new(&model, &table);
        let links = Links::new(&model, &table);
        let index = ProjectionIndex::new(&model, &table, &shapes);
        let mut map = Self {
            name: name.to_owned(),
            text: xodr,
            digest: OnceLock::new(),
            model,
            table,
            shapes,
            links,
            index,
            landmarks: Landmarks::default(),
            speed_limits: OnceLock::new(),
            spawn_points: OnceLock::new(),
            surroundings: OnceLock::new(),
            scenery: OnceLock::new(),
            kerbs: OnceLock::new(),
            posts: OnceLock::new(),
            environment: OnceLock::new(),
        };
        // Signals are pushed off the lanes, which takes the finished index.
        map.landmarks = Landmarks::new(&map);
        Ok(map)
    }

    /// The name it was read under.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The text it was read from.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// BLAKE3 of the text, 64 lower-case hexadecimal digits.
    ///
    /// **Cost:** computed on the first call.
    #[must_use]
    pub fn digest(&self) -> &str {
        self.digest.get_or_init(|| blake3::hash(self.text.as_bytes()).to_hex().to_string())
    }

    /// The nearest place on a lane of these types, however far away; `None` without such a lane.
    ///
    /// **Cost:** logarithmic in the length of the map's lanes. **Source:** the client library's
    /// projection, by chords: on curves the place is off along the lane by up to some decimetres.
    #[must_use]
    pub fn nearest(&self, point: Point3<f64>, types: LaneTypes) -> Option<Waypoint> {
        let (lane, s) = self.index.nearest(&point, types)?;
        self.waypoint_on(lane, s)
    }

    /// As [`Map::nearest`], with how far away it is, and found faster than that: `None` when it is
    /// `within_m` away or farther.
    #[must_use]
    pub fn nearest_within(
        &self,
        point: Point3<f64>,
        types: LaneTypes,
        within_m: f64,
    ) -> Option<(Waypoint, f64)> {
        let (lane, s, away2) = self.index.nearest_within(&point, types, within_m * within_m)?;
        Some((self.waypoint_on(lane, s)?, away2.sqrt()))
    }

    /// As [`Map::nearest`], but `None` when the point lies beside that lane: further from its
    /// middle, seen from above, than half its width.
    #[must_use]
    pub fn inside(&self, point: Point3<f64>, types: LaneTypes) -> Option<Waypoint> {
        let place = self.nearest(point, types)?;
        let beside = self.lane_pose(&place)?.point.xy() - point.xy();
        (beside.norm() < self.lane(&place).width_m / 2.0).then_some(place)
    }

    /// The place at road coordinate `s` (metres, rounded to single precision) of a lane.
    ///
    /// `None` for an unknown road, an `s` outside of `[0, length)`, or a lane the section there
    /// does not have. Lane 0, the centre line, is accepted.
    #[must_use]
    pub fn waypoint(&self, road: u32, lane: i32, s: f64) -> Option<Waypoint> {
        #[allow(clippy::cast_possible_truncation, reason = "the client library rounds s so")]
        let s = f64::from(s as f32);
        let sections = self.table.road(&self.model, road)?;
        let found = self.model.roads.get(sections.road as usize)?;
        if !(s >= 0.0 && s < found.length_m) {
            return None;
        }
        let section = found.section_index(s);
        let index = self.table.find_in(sections, section, lane)?;
        self.waypoint_on(index, s)
    }

    /// Middle of the lane at a waypoint: x along the lane's direction of travel, y left, z up.
    ///
    /// A waypoint that is not of this map gives the identity.
    #[must_use]
    pub fn pose(&self, waypoint: &Waypoint) -> Isometry3<f64> {
        self.lane_pose(waypoint).map_or_else(Isometry3::identity, |pose| pose.isometry())
    }

    /// As [`Map::pose`], with the angles unmixed; `None` for a waypoint of another map.
    #[must_use]
    pub fn lane_pose(&self, waypoint: &Waypoint) -> Option<LanePose> {
        let lane = self.lane_index(waypoint)?;
        let entry = self.table.get(lane)?;
        self.shapes.pose(entry, lane, waypoint.s).or_else(|| {
            let road = self.model.roads.get(entry.road as usize)?;
            let section = road.sections.get(entry.section as usize)?;
            Some(lane_pose(road, section, waypoint.lane, waypoint.s))
        })
    }

    /// What is known about the lane at a waypoint.
    ///
    /// A waypoint that is not of this map gives a lane of type none without width.
    #[must_use]
    pub fn lane(&self, waypoint: &Waypoint) -> LaneInfo {
        neighbours::lane_info(&self.model, waypoint)
    }

    /// Whether the road of a waypoint leads through a junction.
    #[must_use]
    pub fn is_in_junction(&self, waypoint: &Waypoint) -> bool {
        self.road(waypoint).is_some_and(|road| road.junction.is_some())
    }

    /// All places `distance_m` ahead along the lanes; empty where every way ends before.
    #[must_use]
    pub fn next(&self, waypoint: &Waypoint, distance_m: f64) -> Vec<Waypoint> {
        self.walk(waypoint, distance_m, Way::Ahead)
    }

    /// All places from which `distance_m` of travel lead here.
    #[must_use]
    pub fn previous(&self, waypoint: &Waypoint, distance_m: f64) -> Vec<Waypoint> {
        self.walk(waypoint, distance_m, Way::Back)
    }

    /// The lane to the left, of whatever type and direction.
    #[must_use]
    pub fn left(&self, waypoint: &Waypoint) -> Option<Waypoint> {
        neighbours::neighbour(&self.model, waypoint, Side::Left)
    }

    /// The lane to the right, of whatever type and direction.
    #[must_use]
    pub fn right(&self, waypoint: &Waypoint) -> Option<Waypoint> {
        neighbours::neighbour(&self.model, waypoint, Side::Right)
    }

    /// The driving lane of the same direction to the left.
    #[must_use]
    pub fn left_driving(&self, waypoint: &Waypoint) -> Option<Waypoint> {
        neighbours::same_direction_driving(&self.model, waypoint, Side::Left)
    }

    /// The driving lane of the same direction to the right.
    #[must_use]
    pub fn right_driving(&self, waypoint: &Waypoint) -> Option<Waypoint> {
        neighbours::same_direction_driving(&self.model, waypoint, Side::Right)
    }

    /// Places on all driving lanes, one every `step_m` metres of road coordinate from each road's
    /// start.
    ///
    /// # Errors
    /// [`TooManyWaypoints`] where the step is not above 0, or so small that there were more
    /// than [`crate::limits::GENERATED_WAYPOINTS_MAX`].
    pub fn generate_waypoints(&self, step_m: f64) -> Result<Vec<Waypoint>, TooManyWaypoints> {
        topology::generate_waypoints(&self.model, step_m)
    }

    /// Pairs of places: the start of every driving lane of every section, and the start of each
    /// lane that follows it. A lane that nothing follows is paired with the place at its own end,
    /// where the client library finds one.
    #[must_use]
    pub fn topology(&self) -> Vec<(Waypoint, Waypoint)> {
        topology::topology(&self.model, &self.table, &self.links, |road, lane, s| {
            self.waypoint(road, lane, s)
        })
    }

    /// Every driving lane of every section: where its traffic enters it and where it leaves it,
    /// both at the very ends.
    ///
    /// **Order:** by road, section and lane.
    #[must_use]
    pub fn driving_lanes(&self) -> Vec<(Waypoint, Waypoint)> {
        topology::driving_lanes(&self.model, &self.table)
    }

    /// Every place where one lane leads into another: the end of the one and the start of the
    /// other, both at the joint itself.
    #[must_use]
    pub fn lane_joints(&self) -> Vec<(Waypoint, Waypoint)> {
        topology::joints(&self.model, &self.table, &self.links)
    }

    /// Where vehicles may start: lane middles outside junctions, half a metre above the ground and
    /// far enough from each other for a car at each. A map with the name of one of CARLA's has as
    /// many as that, where its lanes have room.
    ///
    /// **Order:** first the [spread](Self::spread_places) ones, then those between them, from the
    /// largest gap to the smallest. **Cost:** worked out on the first call.
    #[must_use]
    pub fn spawn_points(&self) -> &[Isometry3<f64>] {
        &self.places().poses
    }

    /// Spawn points spread evenly over all driving lanes, at least 25 m apart.
    ///
    /// **Order:** by road, section, lane and road coordinate.
    #[must_use]
    pub fn spread_places(&self) -> &[Isometry3<f64>] {
        let places = self.places();
        &places.poses[..places.spread_count]
    }

    fn places(&self) -> &SpawnPoints {
        let new = || SpawnPoints::new(&self.model, &self.table, &self.name);
        self.spawn_points.get_or_init(new)
    }

    pub(crate) fn speed_limits(&self) -> &SpeedLimits {
        self.speed_limits.get_or_init(|| SpeedLimits::new(self))
    }

    pub(crate) fn kerbs(&self) -> &Kerbs {
        self.kerbs.get_or_init(|| Kerbs::new(self))
    }

    /// The solid things beside the roads: from the map's objects, or generated surroundings.
    ///
    /// **Cost:** made on the first call.
    #[must_use]
    pub fn scenery(&self) -> &[SceneryBox] {
        self.scenery.get_or_init(|| scenery::boxes(self.roads_with_objects()))
    }

    /// Every road with its objects and what was generated to stand beside it.
    pub(crate) fn roads_with_objects(
        &self,
    ) -> impl Iterator<Item = (&Road, impl Iterator<Item = &Object>)> {
        let generated = self.surroundings.get_or_init(|| surroundings::around(&self.model));
        self.model.roads.iter().enumerate().map(move |(position, road)| {
            (road, road.objects.iter().chain(generated.get(position).into_iter().flatten()))
        })
    }

    /// Everything that is part of the map and not an actor: scenery, signals, ground and paint,
    /// with CARLA's labels and layers.
    ///
    /// **Order:** by id. **Determinism:** the same text gives the same list. **Cost:** made once.
    #[must_use]
    pub fn environment_objects(&self) -> &[EnvironmentObject] {
        let signals = || self.model.signals.definitions.iter();
        let posed = || {
            signals().filter_map(|(id, signal)| Some((id, signal, self.landmarks.poses.get(id)?)))
        };
        let list = || {
            let posts = self.posts_with_places().filter_map(|(place, post)| {
                let landmark = self.landmarks().get(post.landmark)?;
                let places = [place, self.carried_place(place)];
                let (signal, road) = (landmark.id.as_str(), landmark.road);
                Some(environment::Standing { signal, road, places, post })
            });
            environment::list(self.roads_with_objects(), posed(), posts)
        };
        self.environment.get_or_init(list)
    }

    /// The corners of every pedestrian crossing, as the map lists them.
    ///
    /// A crossing without corners of its own repeats those of the one before it, as in the client
    /// library.
    #[must_use]
    pub fn crosswalks(&self) -> Vec<Vec<Point3<f64>>> {
        crosswalks::list(&self.model)
    }

    /// The box around the middles of all lanes, in metres; `None` for a map without chords.
    #[must_use]
    pub fn bounds(&self) -> Option<(Point3<f64>, Point3<f64>)> {
        self.index.bounds()
    }

    fn walk(&self, waypoint: &Waypoint, distance_m: f64, way: Way) -> Vec<Waypoint> {
        let Some(index) = self.lane_index(waypoint) else { return Vec::new() };
        // Nearly every walk ends at one place.
        let mut found = Vec::with_capacity(1);
        walk(&self.table, &self.links, (index, waypoint.s), distance_m, way, |lane, s| {
            if let Some(place) = self.waypoint_on(lane, s) {
                found.push(place);
            }
        });
        found
    }

    #[inline]
    pub(crate) fn lane_index(&self, waypoint: &Waypoint) -> Option<LaneIndex> {
        let road = self.table.road(&self.model, waypoint.road)?;
        self.table.find_in(road, waypoint.section as usize, waypoint.lane)
    }

    /// The road of a place on a lane.
    pub(crate) fn road(&self, waypoint: &Waypoint) -> Option<&Road> {
        let road = self.table.road(&self.model, waypoint.road)?;
        self.model.roads.get(road.road as usize)
    }

    #[inline]
    pub(crate) fn waypoint_on(&self, lane: LaneIndex, s: f64) -> Option<Waypoint> {
        let LaneEntry { road_id, section, lane_id, .. } = *self.table.get(lane)?;
        Some(Waypoint { road: road_id, section, lane: lane_id, s })
    }
}
