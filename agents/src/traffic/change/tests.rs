//! A driver on a ring of three lanes, so wide that it is nearly straight, and others about him.

use nalgebra::ComplexField;
use schemas::{ActorId, AgentBehaviour, Vec3, level_pose};

use super::*;
use crate::scene::Scene;
use crate::{Body, VehicleView};

const RADIUS_M: f32 = 2_000.0;

/// Of a quarter of the ring.
const LENGTH_M: f32 = std::f32::consts::FRAC_PI_2 * RADIUS_M;

/// A quarter of the ring, driven to the left; the lanes are 1, 2 and 3 from the inside.
fn quarter(index: u32, lanes: &str) -> String {
    let heading_rad = std::f32::consts::FRAC_PI_2 * index as f32;
    let (sin, cos) = (ComplexField::sin(heading_rad), ComplexField::cos(heading_rad));
    let (x_m, y_m) = (RADIUS_M * sin, -RADIUS_M * cos);
    let (before, after) = ((index + 3) % 4, (index + 1) % 4);
    let (length_m, curvature) = (LENGTH_M, 1.0 / RADIUS_M);
    format!(
        r#"<road name="quarter" length="{length_m}" id="{index}" junction="-1">
    <link><predecessor elementType="road" elementId="{before}" contactPoint="end"/>
      <successor elementType="road" elementId="{after}" contactPoint="start"/></link>
    <planView><geometry s="0" x="{x_m}" y="{y_m}" hdg="{heading_rad}" length="{length_m}">
      <arc curvature="{curvature}"/></geometry></planView>
    <lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/></center>
      <right>{lanes}</right></laneSection></lanes>
  </road>"#
    )
}

/// `ending` lanes lead nowhere.
fn network(ending: &[u32]) -> Network {
    let lane = |id: u32| {
        let link = format!(r#"<link><predecessor id="-{id}"/><successor id="-{id}"/></link>"#);
        let link = if ending.contains(&id) { String::new() } else { link };
        format!(
            r#"<lane id="-{id}" type="driving" level="false">{link}
        <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
        <roadMark sOffset="0" type="broken" width="0.15" laneChange="both"/></lane>"#
        )
    };
    let lanes: String = (1..=3).map(lane).collect();
    let text = format!(
        r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="ring" version="1" north="0" south="0" east="0" west="0"/>
  {}
</OpenDRIVE>"#,
        (0..4).map(|index| quarter(index, &lanes)).collect::<String>()
    );
    Network::new(&roads::Map::parse("ring", &text).unwrap())
}

/// A car some way along a lane.
fn body(id: u32, at_m: f32, lane: u32, mps: f32) -> Body {
    let turn_rad = at_m / RADIUS_M;
    let (sin, cos) = (ComplexField::sin(turn_rad), ComplexField::cos(turn_rad));
    let radius_m = RADIUS_M + 3.5 * lane as f32 - 1.75;
    let forward = Vec3::new(cos, sin, 0.0);
    Body {
        id: ActorId::new(id).unwrap(),
        is_walker: false,
        is_urgent: false,
        centre_m: Vec3::new(radius_m * sin, -radius_m * cos, 0.7),
        forward,
        half_m: Vec3::new(2.4, 0.95, 0.7),
        velocity_mps: forward * mps,
    }
}

/// A driver at 15 m/s, 300 m along his lane, who could drive at 25 m/s.
struct Case {
    lane: u32,
    at_m: f32,
    speed_mps: f32,
    free_mps: f32,
    present_mps2: f32,
    behaviour: AgentBehaviour,
    ending: &'static [u32],
    others: Vec<Body>,
    /// Who changes to the left, or to the right.
    changing: Option<(u32, bool)>,
}

impl Case {
    /// Behind a slow vehicle.
    fn new(lane: u32) -> Self {
        Self {
            lane,
            at_m: 300.0,
            speed_mps: 15.0,
            free_mps: 25.0,
            present_mps2: -1.0,
            behaviour: AgentBehaviour::Normal,
            ending: &[],
            others: vec![body(2, 330.0, lane, 8.0)],
            changing: None,
        }
    }

    fn with(mut self, other: Body) -> Self {
        self.others.push(other);
        self
    }

    /// Whether he changes, and then whether to the left.
    fn decides(&self) -> Option<bool> {
        let network = network(self.ending);
        let own = body(1, self.at_m, self.lane, self.speed_mps);
        let mut bodies = vec![own];
        bodies.extend_from_slice(&self.others);
        let scene = Scene::new(bodies, Vec::new());
        let heading_rad = self.at_m / RADIUS_M;
        let view = VehicleView::of_car(level_pose(own.centre_m, heading_rad), own.velocity_mps);
        let senses =
            Senses { network: &network, scene: &scene, view: &view, body: &own, dt_secs: 0.05 };
        let place = network.along(&own.centre_m, heading_rad, 1.7).unwrap().place;
        let to_m = network.lane(place.lane).unwrap().length_m();
        let mut path = Path::default();
        path.push(Leg { lane: place.lane, from_m: place.at_m, to_m, onto: None });
        let mut claims = Claims::default();
        if let Some((id, to_left)) = self.changing {
            claims.change(ActorId::new(id).unwrap(), to_left);
        }
        let mut points = Vec::new();
        path.sample(&network, 100.0, SPACING_M, &mut points);
        let asked = Asked {
            speed_mps: self.speed_mps,
            free_mps: self.free_mps,
            present_mps2: self.present_mps2,
            ahead: scene.ahead(&points, &room(&senses)),
        };
        let new = better(&senses, &claims, &Manner::of(self.behaviour, 1.0), &path, &asked)?;
        new.changes_to_left(&network)
    }
}

#[test]
fn who_is_held_up_takes_the_free_lane_and_the_better_of_two() {
    assert_eq!(Case::new(3).decides(), Some(true));
    assert_eq!(Case::new(1).decides(), Some(false));
    let slow = |lane| body(3, 360.0, lane, 11.0);
    assert_eq!(Case::new(2).with(slow(1)).decides(), Some(false));
    assert_eq!(Case::new(2).with(slow(3)).decides(), Some(true));
}

#[test]
fn nobody_changes_without_a_reason() {
    let at = |case: Case| case.decides();
    assert_eq!(at(Case { present_mps2: 0.6, ..Case::new(3) }), None, "speeds up as it is");
    assert_eq!(at(Case { others: Vec::new(), ..Case::new(3) }), None, "nobody ahead");
    assert_eq!(at(Case { speed_mps: 2.0, ..Case::new(3) }), None, "nearly stands");
    let hardly = Case { present_mps2: 0.45, free_mps: 16.5, ..Case::new(3) };
    assert_eq!(hardly.decides(), None, "gains too little");
}

#[test]
fn nobody_changes_to_where_he_would_brake_hard_or_others_would() {
    // Braking with 8 m/s² as it is, the other lane would be better and is too slow all the same.
    let ahead = Case { present_mps2: -8.0, ..Case::new(3) }.with(body(3, 323.0, 2, 12.0));
    assert_eq!(ahead.decides(), None);
    for (at_m, mps) in [(285.0, 23.0), (300.0, 15.0), (268.0, 27.0)] {
        for behaviour in [AgentBehaviour::Normal, AgentBehaviour::Aggressive] {
            let case = Case { behaviour, ..Case::new(3) }.with(body(3, at_m, 2, mps));
            assert_eq!(case.decides(), None, "{behaviour:?}, {at_m} m, {mps} m/s");
        }
    }
    assert_eq!(Case::new(3).with(body(3, 255.0, 2, 16.0)).decides(), Some(true));
}

#[test]
fn the_polite_one_counts_what_others_lose() {
    let behind = body(3, 300.0 - 4.8 - 15.5, 2, 15.0);
    let case = |behaviour| {
        let case = Case { present_mps2: 0.49, behaviour, ..Case::new(3) };
        case.with(behind).decides()
    };
    assert_eq!(case(AgentBehaviour::Normal), None);
    assert_eq!(case(AgentBehaviour::Aggressive), Some(true));
}

#[test]
fn a_lane_that_ends_is_left_without_other_reasons_and_never_taken() {
    let on_it = Case { ending: &[3], present_mps2: 1.5, others: Vec::new(), ..Case::new(3) };
    assert_eq!(on_it.decides(), Some(true));
    let stays = Case { ending: &[3], ..Case::new(2) }.with(body(3, 300.0, 1, 15.0));
    assert_eq!(stays.decides(), None);
}

#[test]
fn nobody_begins_a_change_that_the_lane_is_too_short_for() {
    for (left_m, changes) in [(40.0, None), (80.0, Some(true))] {
        let at_m = LENGTH_M - left_m;
        let others = vec![body(2, at_m + 30.0, 3, 8.0)];
        assert_eq!(Case { at_m, others, ..Case::new(3) }.decides(), changes, "{left_m} m");
    }
}

#[test]
fn nobody_changes_to_the_lane_that_somebody_on_its_other_side_changes_to() {
    let fast = || Case::new(3).with(body(3, 275.0, 1, 23.0));
    assert_eq!(fast().decides(), Some(true));
    assert_eq!(Case { changing: Some((3, true)), ..fast() }.decides(), Some(true));
    assert_eq!(Case { changing: Some((3, false)), ..fast() }.decides(), None);
    let abreast = Case::new(3).with(body(3, 302.0, 1, 15.0));
    assert_eq!(abreast.decides(), None, "he may want to as well");
}
