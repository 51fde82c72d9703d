//! Which rules hold for a vehicle where it is.

use nalgebra::Vector3;
use roads::{LaneTypes, Map};
use schemas::{ActorId, Pose};
use serde::{Deserialize, Serialize};

use super::TrafficPlan;
use crate::overlap::OrientedBox;

/// What lights and signs say to one vehicle. Stays as it is while the vehicle sleeps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoadRules {
    /// 0 where none is posted.
    pub speed_limit_mps: f32,
    /// The light in whose box it is.
    pub light: Option<ActorId>,
}

impl RoadRules {
    /// Looks around anew.
    ///
    /// - **Cost:** logarithmic in the size of the map; a microsecond or two.
    pub(crate) fn update(
        &mut self,
        map: &Map,
        plan: &TrafficPlan,
        world_from_vehicle: &Pose,
        vehicle: &OrientedBox,
        near: &mut Vec<u32>,
    ) {
        self.light = plan.light_at(vehicle, near).and_then(|light| plan.light_id(light));
        let position_m: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let Some(place) = map.nearest(position_m.into(), LaneTypes::DRIVING) else { return };
        // Ways cross in a junction, and the nearest may be another's: the limit of before holds on.
        if self.speed_limit_mps == 0.0 || !map.lane(&place).is_junction {
            self.speed_limit_mps = map.speed_limit_mps(&place).unwrap_or(0.0) as f32;
        }
    }
}
