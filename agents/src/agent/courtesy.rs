//! Makes way: whoever is pressed by a faster vehicle behind lets it pass on a free lane beside.
//!
//! **Source:** when and to which side is what CARLA's `BehaviorAgent` does about tailgating. Unlike
//! it an agent looks whether the lane beside has room and comes back to its route.

use schemas::AgentStatus;

use super::change::{LENGTH_M_MIN, ask_room};
use super::traits::Traits;
use super::{Agent, CURVE_MPS2, SPACING_M};
use crate::beside::{ROOM_M, neighbours};
use crate::network::{Beside, Network, Place};
use crate::path::{Leg, Path, curvature_per_m};
use crate::route;
use crate::senses::Senses;

/// Slower than this nobody makes way.
const SPEED_MPS_MIN: f32 = 10.0 / 3.6;
/// Who has made way does not again for so long, and who could not thinks again after so long.
const AGAIN_SECS: f32 = 10.0;
const THINK_SECS: f32 = 1.0;
/// The change takes this long, and the vehicle stays on the other lane at least as long as this.
const CHANGE_SECS: f32 = 3.5;
const STAY_SECS: f32 = 6.0;
/// What coming back may cost more than the way that was left, in metres of way.
const DETOUR_M: f32 = 60.0;
/// Legs of the way that are tried as ends of the way back.
const LEGS_MAX: usize = 4;

impl Agent {
    /// Changes to a lane beside, if somebody faster is close behind and there is room.
    pub(super) fn make_way(&mut self, senses: &Senses<'_>, traits: &Traits, speed_mps: f32) {
        self.calm_secs = (self.calm_secs - senses.dt_secs).max(0.0);
        if self.calm_secs > 0.0 || speed_mps < SPEED_MPS_MIN || !traits.makes_way {
            return;
        }
        // Who was granted a way through a junction drives it.
        if self.options.ignore_vehicles || !self.passage.is_free() {
            return;
        }
        if !self.is_pressed(senses, traits, speed_mps) {
            return;
        }
        self.calm_secs = THINK_SECS;
        if let Some(path) = self.aside(senses, traits, speed_mps) {
            self.path = path;
            self.calm_secs = AGAIN_SECS;
        }
    }

    /// Whether somebody faster is close behind on the lane.
    fn is_pressed(&self, senses: &Senses<'_>, traits: &Traits, speed_mps: f32) -> bool {
        let Some(here) = self.path.at(senses.network, 0.0) else { return false };
        let near_m = traits.pressed_m(here.point.limit_mps);
        let mut pressed = false;
        neighbours(senses.scene, senses.body, &here.point, |other| {
            let close = (0.0..near_m).contains(&other.gap_m());
            pressed |= other.is_behind() && close && other.along_mps > speed_mps;
        });
        pressed
    }

    /// The way over the lane on the right, else over that on the left, if it has room and no bend
    /// too sharp for the change.
    fn aside(&self, senses: &Senses<'_>, traits: &Traits, speed_mps: f32) -> Option<Path> {
        let network = senses.network;
        let (_, lane) = self.path.own(network)?;
        if lane.junction.is_some() || self.path.is_changing() {
            return None;
        }
        let at_m = self.path.place(network)?.at_m;
        let length_m = (CHANGE_SECS * speed_mps).max(LENGTH_M_MIN);
        [lane.right, lane.left].into_iter().flatten().find_map(|beside: Beside| {
            let marked = at_m >= beside.from_m && at_m + length_m <= beside.to_m;
            let path = self.path.aside(network, beside.lane, length_m).filter(|_| marked)?;
            let change = path.next_change(network)?;
            let free = network.lane(beside.lane)?.goes_on || self.status == AgentStatus::OnRoute;
            let calm =
                sideways_mps2(network, &path, length_m, speed_mps) < CURVE_MPS2 * traits.grip;
            if !free || !calm || ask_room(senses, &path, &change, (speed_mps, ROOM_M)).is_err() {
                return None;
            }
            match self.status {
                AgentStatus::OnRoute => back(network, &self.path, &path, speed_mps),
                _ => Some(path),
            }
        })
    }
}

/// The most that the first part of a way asks for at a speed.
fn sideways_mps2(network: &Network, path: &Path, length_m: f32, speed_mps: f32) -> f32 {
    let mut points = Vec::new();
    path.sample(network, length_m, SPACING_M, &mut points);
    let bends = (0..points.len()).map(|index| curvature_per_m(&points, index));
    speed_mps * speed_mps * bends.fold(0.0, f32::max)
}

/// The way aside, and back to the old way where it passes no place by.
fn back(network: &Network, old: &Path, aside: &Path, speed_mps: f32) -> Option<Path> {
    let mut legs: Vec<Leg> = aside.ahead().map(|(_, leg)| *leg).collect();
    let stay = legs.last_mut()?;
    stay.to_m = stay.to_m.min(stay.from_m + STAY_SECS * speed_mps);
    let from = Place { lane: stay.lane, at_m: stay.to_m };
    let driven_m: f32 = legs.iter().map(Leg::length_m).sum();
    let ends: Vec<(f32, Leg)> =
        old.ahead().map(|(begins_m, leg)| (begins_m + leg.length_m(), *leg)).collect();
    for (index, (ends_m, leg)) in ends.iter().enumerate().take(LEGS_MAX) {
        if leg.onto.is_some() {
            return None;
        }
        let to = Place { lane: leg.lane, at_m: leg.to_m };
        let most_m = ends_m - driven_m + DETOUR_M;
        let way = route::plan(network, from, to).filter(|_| *ends_m > driven_m);
        if let Some((_, way)) = way.filter(|(cost_m, _)| *cost_m < most_m) {
            return Some(old.with(0..=index, legs.into_iter().chain(way)));
        }
        // Another leg on the same lane: a place to pass is in between.
        if ends.get(index + 1).is_some_and(|(_, next)| next.lane == leg.lane) {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use roads::Map;
    use schemas::{AgentOptions, Pose};

    use super::*;
    use crate::network::LaneId;
    use crate::pilot::VehicleView;
    use crate::scene::Scene;
    use crate::testing::vehicle;

    /// A road with two lanes to one side, 300 m long.
    fn road(curvature_per_m: f32) -> Network {
        let lane = |id: i32| {
            format!(
                "<lane id=\"{id}\" type=\"driving\">\
                 <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\
                 <roadMark sOffset=\"0\" type=\"broken\" weight=\"standard\" color=\"white\" \
                 width=\"0.1\" laneChange=\"both\"/></lane>"
            )
        };
        let text = format!(
            "<OpenDRIVE><header/><road id=\"1\" length=\"300\" junction=\"-1\"><link/><planView>\
             <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"300\">\
             <arc curvature=\"{curvature_per_m}\"/></geometry></planView><lanes>\
             <laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center>\
             <right>{}{}</right></laneSection></lanes></road></OpenDRIVE>",
            lane(-1),
            lane(-2)
        );
        Network::new(&Map::parse("road", &text).unwrap())
    }

    /// Whether an agent without a destination may make way at a speed.
    fn makes_way(network: &Network, speed_mps: f32) -> bool {
        let ids = 0..network.lane_count() as LaneId;
        let mut inner = ids.filter(|id| network.lane(*id).is_some_and(|lane| lane.right.is_some()));
        let id = inner.next().unwrap();
        let lane = network.lane(id).unwrap();
        let mut agent = Agent::new(AgentOptions::default());
        agent.path.push(Leg { lane: id, from_m: 50.0, to_m: lane.length_m(), onto: None });
        // Ways along lanes that end lead nowhere, but for who is on a route.
        agent.status = AgentStatus::OnRoute;
        let at = lane.at(50.0);
        let body = vehicle([2.4, 0.9, 0.7], at.point_m, at.heading(), speed_mps);
        let scene = Scene::new(vec![body], Vec::new());
        let view = VehicleView::of_car(Pose::identity(), body.velocity_mps);
        let senses = Senses { network, scene: &scene, view: &view, body: &body, dt_secs: 0.05 };
        let traits = Traits::of(&AgentOptions::default(), 1.0);
        agent.aside(&senses, &traits, speed_mps).is_some()
    }

    #[test]
    fn nobody_makes_way_in_a_bend_that_is_too_sharp_for_a_change_at_that_speed() {
        let (straight, bend) = (road(1.0e-6), road(0.02));
        assert!(makes_way(&straight, 13.0));
        assert!(makes_way(&bend, 8.0));
        assert!(!makes_way(&bend, 13.0));
    }
}
