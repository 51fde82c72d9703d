//! Whether another lane is better: MOBIL over the lanes beside.

use nalgebra::RealField;

use super::claims::Claims;
use super::manner::Manner;
use super::{LANES_MAX, SPACING_M, room};
use crate::agent::Senses;
use crate::network::{Beside, LaneId, Network, wrapped};
use crate::path::{Leg, Path, PathPoint, heading};
use crate::scene::{Ahead, Body};

/// How often a driver thinks about it.
pub(super) const THINK_SECS: f32 = 1.0;
/// A change takes this long, and at least this way.
const CHANGE_SECS: f32 = 3.5;
const CHANGE_M_MIN: f32 = 18.0;
/// Slower than this nobody changes.
const SPEED_MPS_MIN: f32 = 3.0;
/// Whoever is behind on the other lane must not have to brake harder.
const SAFE_MPS2: f32 = 2.0;
/// Standing room to those behind on the other lane, and time at their speed.
const BEHIND_M: f32 = 3.0;
const BEHIND_SECS: f32 = 0.8;
/// How far back somebody counts.
const BACK_M: f32 = 50.0;
/// Middles of vehicles on one lane, and on the next, are nearer than this to its middle.
const LANE_M: f32 = 1.8;
const LANES_M: f32 = 5.5;
/// Room to vehicles on the lane beyond.
const BEYOND_M: f32 = 4.0;
/// What leaving a lane that ends is worth.
const DEAD_END_MPS2: f32 = 3.0;

/// What a driver would do on its lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    pub speed_mps: f32,
    pub free_mps: f32,
    pub present_mps2: f32,
    pub ahead: Option<Ahead>,
}

/// The way over a better lane, if there is one that can be changed to safely.
pub(super) fn better(
    senses: &Senses<'_>,
    claims: &Claims,
    manner: &Manner,
    path: &Path,
    asked: &Asked,
) -> Option<Path> {
    let network = senses.network;
    let here = path.place(network)?;
    if path.is_changing() || asked.speed_mps < SPEED_MPS_MIN {
        return None;
    }
    let lane = network.lane(here.lane)?;
    let bored = asked.ahead.is_some() && asked.present_mps2 < 0.5;
    if !bored && lane.goes_on {
        return None;
    }
    let sides = [lane.left, lane.right].into_iter().flatten();
    let gains = sides.filter_map(|beside| {
        let must = match (lane.goes_on, network.lane(beside.lane)?.goes_on) {
            (true, false) => return None,
            (false, true) => DEAD_END_MPS2,
            _ => 0.0,
        };
        let new = over(network, path, here.at_m, asked.speed_mps, &beside)?;
        let gain_mps2 = gain(senses, claims, manner, &new, asked)? + must;
        (gain_mps2 > manner.gain_mps2).then_some((gain_mps2, new))
    });
    gains.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, new)| new)
}

/// The way that changes to a lane beside and goes on there.
fn over(
    network: &Network,
    path: &Path,
    at_m: f32,
    speed_mps: f32,
    beside: &Beside,
) -> Option<Path> {
    let (own_id, lane) = path.own(network)?;
    let needed_m = (CHANGE_SECS * speed_mps).max(CHANGE_M_MIN);
    if at_m < beside.from_m || at_m + needed_m > beside.to_m.min(lane.length_m()) {
        return None;
    }
    let target = network.lane(beside.lane)?;
    let to_m = at_m + needed_m;
    let mut new = Path::default();
    new.push(Leg { lane: own_id, from_m: at_m, to_m, onto: Some(beside.lane) });
    let from_m = lane.abreast_m(to_m, target);
    new.push(Leg { lane: beside.lane, from_m, to_m: target.length_m(), onto: None });
    // As far as the old way reached, by the first of the ways on: the driver draws none here.
    for _ in 0..LANES_MAX {
        let last: LaneId = new.last()?.last_lane();
        if new.length_m() >= path.length_m() {
            break;
        }
        let mut next = network.lane(last)?.next.iter().copied();
        let Some(next) = next.find(|id| network.lane(*id).is_some_and(|lane| lane.goes_on)) else {
            break;
        };
        let to_m = network.lane(next)?.length_m();
        new.push(Leg { lane: next, from_m: 0.0, to_m, onto: None });
    }
    Some(new)
}

/// What a change gains: own acceleration, less the loss of those behind; `None` if it is unsafe.
fn gain(
    senses: &Senses<'_>,
    claims: &Claims,
    manner: &Manner,
    new: &Path,
    asked: &Asked,
) -> Option<f32> {
    let mut points: Vec<PathPoint> = Vec::new();
    let there = new.changed(senses.network)?;
    there.sample(senses.network, manner.horizon_m(asked.speed_mps), SPACING_M, &mut points);
    let ahead = senses.scene.ahead(&points, &room(senses));
    let free = manner.free(asked.speed_mps, asked.free_mps);
    let then_mps2 = match &ahead {
        Some(ahead) if ahead.gap_m < BEHIND_M => return None,
        Some(ahead) => free.min(manner.behind(asked.speed_mps, asked.free_mps, ahead.leader())),
        None => free,
    };
    if then_mps2 < -SAFE_MPS2 {
        return None;
    }
    let loss_mps2 = loss(senses, claims, manner, new, asked.speed_mps)?;
    Some(then_mps2 - asked.present_mps2 - manner.politeness * loss_mps2)
}

/// How much those behind on the new lane would have to slow down; `None` if too much.
fn loss(
    senses: &Senses<'_>,
    claims: &Claims,
    manner: &Manner,
    new: &Path,
    speed_mps: f32,
) -> Option<f32> {
    let middle_m = senses.body.centre_m;
    let target = new.beside_point(senses.network)?;
    let along = heading(&target);
    // The side of the target lane that is away from the own vehicle.
    let own = target.point_m - middle_m;
    let toward = along.x * own.y - along.y * own.x;
    let mut worst_mps2: f32 = 0.0;
    let mut safe = true;
    senses.scene.near(&middle_m, BACK_M, |body: &Body| {
        if body.id == senses.body.id || body.is_walker {
            return;
        }
        let away = body.centre_m - target.point_m;
        let back_m = -away.dot(&along);
        let side = along.x * away.y - along.y * away.x;
        let beside_m = side.abs();
        let body_rad = RealField::atan2(body.forward.y, body.forward.x);
        let turned = wrapped(body_rad - target.heading_rad).abs() > 0.8;
        let reach_m = senses.body.half_m.x + body.half_m.x;
        if turned {
            return;
        }
        // Whoever already changes to the same lane from the one beyond has it, whoever is abreast
        // there may want to.
        let beyond = (LANE_M..LANES_M).contains(&beside_m) && side * toward > 0.0;
        let comes = || claims.is_changing(body.id, toward < 0.0);
        let abreast = back_m.abs() < reach_m + BEYOND_M;
        if beyond && (abreast || comes()) {
            safe = false;
        }
        if back_m > BACK_M || beside_m > LANE_M || back_m < -reach_m {
            return;
        }
        let gap_m = back_m - reach_m;
        let their_mps = along.dot(&body.velocity_mps).max(0.0);
        let closing_mps = (their_mps - speed_mps).max(0.0);
        let needed_mps2 = closing_mps * closing_mps / (2.0 * gap_m.max(0.1));
        if gap_m < BEHIND_M + BEHIND_SECS * their_mps || needed_mps2 > SAFE_MPS2 {
            safe = false;
        }
        let their = manner.behind(their_mps, their_mps.max(5.0) * 1.2, (gap_m, speed_mps));
        worst_mps2 = worst_mps2.max(-their);
    });
    safe.then_some(worst_mps2.max(0.0))
}

#[cfg(test)]
mod tests;
