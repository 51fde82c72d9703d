//! Environment objects: what belongs to the map, in the words of CARLA's client.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use schemas::SemanticTag;

use crate::crosswalks::corners;
use crate::labels::{MapLayer, SceneryKind, of_object};
use crate::lanes::lateral_point;
use crate::model::{Object, Road};
use crate::post::Post;
use crate::scenery::scenery_box;
use crate::signals::{Signal, SignalPose, is_traffic_light};

/// Height of a traffic light above the ground and half of its width, in metres.
const LIGHT_M: [f64; 2] = [5.2, 0.25];
/// Width, height and half of the thickness of signs that do not say theirs, in metres.
const SIGN_M: [f64; 3] = [0.6, 0.6, 0.03];
/// Half of the height of flat things, in metres.
const FLAT_HALF_M: f64 = 0.01;

/// One thing that is part of the map.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentObject {
    /// Not 0, and no other object of the map has it; the same whenever the same text is read.
    pub id: u64,
    /// What it is and where: name, road and number.
    pub name: String,
    /// What cameras see in it.
    pub label: SemanticTag,
    /// The layer of the map it is part of. What has no place in the scenery stays when its layer
    /// goes: the roads and what lies on them, lights and signs.
    pub layer: MapLayer,
    /// Middle of the box around it.
    pub pose: Isometry3<f64>,
    /// Half of the size of that box along its own axes, in metres.
    pub half_extent_m: Vector3<f64>,
    /// Position in [`Map::scenery`](crate::Map::scenery) of the box that bodies hit, where it has
    /// one.
    pub scenery: Option<u32>,
    /// Place of the [post](crate::Map::posts_with_places) of a light or sign, where it has one.
    pub post: Option<u32>,
    /// Its own place among the things that can be hidden, where it has one.
    pub place: Option<u32>,
}

impl EnvironmentObject {
    /// Whether it goes with these layers, CARLA's flags.
    #[must_use]
    pub fn goes_with(&self, layers: u16) -> bool {
        self.scenery.is_some() && self.layer as u16 & layers != 0
    }
}

/// Where an object comes from; the first byte of its id.
#[derive(Clone, Copy)]
enum Origin {
    Road = 1,
    Object = 2,
    Signal = 3,
    FarSide = 4,
    Post = 5,
}

/// From the origin, the road and the position there.
fn id(origin: Origin, road: u32, position: usize) -> u64 {
    (origin as u64) << 56 | u64::from(road) << 24 | (position as u64 & 0x00ff_ffff)
}

/// A post, with the id and the road of its signal.
pub(crate) struct Standing<'m> {
    pub(crate) signal: &'m str,
    pub(crate) road: u32,
    /// Its place among the things that can be hidden, and that of what it carries.
    pub(crate) places: [u32; 2],
    pub(crate) post: &'m Post,
}

/// Everything of roads with their objects, of signals with their ids and poses, and of posts;
/// ordered by id.
pub(crate) fn list<'m>(
    roads: impl Iterator<Item = (&'m Road, impl Iterator<Item = &'m Object>)>,
    signals: impl Iterator<Item = (&'m String, &'m Signal, &'m SignalPose)>,
    posts: impl Iterator<Item = Standing<'m>>,
) -> Vec<EnvironmentObject> {
    let posts: Vec<Standing<'_>> = posts.collect();
    let (far_side, near): (Vec<_>, Vec<_>) = posts.iter().partition(|one| one.post.is_far_side);
    let post_of: BTreeMap<&str, [u32; 2]> =
        near.iter().map(|one| (one.signal, one.places)).collect();
    let mut found = Vec::new();
    let mut scenery_count = 0;
    for (road, objects) in roads {
        if !road.is_for_nobody() {
            found.push(road_object(road));
        }
        for (position, object) in objects.enumerate() {
            let scenery = scenery_box(road, object).map(|_| scenery_count);
            scenery_count += u32::from(scenery.is_some());
            found.extend(thing(road, object, position, scenery));
        }
    }
    found.extend(signals.enumerate().map(|(position, (id, signal, at))| {
        sign(id, signal, at, position, post_of.get(id.as_str()).copied())
    }));
    let far_side = far_side.iter().enumerate();
    found.extend(far_side.map(|(position, one)| far_side_light(one, position)));
    found.extend(posts.iter().enumerate().map(|(position, one)| pole(one, position)));
    found.sort_by_key(|object| object.id);
    found
}

/// The surface of a road, as a level box around its reference line and borders.
fn road_object(road: &Road) -> EnvironmentObject {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for section in &road.sections {
        for share in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let s = section.start_s + (section.end_s - section.start_s) * share;
            for lane in &section.lanes {
                let outer = crate::lanes::lateral(road, section, lane.id, s).outer;
                let at = lateral_point(road, s, outer, 0.0).coords;
                (low, high) = (low.inf(&at), high.sup(&at));
            }
        }
    }
    let half_extent_m = ((high - low) / 2.0).sup(&Vector3::repeat(FLAT_HALF_M));
    EnvironmentObject {
        id: id(Origin::Road, road.id, 0),
        name: format!("Road_{}", road.id),
        label: SemanticTag::Roads,
        layer: MapLayer::Ground,
        pose: Translation3::from((low + high) / 2.0).into(),
        half_extent_m,
        scenery: None,
        post: None,
        place: None,
    }
}

/// An object of a road; `None` for those that stand for signals and those of no known kind.
fn thing(
    road: &Road,
    object: &Object,
    position: usize,
    scenery: Option<u32>,
) -> Option<EnvironmentObject> {
    let (label, layer) = of_object(object)?;
    let is_outlined = object.is_crosswalk() || !object.corners.is_empty();
    let (pose, half_extent_m) = if is_outlined && layer == MapLayer::Decals {
        flat_box(&corners(road, object, &object.corners, 0.0))?
    } else if let Some(solid) = scenery_box(road, object) {
        let mut half_m = solid.half_extent_m;
        let mut pose = solid.pose;
        if solid.kind == SceneryKind::Tree {
            // The trunk's box grows to hold the crown.
            let half_height_m = solid.height_m / 2.0;
            pose.translation.z += half_height_m - half_m.z;
            half_m = Vector3::new(solid.crown_radius_m, solid.crown_radius_m, half_height_m);
        }
        (pose, half_m)
    } else {
        patch_box(road, object)
    };
    let noun = if object.name.is_empty() { &object.object_type } else { &object.name };
    Some(EnvironmentObject {
        id: id(Origin::Object, road.id, position),
        name: format!("{noun}_{}_{position}", road.id),
        label,
        layer,
        pose,
        half_extent_m,
        scenery,
        post: None,
        place: scenery,
    })
}

/// The box around flat corners, turned as their first edge.
fn flat_box(corners: &[Point3<f64>]) -> Option<(Isometry3<f64>, Vector3<f64>)> {
    let [first, second, ..] = corners else { return None };
    let along = second - first;
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, along.y.atan2(along.x));
    let local = corners.iter().map(|corner| turn.inverse() * corner.coords);
    let (low, high) = local.fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(low, high), at| (low.inf(&at), high.sup(&at)),
    );
    let middle = turn * ((low + high) / 2.0);
    let half_m = ((high - low) / 2.0).sup(&Vector3::repeat(FLAT_HALF_M));
    Some((Isometry3::from_parts(middle.into(), turn), half_m))
}

/// Paving or paint, which nothing runs into.
fn patch_box(road: &Road, object: &Object) -> (Isometry3<f64>, Vector3<f64>) {
    let size = Vector3::new(object.length_m, object.width_m, object.height_m);
    let half_m = (size / 2.0).sup(&Vector3::repeat(FLAT_HALF_M));
    let foot = lateral_point(road, object.s, object.t, object.z_offset_m);
    let middle = foot + Vector3::z() * half_m.z;
    let heading_rad = road.reference(object.s).heading_rad + object.heading_rad;
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, heading_rad);
    (Isometry3::from_parts(middle.coords.into(), turn), half_m)
}

/// A light or a sign, at the place the client gives it.
fn sign(
    signal_id: &str,
    signal: &Signal,
    at: &SignalPose,
    position: usize,
    places: Option<[u32; 2]>,
) -> EnvironmentObject {
    let is_light = is_traffic_light(&signal.signal_type);
    let half_extent_m = if is_light {
        let [height_m, half_m] = LIGHT_M;
        Vector3::new(half_m, half_m, height_m / 2.0)
    } else {
        let given = |value_m: f64, else_m: f64| if value_m > 0.0 { value_m } else { else_m };
        let [width_m, height_m, half_thickness_m] = SIGN_M;
        let (width_m, height_m) =
            (given(signal.width_m, width_m), given(signal.height_m, height_m));
        Vector3::new(half_thickness_m, width_m / 2.0, height_m / 2.0)
    };
    let middle = at.point + Vector3::z() * half_extent_m.z;
    let turn = UnitQuaternion::from_euler_angles(at.roll_rad, -at.pitch_rad, at.heading_rad);
    let noun = if is_light { "TrafficLight" } else { "TrafficSign" };
    let label = if is_light { SemanticTag::TrafficLight } else { SemanticTag::TrafficSigns };
    EnvironmentObject {
        id: id(Origin::Signal, signal.road, position),
        name: format!("{noun}_{signal_id}"),
        label,
        layer: MapLayer::Props,
        pose: Isometry3::from_parts(middle.coords.into(), turn),
        half_extent_m,
        scenery: None,
        post: places.map(|[post, _]| post),
        place: places.map(|[_, carried]| carried),
    }
}

/// The lamps of a light beyond its junction, with their post.
fn far_side_light(standing: &Standing<'_>, position: usize) -> EnvironmentObject {
    let [height_m, half_m] = LIGHT_M;
    EnvironmentObject {
        id: id(Origin::FarSide, standing.road, position),
        name: format!("TrafficLight_{}_far", standing.signal),
        label: SemanticTag::TrafficLight,
        place: Some(standing.places[1]),
        ..upright(standing, half_m, height_m)
    }
}

/// The post of a light or sign from its foot to its top.
fn pole(standing: &Standing<'_>, position: usize) -> EnvironmentObject {
    let Standing { signal, road, post, .. } = *standing;
    let far = if post.is_far_side { "_far" } else { "" };
    EnvironmentObject {
        id: id(Origin::Post, road, position),
        name: format!("Pole_{signal}{far}"),
        ..upright(standing, post.radius_m, post.top_m)
    }
}

/// A pole without a name of its own, as wide and high as that.
fn upright(standing: &Standing<'_>, half_m: f64, height_m: f64) -> EnvironmentObject {
    let half_extent_m = Vector3::new(half_m, half_m, height_m / 2.0);
    EnvironmentObject {
        id: 0,
        name: String::new(),
        label: SemanticTag::Poles,
        layer: MapLayer::Props,
        pose: standing.post.foot * Translation3::new(0.0, 0.0, half_extent_m.z),
        half_extent_m,
        scenery: None,
        post: Some(standing.places[0]),
        place: Some(standing.places[0]),
    }
}
