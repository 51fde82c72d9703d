//! Whether somebody who asks nobody drives into a junction before those who go first there.

use schemas::TrafficLightColour::{Red, Yellow};

use super::{CLEAR_M, Claims, GAP_SECS, Hold, Wish};
use crate::network::{Lane, LaneId, Network, Stop};
use crate::scene::{Body, Scene};

/// Slower than this nobody takes anything from others.
const MOVING_MPS: f32 = 1.0;
/// Lanes of a junction count from their entry on for so far.
const ENTERED_M: f32 = 8.0;
/// Ways through a junction that turn by more than this turn off.
const TURN_RAD: f32 = 0.6;
/// Lines so far before a junction, or so far inside, say who yields there.
const LINE_BEFORE_M: f32 = 12.0;
const LINE_INSIDE_M: f32 = 4.0;

/// What a vehicle that asks nobody does at a junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entering {
    /// It is not at the entry of one.
    No,
    /// It stands there, or may be on several ways of which only some are others'.
    Unclear,
    /// It drives into one, and nobody who goes first comes soon.
    Free,
    /// It drives into one before somebody who goes first and comes soon.
    Taking,
}

impl Claims {
    /// Whether a vehicle drives into a junction, and before whom. Where its way is not clear yet,
    /// it takes nothing that it would not take on all ways that it may be on. Lights that do not
    /// show green are not judged here.
    pub fn entering(&self, network: &Network, scene: &Scene, body: &Body) -> Entering {
        let front_m = body.centre_m + body.forward * body.half_m.x;
        let is_early = |(lane, at_m): &(LaneId, f32)| {
            let inside_m = network.lane(*lane).map(|lane| lane.entered.before_m + at_m);
            inside_m.is_some_and(|inside_m| (0.1..ENTERED_M).contains(&inside_m))
        };
        let inside = network.inside(&front_m, &body.forward).filter(is_early);
        let lanes: Vec<LaneId> = inside.map(|(lane, _)| lane).collect();
        if lanes.is_empty() {
            return Entering::No;
        }
        if body.velocity_mps.dot(&body.forward) < MOVING_MPS {
            return Entering::Unclear;
        }
        let taken = lanes.iter().filter(|lane| self.is_taken(network, scene, **lane, body)).count();
        match taken {
            0 => Entering::Free,
            all if all == lanes.len() => Entering::Taking,
            _ => Entering::Unclear,
        }
    }

    /// Whether somebody who goes before whoever is on a way of a junction comes soon.
    fn is_taken(&self, network: &Network, scene: &Scene, on: LaneId, body: &Body) -> bool {
        let entry = |lane: LaneId| network.lane(network.lane(lane)?.entered.lane);
        let Some(own) = entry(on) else { return false };
        let ways: Vec<LaneId> = network.through(own.entered.lane).collect();
        let own_yields = yields(network, own);
        let stopped = |line: Stop| match line {
            Stop::Light(light) => matches!(scene.light(light), Red | Yellow),
            _ => false,
        };
        if at_entry(network, own, stopped) {
            return false;
        }
        // Where on another's lane the way is left behind.
        let left_m = |lane: LaneId| {
            let other = network.lane(lane)?;
            let met = ways.iter().filter_map(|way| other.conflict(*way));
            met.map(|conflict| conflict.until_m).max_by(f32::total_cmp)
        };
        let first = |lane: LaneId| {
            entry(lane).is_some_and(|other| goes_first(network, other, (own, own_yields)))
        };
        let Some(told) = self.told(network, on) else { return false };
        let wished = told.wishes.iter().any(|Wish { lane, asker }| {
            let soon = asker.id != body.id && asker.eta_secs < GAP_SECS;
            soon && left_m(*lane).is_some() && first(*lane)
        });
        let held = |hold: &Hold| {
            let soon = hold.id != body.id && hold.eta_secs < GAP_SECS;
            let meets = || left_m(hold.lane).is_some_and(|left_m| hold.rear_m < left_m + CLEAR_M);
            soon && meets() && first(hold.lane)
        };
        wished || told.held.iter().any(held)
    }
}

/// Whether a way through a junction goes before another one: who has no sign, of equals who comes
/// from the right, and oncoming traffic before who turns left; where traffic keeps to the left, who
/// comes from the left, and oncoming traffic before who turns right.
fn goes_first(network: &Network, other: &Lane, (own, own_yields): (&Lane, bool)) -> bool {
    match (yields(network, other), own_yields) {
        (false, true) => true,
        (true, false) => false,
        _ => {
            let crosses = |lane: &Lane| network.across_rad(lane.entered.lane) > TURN_RAD;
            let passes = other.is_oncoming(own) && crosses(own) && !crosses(other);
            other.is_from_first_side_of(own) || passes
        }
    }
}

/// Whether a sign or a roundabout lets others through first.
fn yields(network: &Network, lane: &Lane) -> bool {
    let signed = |line: Stop| matches!(line, Stop::Sign | Stop::Yield);
    lane.enters_ring || at_entry(network, lane, signed)
}

/// Whether such a line holds traffic at the entry of a way through a junction.
fn at_entry(network: &Network, lane: &Lane, is_such: impl Fn(Stop) -> bool) -> bool {
    let inside = lane.stops.iter().any(|line| line.at_m < LINE_INSIDE_M && is_such(line.why));
    let before = lane.previous.iter().filter_map(|id| network.lane(*id)).any(|before| {
        let from_m = before.length_m() - LINE_BEFORE_M;
        before.stops.iter().any(|line| line.at_m > from_m && is_such(line.why))
    });
    inside || before
}
