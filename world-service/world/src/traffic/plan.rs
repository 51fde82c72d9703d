//! The lights and signs of a town, as actors that never move.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
use roads::{Map, SignKind, SignalPose, TrafficLight, TriggerBox};
use schemas::{ActorDescription, ActorId, ActorKind, ActorState, Pose, Vec3};

use crate::overlap::OrientedBox;
use crate::scenery::{Reach, Scenery};

/// The blueprint of stop signs.
const STOP: &str = "traffic.stop";

/// Everything about lights and signs that worlds of one town share.
#[derive(Debug, Default)]
pub(crate) struct TrafficPlan {
    /// Lights, then signs, each in the order of the map; worlds give them ids in this order.
    actors: Vec<ActorState>,
    /// OpenDRIVE id of the signal, by actor.
    signals: Vec<String>,
    /// Places of what stands for it in [`Scenery`], by actor.
    places: Vec<Vec<u32>>,
    /// Blueprint ids, by type index.
    types: Vec<String>,
    /// Positions of controllers in the order of their turns, by group.
    pub groups: Vec<Vec<usize>>,
    /// Positions of lights, by controller.
    pub controllers: Vec<Vec<usize>>,
    /// Position of the controller, by light.
    pub controller_of: Vec<usize>,
    /// Position of the group, by light.
    group_of: Vec<u16>,
    /// Where vehicles wait for lights and at signs that hold them.
    boxes: Option<Scenery>,
    /// Position of the light or sign, by box.
    holder_of_box: Vec<usize>,
    /// Whether a lane has boxes of several lights, by light.
    is_beside_others: Vec<bool>,
    /// Boxes on the ways whose vehicles go first, by the position of the sign that says so.
    crossing: BTreeMap<usize, Vec<OrientedBox>>,
}

impl TrafficPlan {
    pub(crate) fn new(map: &Map) -> Self {
        let found = map.traffic_lights();
        let mut plan = Self {
            groups: found.groups.into_iter().map(|group| group.controllers).collect(),
            ..Self::default()
        };
        plan.is_beside_others = beside_others(&found.lights);
        let mut boxes: Vec<(Pose, Vec3)> = Vec::new();
        for of in &found.lights {
            let at = plan.add(ActorKind::TrafficLight, "traffic.traffic_light", of.pose, &of.boxes);
            plan.signals.push(of.id.clone());
            plan.controller_of.push(of.controller);
            let group = found.controllers.get(of.controller).map_or(0, |found| found.group);
            plan.group_of.push(u16::try_from(group).unwrap_or(u16::MAX));
            boxes.extend(of.boxes.iter().map(placed));
            plan.holder_of_box.resize(boxes.len(), at);
        }
        plan.controllers = found.controllers.into_iter().map(|found| found.lights).collect();
        for sign in map.traffic_signs() {
            let Some(blueprint) = sign.kind.blueprint() else { continue };
            let at = plan.add(ActorKind::TrafficSign, &blueprint, sign.pose, &sign.boxes);
            plan.signals.push(sign.id);
            if !sign.crossing.is_empty() {
                let boxes = sign.crossing.iter().map(placed);
                let boxes = boxes.map(|(pose, half_m)| OrientedBox::of(&pose, half_m));
                plan.crossing.insert(at, boxes.collect());
            }
            if sign.kind == SignKind::Stop || !sign.crossing.is_empty() {
                boxes.extend(sign.boxes.iter().map(placed));
                plan.holder_of_box.resize(boxes.len(), at);
            }
        }
        plan.boxes = (!boxes.is_empty()).then(|| {
            let boxes = (0..).zip(boxes);
            Scenery::new(boxes.map(|(at, (pose, half_m))| (at, pose, half_m)))
        });
        plan.places = plan.places_of(map);
        plan
    }

    fn places_of(&self, map: &Map) -> Vec<Vec<u32>> {
        let positions: BTreeMap<&str, usize> =
            self.signals.iter().map(String::as_str).zip(0..).collect();
        let mut places = vec![Vec::new(); self.actors.len()];
        for (place, post) in map.posts_with_places() {
            let landmark = map.landmarks().get(post.landmark);
            let position = landmark.and_then(|landmark| positions.get(landmark.id.as_str()));
            if let Some(places) = position.and_then(|position| places.get_mut(*position)) {
                places.extend([place, map.carried_place(place)]);
            }
        }
        places
    }

    /// Gives its position.
    fn add(
        &mut self,
        kind: ActorKind,
        blueprint: &str,
        pose: SignalPose,
        boxes: &[TriggerBox],
    ) -> usize {
        let known = self.types.iter().position(|known| known == blueprint);
        let type_index = known.unwrap_or_else(|| {
            self.types.push(blueprint.to_owned());
            self.types.len() - 1
        });
        let world_from_actor = world_from_actor(&pose);
        let (box_centre_m, box_half_extent_m) = volume(&world_from_actor, boxes);
        let pose: Pose = nalgebra::convert(world_from_actor);
        // There are fewer blueprints than u16 values.
        let at_rest = ActorState::at_rest(ActorId::FIRST, kind, type_index as u16, pose);
        self.actors.push(ActorState { box_centre_m, box_half_extent_m, ..at_rest });
        self.actors.len() - 1
    }

    /// The places of the posts of the light or sign at a position.
    pub(crate) fn places(&self, position: usize) -> &[u32] {
        self.places.get(position).map_or(&[], Vec::as_slice)
    }

    /// How many lights and signs there are.
    pub(crate) fn count(&self) -> usize {
        self.actors.len()
    }

    /// All of them, as every frame of a world shows them whose ids begin at `first`;
    /// [`types`](Self::types) holds their blueprints.
    pub(crate) fn actors(&self, first: ActorId) -> impl Iterator<Item = ActorState> {
        let ids = (0..).map(move |position| first.plus(position));
        ids.zip(&self.actors).map(|(id, actor)| ActorState { id, ..actor.clone() })
    }

    /// Where the one at a position stands.
    pub(crate) fn pose(&self, position: usize) -> Option<Pose> {
        self.actors.get(position).map(|actor| actor.world_from_actor)
    }

    /// Where among them an actor is, in a world whose ids begin at `first`.
    pub(crate) fn position(&self, id: ActorId, first: ActorId) -> Option<usize> {
        let position = id.get().checked_sub(first.get())? as usize;
        (position < self.actors.len()).then_some(position)
    }

    pub(crate) fn types(&self) -> &[String] {
        &self.types
    }

    pub(crate) fn light_count(&self) -> usize {
        self.controller_of.len()
    }

    /// Whether a light has its lane with others, which may hold other ways from there.
    pub(crate) fn is_beside_others(&self, light: usize) -> bool {
        self.is_beside_others.get(light).copied().unwrap_or(false)
    }

    /// Which group a light belongs to.
    pub(crate) fn group_of(&self, light: usize) -> u16 {
        self.group_of.get(light).copied().unwrap_or(u16::MAX)
    }

    /// What a frame does not say of the actor at a position.
    pub(crate) fn description(&self, position: usize, actor: &ActorState) -> ActorDescription {
        ActorDescription {
            id: actor.id,
            attachment: None,
            kind: actor.kind,
            blueprint: self.types.get(usize::from(actor.type_index)).cloned().unwrap_or_default(),
            attributes: Vec::new(),
            box_centre_m: actor.box_centre_m,
            box_half_extent_m: actor.box_half_extent_m,
            tag: tag(actor.kind),
            signal: self.signals.get(position).cloned(),
        }
    }

    /// Whether who is at the sign at a position lets others go first.
    pub(crate) fn gives_way(&self, position: usize) -> bool {
        self.crossing.contains_key(&position)
    }

    /// Whether any sign has who is at it let others go first.
    pub(crate) fn has_crossings(&self) -> bool {
        !self.crossing.is_empty()
    }

    /// Whether a vehicle is on a way that the sign at a position lets go first.
    pub(crate) fn is_crossed(&self, position: usize, vehicle: &OrientedBox) -> bool {
        let boxes = self.crossing.get(&position);
        boxes.into_iter().flatten().any(|on_way| on_way.overlaps(vehicle))
    }

    /// Whether a stop sign stands at a position.
    pub(crate) fn is_stop(&self, position: usize) -> bool {
        let actor = self.actors.get(position);
        let blueprint = actor.and_then(|actor| self.types.get(usize::from(actor.type_index)));
        blueprint.is_some_and(|blueprint| blueprint == STOP)
    }

    /// The position of the light or sign that holds vehicles in one of whose boxes a vehicle is; of
    /// several the one with the nearest box, but lights count before signs, and those that do not
    /// stand hold nobody.
    ///
    /// `near` is scratch space.
    pub(crate) fn holder_at(
        &self,
        vehicle: &OrientedBox,
        stands: impl Fn(usize) -> bool,
        near: &mut Vec<u32>,
    ) -> Option<usize> {
        let boxes = self.boxes.as_ref()?;
        near.clear();
        boxes.find(Reach { centre_m: vehicle.centre_m(), radius_m: vehicle.radius_m() }, near);
        let mut nearest: Option<(bool, f32, u32)> = None;
        for &index in near.iter() {
            let Some(fixture) = boxes.get(index) else { continue };
            let Some(&holder) = self.holder_of_box.get(index as usize) else { continue };
            let is_sign = holder >= self.light_count();
            let away_m = fixture.world_from_box.translation.vector - vehicle.centre_m();
            let candidate = (is_sign, away_m.norm_squared(), index);
            let trigger = OrientedBox::of(&fixture.world_from_box, fixture.half_m);
            if nearest.is_none_or(|best| candidate < best)
                && stands(holder)
                && vehicle.overlaps(&trigger)
            {
                nearest = Some(candidate);
            }
        }
        self.holder_of_box.get(nearest?.2 as usize).copied()
    }
}

/// Whether a lane has boxes of several lights, by light.
fn beside_others(lights: &[TrafficLight]) -> Vec<bool> {
    let lane = |held: &TriggerBox| (held.middle.road, held.middle.section, held.middle.lane);
    let mut of_lane: BTreeMap<_, Vec<usize>> = BTreeMap::new();
    for (index, light) in lights.iter().enumerate() {
        let lanes: BTreeSet<_> = light.boxes.iter().map(lane).collect();
        lanes.into_iter().for_each(|lane| of_lane.entry(lane).or_default().push(index));
    }
    let mut beside = vec![false; lights.len()];
    for index in of_lane.into_values().filter(|all| all.len() > 1).flatten() {
        beside[index] = true;
    }
    beside
}

fn placed(trigger: &TriggerBox) -> (Pose, Vec3) {
    (nalgebra::convert(trigger.pose), nalgebra::convert(trigger.half_extent_m))
}

/// CARLA's semantic tags `TrafficLight` and `TrafficSigns`.
const fn tag(kind: ActorKind) -> u8 {
    match kind {
        ActorKind::TrafficLight => 7,
        _ => 8,
    }
}

/// Upright, with x to the right of the traffic it addresses: CARLA turns the actors of signals so,
/// and its client looks for stop lines along that axis.
fn world_from_actor(pose: &SignalPose) -> Isometry3<f64> {
    let heading_rad = pose.heading_rad - std::f64::consts::FRAC_PI_2;
    Isometry3::from_parts(
        Translation3::from(pose.point.coords),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad),
    )
}

/// Middle and half size, in the actor's frame, of the box around all trigger boxes.
fn volume(world_from_actor: &Isometry3<f64>, boxes: &[TriggerBox]) -> (Vec3, Vec3) {
    const SIGNS: [f64; 2] = [-1.0, 1.0];
    let corners = boxes.iter().flat_map(|trigger| {
        SIGNS.iter().flat_map(move |x| {
            SIGNS.iter().flat_map(move |y| {
                SIGNS.iter().map(move |z| {
                    let half = trigger.half_extent_m;
                    let corner = Point3::new(x * half.x, y * half.y, z * half.z);
                    world_from_actor.inverse_transform_point(&(trigger.pose * corner)).coords
                })
            })
        })
    });
    let bounds = corners
        .map(|corner| (corner, corner))
        .reduce(|(low, high), (l, h)| (low.inf(&l), high.sup(&h)));
    bounds.map_or((Vec3::zeros(), Vec3::zeros()), |(low, high)| {
        (nalgebra::convert((low + high) / 2.0), nalgebra::convert((high - low) / 2.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A light and a sign with boxes of 4 m so far along x: positions 0 and 1. Boxes are in the
    /// order of positions, or in the other one.
    fn plan(middles_m: [f32; 2], order: [usize; 2]) -> TrafficPlan {
        let half_m = Vec3::new(2.0, 2.0, 1.0);
        let boxes = order.map(|at| (0, Pose::translation(middles_m[at], 0.0, 0.0), half_m));
        TrafficPlan {
            controller_of: vec![0],
            boxes: Some(Scenery::new(boxes)),
            holder_of_box: order.to_vec(),
            ..TrafficPlan::default()
        }
    }

    #[test]
    fn a_light_counts_before_a_sign_whose_box_is_nearer() {
        let vehicle = OrientedBox::of(&Pose::identity(), Vec3::new(2.0, 1.0, 1.0));
        for order in [[0, 1], [1, 0]] {
            for (middles_m, wanted) in [
                ([3.0, 0.5], Some(0)),
                ([0.5, 3.0], Some(0)),
                ([30.0, 3.0], Some(1)),
                ([30.0, 30.0], None),
            ] {
                let found = plan(middles_m, order).holder_at(&vehicle, |_| true, &mut Vec::new());
                assert_eq!(found, wanted, "light and sign at {middles_m:?}, boxes {order:?}");
            }
        }
    }
}
