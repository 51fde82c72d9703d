//! Where vehicles may start.

use nalgebra::{Isometry3, Vector3};

use crate::kinds::LaneType;
use crate::lanes::{LaneTable, lane_pose, parts};
use crate::limits;
use crate::model::Model;

/// Room kept free before and behind a spawn point within its lane, in metres.
const END_GAP_M: f64 = 10.0;
/// Distance between spawn points of one lane, in metres, at least.
const SPACING_M: f64 = 25.0;
/// Narrower lanes take no vehicle.
const WIDTH_MIN_M: f64 = 2.4;
/// Height of a spawn point above the ground, in metres.
const HEIGHT_M: f64 = 0.5;

/// Spreads spawn points over all driving lanes outside junctions.
pub(crate) fn spawn_points(model: &Model, table: &LaneTable) -> Vec<Isometry3<f64>> {
    let mut points = Vec::new();
    for entry in &table.lanes {
        let Some((road, section, lane)) = parts(model, entry) else { continue };
        let usable_m = entry.length_m() - 2.0 * END_GAP_M;
        if lane.lane_type != LaneType::Driving || road.junction.is_some() || usable_m < 0.0 {
            continue;
        }
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a lane is shorter than a million metres"
        )]
        let gaps = (usable_m / SPACING_M).floor() as usize;
        for index in 0..=gaps {
            let share = if gaps == 0 { 0.5 } else { index as f64 / gaps as f64 };
            let s = entry.start_s + END_GAP_M + usable_m * share;
            if lane.width.value(s) < WIDTH_MIN_M {
                continue;
            }
            let mut pose = lane_pose(road, section, lane.id, s).isometry();
            pose.translation.vector += Vector3::z() * HEIGHT_M;
            if points.len() == limits::SPAWN_POINTS_MAX {
                return points;
            }
            points.push(pose);
        }
    }
    points
}
