//! Lights, signs, crossings and junctions ahead of an agent.

use schemas::{AgentStatus, TrafficLightColour};

use super::change::Taken;
use super::traits::Traits;
use super::{Agent, EASY_MPS2, GAP_M, HARD_MPS2, SPACING_M, STANDING_MPS, room};
use crate::junction::{AT_LINE_M, Approach, BEFORE_LINE_M, Claims, Held, INSIDE_M};
use crate::network::Stop;
use crate::scene::{Ahead, Queue};
use crate::senses::Senses;
use crate::speed::stops_for_yellow;

/// How long a vehicle stands at a stop sign.
const STOP_SECS: f32 = 1.0;
/// Room that is left to whoever stands beyond the end of a route.
const BEYOND_END_M: f32 = 1.0;
/// Who is kept from the end of its route and has so little way left before whoever stands beyond it
/// has arrived.
const KEPT_M: f32 = 0.5;

/// Lights, signs and people ahead.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lines {
    /// Whether it is to stop now.
    pub stops_here: bool,
    /// From the origin to the first one that holds it.
    pub held_m: Option<f32>,
    /// From the origin to the first crossing that people are on or wait for.
    pub people_m: Option<f32>,
    /// Room for its next lane change.
    pub taken: Option<Taken>,
}

impl Lines {
    /// Free way to where people are let over; endless where nobody is.
    pub(super) fn people_stop_m(&self, front_m: f32) -> f32 {
        self.people_m.map_or(f32::INFINITY, |line_m| stop_m(line_m, front_m))
    }
}

/// Free way of a front to where it stops before a line.
fn stop_m(line_m: f32, front_m: f32) -> f32 {
    (line_m - front_m - BEFORE_LINE_M).max(0.0)
}

impl Agent {
    /// Free way to where it waits for the next junction, or in it; endless where it may drive on.
    pub(super) fn junction(
        &mut self,
        senses: &Senses<'_>,
        claims: &mut Claims,
        (ahead, queue): (Option<Ahead>, &Queue<'_>),
        lines: &Lines,
        (look_m, speed_mps): (f32, f32),
    ) -> f32 {
        if !self.asks() {
            return f32::INFINITY;
        }
        let grip = senses.view.grip;
        let stopping_m = speed_mps * speed_mps / (2.0 * EASY_MPS2 * grip);
        let path = &self.path;
        let front_m = senses.body.half_m.x;
        let beside_m = lines.taken.map(|taken| taken.stop_m + front_m + BEFORE_LINE_M);
        let all_m = [lines.held_m, lines.people_m, beside_m].into_iter().flatten();
        let line_m = all_m.reduce(f32::min);
        let rest_m = self.traits(grip).rest_m();
        let approach = Approach {
            senses,
            path,
            speed_mps,
            look_m,
            stopping_m,
            gap_m: GAP_M,
            rest_m,
            line_m,
            is_at_sign: false,
            ahead,
            queue,
        };
        let free_m = self.passage.enter(&approach, claims).map_or(f32::INFINITY, |m| m.max(0.0));
        let waits_beside = self.passage.held() == Held::Line && line_m == beside_m;
        if let Some(by) = lines.taken.and_then(|taken| taken.by).filter(|_| waits_beside) {
            self.passage.wait_beside(by);
        }
        // Who comes to a light or sign stops there by its own rules, but where a junction that the
        // line does not belong to comes first.
        let is_first = |line_m: f32| free_m >= stop_m(line_m, front_m) - INSIDE_M;
        let own_rules = self.passage.held() == Held::Line && lines.held_m.is_some_and(is_first);
        if own_rules { f32::INFINITY } else { free_m }
    }

    /// Free way before somebody beyond the end of its route whom its front would touch there: its
    /// middle stops at the end.
    pub(super) fn beyond_end_m(&self, senses: &Senses<'_>, look_m: f32) -> f32 {
        let ends = self.status == AgentStatus::OnRoute && self.path.length_m() < look_m;
        if !ends || self.options.ignore_vehicles {
            return f32::INFINITY;
        }
        let more_m = senses.body.half_m.x + BEYOND_END_M;
        let mut points = Vec::new();
        let path = self.path.lengthened(senses.network, more_m);
        path.sample(senses.network, look_m + more_m, SPACING_M, &mut points);
        let ahead = senses.scene.ahead(&points, &room(senses));
        ahead.map_or(f32::INFINITY, |ahead| (ahead.gap_m - BEYOND_END_M).max(0.0))
    }

    /// Whether its front is as near to whoever stands beyond the end of its route as it may be:
    /// that one may be in a queue that waits for it.
    pub(super) fn is_kept_from_end(&self, senses: &Senses<'_>, beyond_m: f32) -> bool {
        let is_near = self.path.length_m() < senses.body.half_m.x + BEYOND_END_M + KEPT_M;
        self.status == AgentStatus::OnRoute && beyond_m < KEPT_M && is_near
    }

    /// Whether a closed light or a stop sign is near, and the first one that holds it.
    pub(super) fn lines(
        &mut self,
        senses: &Senses<'_>,
        traits: &Traits,
        look_m: f32,
        speed_mps: f32,
    ) -> Lines {
        let front_m = senses.body.half_m.x;
        let stopping_m = speed_mps * speed_mps / (2.0 * HARD_MPS2 * senses.view.grip);
        let from_m = (traits.light_m + speed_mps.max(0.0)).max(stopping_m + 1.0);
        let lines = self.path.stops(senses.network, 0.0, look_m.max(from_m) + front_m);
        let people_m = match self.options.ignore_vehicles {
            true => None,
            false => self.crossings.line(senses, &lines, speed_mps),
        };
        let urgent = senses.body.is_urgent;
        let is_closed = |light: u32, gap_m: f32| match senses.scene.light(light) {
            TrafficLightColour::Red => true,
            TrafficLightColour::Yellow => stops_for_yellow(speed_mps, gap_m),
            _ => false,
        };
        let heeds_lights = !urgent && !self.options.ignore_lights;
        let mut at_red = lines.iter().filter(|line| match line.why {
            Stop::Light(light) => heeds_lights && is_closed(light, line.ahead_m - front_m),
            _ => false,
        });
        let red_m = at_red.next().map(|line| line.ahead_m);
        let at_red = red_m.is_some_and(|red_m| red_m <= from_m + front_m);
        let sign = lines.iter().find(|line| line.why == Stop::Sign);
        let sign = sign.filter(|_| !urgent && !self.options.ignore_stop_signs);
        let Some(sign) = sign.filter(|sign| sign.ahead_m <= from_m + front_m) else {
            (self.stood_secs, self.passed) = (0.0, None);
            let held_m = sign.map(|sign| sign.ahead_m).into_iter().chain(red_m).reduce(f32::min);
            return Lines { stops_here: at_red, held_m, people_m, taken: None };
        };
        let gap_m = sign.ahead_m - front_m;
        if speed_mps < STANDING_MPS && gap_m < AT_LINE_M {
            self.stood_secs += senses.dt_secs;
        }
        if self.stood_secs >= STOP_SECS {
            self.passed = Some(sign.lane);
        }
        let holds = self.passed != Some(sign.lane);
        let sign_m = Some(sign.ahead_m).filter(|_| holds);
        let stops_here = at_red || (holds && gap_m < stopping_m + 1.5);
        let held_m = sign_m.into_iter().chain(red_m).reduce(f32::min);
        Lines { stops_here, held_m, people_m, taken: None }
    }
}

#[cfg(test)]
mod tests {
    use schemas::{AgentOptions, Pose};

    use super::*;
    use crate::network::{LaneId, Network, StopLine};
    use crate::path::Leg;
    use crate::pilot::VehicleView;
    use crate::scene::{Body, Scene};
    use crate::testing::vehicle;

    const ENTRY_M: f32 = 10.0;
    const FRONT_M: f32 = 2.4;
    const FREE: Lines = Lines { stops_here: false, held_m: None, people_m: None, taken: None };

    /// A long lane without signs, and one that leads on from it through a junction.
    fn long_lane(network: &Network) -> (LaneId, LaneId) {
        let ids = 0..network.lane_count() as LaneId;
        let mut found = ids.filter_map(|id| {
            let lane = network.lane(id).filter(|lane| lane.junction.is_some())?;
            let before = *lane.previous.first()?;
            let long = network.lane(before).filter(|lane| lane.length_m() > 2.0 * ENTRY_M)?;
            let mut lines = long.stops.iter().chain(&lane.stops);
            let signed = lines.any(|line| matches!(line.why, Stop::Sign | Stop::Yield));
            Some((before, id)).filter(|_| !signed && !lane.enters_ring && !lane.next.is_empty())
        });
        found.next().unwrap()
    }

    /// How far an agent [`ENTRY_M`] before a junction may drive when lines hold it, and whether it
    /// claims the junction then.
    fn before_a_junction(lines: &Lines, speed_mps: f32) -> (f32, bool) {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town10HD_Opt", &text).unwrap());
        let (before, inside) = long_lane(&network);
        let lane = network.lane(before).unwrap();
        let mut agent = Agent::new(AgentOptions::default());
        let from_m = lane.length_m() - ENTRY_M;
        let after = network.lane(inside).unwrap().next[0];
        for (lane, from_m) in [(before, from_m), (inside, 0.0), (after, 0.0)] {
            let to_m = network.lane(lane).unwrap().length_m();
            agent.path.push(Leg { lane, from_m, to_m, onto: None });
        }
        let at = lane.at(from_m);
        let body = vehicle([FRONT_M, 0.9, 0.7], at.point_m, at.heading(), speed_mps);
        let scene = Scene::new(vec![body], Vec::new());
        let view = VehicleView::of_car(Pose::identity(), body.velocity_mps);
        let senses =
            Senses { network: &network, scene: &scene, view: &view, body: &body, dt_secs: 0.05 };
        let mut claims = Claims::default();
        // First it is heard of, then it may ask.
        let free_m = [(); 2].map(|()| {
            agent.junction(
                &senses,
                &mut claims,
                (None, &Queue::default()),
                lines,
                (60.0, speed_mps),
            )
        });
        (free_m[1], !agent.passage.is_free())
    }

    /// Somebody stands beyond the end of a route, nearer to it than the front will be, or farther.
    #[test]
    fn who_ends_its_route_touches_nobody_beyond_it() {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town10HD_Opt", &text).unwrap());
        let (lane, _) = long_lane(&network);
        let mut agent = Agent::new(AgentOptions::default());
        agent.status = AgentStatus::OnRoute;
        agent.path.push(Leg { lane, from_m: 2.0, to_m: 8.0, onto: None });
        let at = |at_m: f32| network.lane(lane).unwrap().at(at_m);
        for (other_m, wanted_m) in [(8.0 + 5.0, Some(5.2)), (8.0 + 9.0, None)] {
            let body = vehicle([FRONT_M, 0.9, 0.7], at(2.0).point_m, at(2.0).heading(), 1.0);
            let other = vehicle([2.4, 0.9, 0.7], at(other_m).point_m, at(other_m).heading(), 0.0);
            let other = Body { id: schemas::ActorId::new(9).unwrap(), ..other };
            let scene = Scene::new(vec![body, other], Vec::new());
            let view = VehicleView::of_car(Pose::identity(), body.velocity_mps);
            let (network, view, body) = (&network, &view, &body);
            let senses = Senses { network, scene: &scene, view, body, dt_secs: 0.05 };
            let free_m = agent.beyond_end_m(&senses, 20.0);
            let alike = wanted_m.map_or(free_m.is_infinite(), |m| (free_m - m).abs() < 0.3);
            assert!(alike, "{other_m} m: {free_m} m of {wanted_m:?}");
            // Who stands so near to the other one as it may has arrived, though its middle has not.
            let mut near = agent.clone();
            near.path.go(3.2);
            assert!(near.is_kept_from_end(&senses, 0.2) && !near.is_kept_from_end(&senses, 2.0));
            assert!(!agent.is_kept_from_end(&senses, 0.2), "far from its end");
        }
    }

    /// Whether an agent stops for its light, with its front so far before the line.
    fn stops(
        colour: TrafficLightColour,
        gap_m: f32,
        speed_mps: f32,
        options: AgentOptions,
    ) -> bool {
        let text = roads::town::build("Town10HD_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town10HD_Opt", &text).unwrap());
        let is_far = |line: &&StopLine| matches!(line.why, Stop::Light(_)) && line.at_m > 60.0;
        let lit = |id: &LaneId| network.lane(*id)?.stops.iter().find(is_far).map(|at| (*id, *at));
        let (id, line) = (0..network.lane_count() as LaneId).find_map(|id| lit(&id)).unwrap();
        let lane = network.lane(id).unwrap();
        let mut agent = Agent::new(options);
        let from_m = line.at_m - gap_m - FRONT_M;
        agent.path.push(Leg { lane: id, from_m, to_m: lane.length_m(), onto: None });
        let at = lane.at(from_m);
        let body = vehicle([FRONT_M, 0.9, 0.7], at.point_m, at.heading(), speed_mps);
        let scene = Scene::new(vec![body], vec![colour; 100]);
        let view = VehicleView::of_car(Pose::identity(), body.velocity_mps);
        let senses =
            Senses { network: &network, scene: &scene, view: &view, body: &body, dt_secs: 0.05 };
        let traits = agent.traits(1.0);
        agent.lines(&senses, &traits, 60.0, speed_mps).stops_here
    }

    #[test]
    fn an_agent_stops_for_yellow_where_it_need_not_brake_hard() {
        use TrafficLightColour::{Green, Red, Yellow};
        let options = AgentOptions::default();
        let at_50_kmh = |colour, gap_m| stops(colour, gap_m, 13.9, options);
        assert_eq!([Green, Yellow, Red].map(|colour| at_50_kmh(colour, 22.0)), [false, true, true]);
        assert_eq!([Yellow, Red].map(|colour| at_50_kmh(colour, 12.0)), [false, true]);
        assert!(stops(Yellow, 3.0, 5.0, options) && !stops(Yellow, 2.0, 5.0, options));
        let ignores = AgentOptions { ignore_lights: true, ..options };
        assert!(!stops(Yellow, 22.0, 13.9, ignores));
    }

    #[test]
    fn a_line_beyond_a_junction_is_no_reason_to_enter_it_unasked() {
        let stop_m = ENTRY_M - FRONT_M - BEFORE_LINE_M;
        for (held_m, wanted_m) in [
            (ENTRY_M + 20.0, stop_m),
            (ENTRY_M + INSIDE_M - 0.1, f32::INFINITY),
            (ENTRY_M - 3.0, f32::INFINITY),
        ] {
            let lines = Lines { held_m: Some(held_m), ..FREE };
            let (free_m, _) = before_a_junction(&lines, 0.0);
            let alike = free_m == wanted_m || (free_m - wanted_m).abs() < 0.01;
            assert!(alike, "{held_m} m: {free_m} m of {wanted_m}");
        }
    }

    #[test]
    fn who_lets_people_over_claims_no_junction_behind_their_crossing() {
        assert_eq!(before_a_junction(&FREE, 4.0), (f32::INFINITY, true));
        let lines = Lines { people_m: Some(ENTRY_M - 4.0), ..FREE };
        let (free_m, claims) = before_a_junction(&lines, 4.0);
        assert!(!claims && (free_m - (ENTRY_M - 4.0 - FRONT_M - BEFORE_LINE_M)).abs() < 0.01);
    }
}
