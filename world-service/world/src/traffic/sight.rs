//! Which rules hold for a vehicle where it is.

use agents::{Body, Entering, Network, Owed, Scene};
use nalgebra::Vector3;
use roads::{LaneTypes, Map};
use schemas::{ActorId, Pose, TrafficLightColour, Vec3};
use serde::{Deserialize, Serialize};

use super::red::{Line, Seen};
use super::{Lights, TrafficPlan};
use crate::overlap::OrientedBox;

/// How long a stop sign holds who comes to it, in seconds. **Source:** CARLA's server.
const STOP_SECS: f32 = 2.0;
/// Who is faster at a stop sign all along has not stopped.
const STOPPED_MPS: f32 = 0.5;

/// What lights and signs say to one vehicle. Stays as it is while the vehicle sleeps and none
/// holds it for a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoadRules {
    /// 0 where none is posted.
    pub speed_limit_mps: f32,
    /// The light in whose box it is.
    light: Option<ActorId>,
    /// The stop or yield sign in whose box it is.
    stop: Option<ActorId>,
    /// For how long that will hold it.
    stop_secs: f32,
    /// What the lights showed at the line that it is at, or has passed.
    seen: Seen,
    /// The slowest that it was in its box.
    slowest_mps: f32,
    /// The crossing before which it is to let people over.
    owed: Owed,
    /// Whether it is known of the junction that it drives into if it takes the way of others.
    is_judged: bool,
    /// Whether it was put where it is since it last looked around.
    is_put: bool,
    broken: Broken,
    /// Where it last looked for its speed limit; saves time and decides nothing.
    #[serde(skip)]
    looked: Option<Looked>,
}

/// Where a vehicle looked for the nearest lane, and how far away that was.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Looked {
    at_m: Vec3,
    away_m: f64,
}

impl Looked {
    /// Some lane is nearer to a place than this.
    fn within_m(&self, place_m: &Vector3<f64>) -> f64 {
        /// For rounding.
        const MORE_M: f64 = 1.0e-3;
        let before_m: Vector3<f64> = nalgebra::convert(self.at_m);
        self.away_m + (place_m - before_m).norm() + MORE_M
    }
}

/// How often a vehicle broke a rule.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Broken {
    /// Lights that showed red from when it came to their line until it had passed it; of several
    /// at one line those that hold the way that it took.
    pub red_lights: u32,
    /// Stop signs at which it did not stand.
    pub stop_signs: u32,
    /// Junctions that it drove into before traffic or an agent that was to go first and came soon.
    pub right_of_way: u32,
    /// Crossings that it drove onto before people whom it could have let over.
    pub crossings: u32,
}

/// Where a vehicle is and how fast, and what the lights show.
#[derive(Clone, Copy)]
pub(crate) struct Passing<'a> {
    /// The ways of the town, made when somebody asks first.
    pub network: &'a dyn Fn() -> &'a Network,
    pub id: ActorId,
    pub world_from_vehicle: &'a Pose,
    pub outline: &'a OrientedBox,
    pub speed_mps: f32,
    pub lights: &'a Lights,
    /// Who may be on a way whose vehicles go first: vehicles that are at no sign.
    pub others: &'a [(ActorId, OrientedBox)],
}

impl Passing<'_> {
    /// Whether somebody else is on a way whose vehicles go first before who is at this sign.
    fn must_give_way(&self, plan: &TrafficPlan, sign: usize) -> bool {
        plan.gives_way(sign)
            && self.others.iter().any(|(id, other)| *id != self.id && plan.is_crossed(sign, other))
    }
}

impl RoadRules {
    /// The light in whose box it is, or the sign that holds it.
    pub(crate) fn holder(&self) -> Option<ActorId> {
        self.light.or(self.stop.filter(|_| self.is_held_for_a_time()))
    }

    /// How often it broke a rule.
    pub(crate) fn broken(&self) -> Broken {
        self.broken
    }

    /// Counts people whom it does not let over where it is now.
    pub(crate) fn judge_people(&mut self, network: &Network, scene: &Scene, body: &Body) {
        self.broken.crossings += u32::from(self.owed.look(network, scene, body));
    }

    /// Counts a junction that it drives into before others.
    pub(crate) fn judge_way(&mut self, entering: Entering) {
        let takes = entering == Entering::Taking;
        self.broken.right_of_way += u32::from(takes && !self.is_judged);
        self.is_judged = match entering {
            Entering::No => false,
            Entering::Unclear => self.is_judged,
            Entering::Free | Entering::Taking => true,
        };
    }

    /// It was put somewhere: what it did before counts for nothing.
    pub(crate) fn put(&mut self) {
        self.is_put = true;
        (self.owed, self.is_judged) = (Owed::default(), false);
    }

    /// Counts the box that it drove out of, and remembers what it did in the one that it is in.
    fn judge(&mut self, (before, was_at_stop): (&Self, bool), line: Option<Line<'_>>, mps: f32) {
        let left = (before.light, before.stop) != (self.light, self.stop);
        let was_put = std::mem::take(&mut self.is_put);
        if was_put {
            self.seen = Seen::default();
        } else if left {
            let runs = before.light.is_some() && self.seen.pass();
            self.broken.red_lights += u32::from(runs);
            let passed = was_at_stop && before.slowest_mps > STOPPED_MPS;
            self.broken.stop_signs += u32::from(passed);
        }
        self.seen.look(line, left || was_put);
        let slowest_mps = if left || was_put { mps } else { self.slowest_mps.min(mps) };
        self.slowest_mps = slowest_mps;
    }

    /// A light or sign is gone: it holds nobody, and nobody passes it.
    pub(crate) fn forget(&mut self, signal: ActorId) {
        let is_it = |known: &mut ActorId| *known == signal;
        if self.light.take_if(is_it).or(self.stop.take_if(is_it)).is_some() {
            self.stop_secs = 0.0;
        }
    }

    fn is_held_for_a_time(&self) -> bool {
        self.stop_secs > 0.0
    }

    /// Whether it is at a stop or yield sign.
    pub(crate) fn is_at_sign(&self) -> bool {
        self.stop.is_some()
    }

    /// Whether what holds it may change while it sleeps.
    pub(crate) fn waits(&self, plan: &TrafficPlan, first_actor: ActorId) -> bool {
        let sign = self.stop.and_then(|sign| plan.position(sign, first_actor));
        self.is_held_for_a_time() || sign.is_some_and(|sign| plan.gives_way(sign))
    }

    /// Looks around anew, `dt_secs` after the last time. Ids of lights and signs begin at the
    /// first actor's.
    ///
    /// - **Cost:** logarithmic in the size of the map; a microsecond or two.
    pub(crate) fn update(
        &mut self,
        map: &Map,
        (plan, first_actor): (&TrafficPlan, ActorId),
        passing: &Passing<'_>,
        near: &mut Vec<u32>,
        dt_secs: f64,
    ) {
        let before = *self;
        let stands = |position: usize| passing.lights.stands(position);
        let holder = plan.holder_at(passing.outline, stands, near);
        let id_of = |position: usize| first_actor.plus(position as u32);
        self.light = holder.filter(|position| *position < plan.light_count()).map(id_of);
        let sign = holder.filter(|_| self.light.is_none());
        let stop = sign.map(id_of);
        let is_stop = |sign: Option<usize>| sign.is_some_and(|sign| plan.is_stop(sign));
        self.stop_secs = if stop == self.stop {
            (self.stop_secs - dt_secs as f32).max(0.0)
        } else if is_stop(sign) {
            STOP_SECS
        } else {
            0.0
        };
        if sign.is_some_and(|sign| passing.must_give_way(plan, sign)) {
            self.stop_secs = self.stop_secs.max(dt_secs as f32);
        }
        self.stop = stop;
        let sign_before = before.stop.and_then(|sign| plan.position(sign, first_actor));
        let is_red =
            |light: u32| passing.lights.colour(light as usize) == Some(TrafficLightColour::Red);
        let light = holder.filter(|at| *at < plan.light_count());
        let line = light.map(|light| {
            let all = match plan.is_beside_others(light) {
                true => (passing.network)().sharing(light as u32),
                false => &[],
            };
            Line { light: light as u32, all, is_red: &is_red }
        });
        self.judge((&before, is_stop(sign_before)), line, passing.speed_mps);
        if self.seen.is_unclear() {
            let runs = self.seen.runs((passing.network)(), passing.outline.front());
            self.broken.red_lights += u32::from(runs);
        }
        let at_m = passing.world_from_vehicle.translation.vector;
        // Who stands where it looked need not look again.
        if self.looked.is_none_or(|looked| looked.at_m != at_m) {
            self.find_limit(map, at_m);
        }
    }

    fn find_limit(&mut self, map: &Map, at_m: Vec3) {
        let position_m: Vector3<f64> = nalgebra::convert(at_m);
        let told_mps = self.speed_limit_mps;
        if told_mps != 0.0 && map.surely_holds(told_mps, &position_m.into()) {
            return;
        }
        let nearest =
            |within_m: f64| map.nearest_within(position_m.into(), LaneTypes::DRIVING, within_m);
        // The lane of before is no farther away than by what the vehicle moved.
        let known = self.looked.and_then(|looked| nearest(looked.within_m(&position_m)));
        let Some((place, away_m)) = known.or_else(|| nearest(f64::INFINITY)) else { return };
        self.looked = Some(Looked { at_m, away_m });
        // Ways cross in a junction, and the nearest may be another's: the limit of before holds on.
        if self.speed_limit_mps == 0.0 || !map.is_in_junction(&place) {
            self.speed_limit_mps = map.speed_limit_mps(&place).unwrap_or(0.0) as f32;
        }
    }
}
