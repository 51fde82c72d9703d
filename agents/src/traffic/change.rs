//! Whether another lane is better: MOBIL over the lanes beside.

use super::manner::Manner;
use super::{SPACING_M, room};
use crate::beside::{ROOM_M, SAFE_MPS2, neighbours};
use crate::junction::Claims;
use crate::network::{Beside, LaneId, Network};
use crate::path::{Leg, Path, PathPoint};
use crate::scene::Ahead;
use crate::senses::Senses;
use crate::wander::LANES_MAX;

/// How often a driver thinks about it.
pub(super) const THINK_SECS: f32 = 1.0;
/// A change takes this long, and at least this way.
const CHANGE_SECS: f32 = 3.5;
const CHANGE_M_MIN: f32 = 18.0;
/// Slower than this nobody changes.
const SPEED_MPS_MIN: f32 = 3.0;
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
    let (_, lane) = path.own(network)?;
    let needed_m = (CHANGE_SECS * speed_mps).max(CHANGE_M_MIN);
    if at_m < beside.from_m || at_m + needed_m > beside.to_m.min(lane.length_m()) {
        return None;
    }
    let mut new = path.aside(network, beside.lane, needed_m)?;
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
    let there = new.changed(senses.network, 0)?;
    there.sample(senses.network, manner.horizon_m(asked.speed_mps), SPACING_M, &mut points);
    let ahead = senses.scene.ahead(&points, &room(senses));
    let free = manner.free(asked.speed_mps, asked.free_mps);
    let then_mps2 = match &ahead {
        Some(ahead) if ahead.gap_m < ROOM_M => return None,
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
    let target = new.beside_point(senses.network, 0)?;
    let along = target.heading();
    // The side of the target lane that is away from the own vehicle.
    let own = target.point_m - senses.body.centre_m;
    let to_left = along.x * own.y - along.y * own.x > 0.0;
    let mut worst_mps2: f32 = 0.0;
    let mut safe = true;
    neighbours(senses.scene, senses.body, &target, |other| {
        // Whoever already changes to the same lane from the one beyond has it, whoever is abreast
        // there may want to.
        let comes = || claims.is_changing(other.id, !to_left);
        if other.is_beyond(to_left) && (other.is_abreast() || comes()) {
            safe = false;
        }
        if !other.is_behind() {
            return;
        }
        safe &= other.has_room(speed_mps);
        let free_mps = other.along_mps.max(5.0) * 1.2;
        let their = manner.behind(other.along_mps, free_mps, (other.gap_m(), speed_mps));
        worst_mps2 = worst_mps2.max(-their);
    });
    safe.then_some(worst_mps2.max(0.0))
}

#[cfg(test)]
mod tests;
