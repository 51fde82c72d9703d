//! Which rules hold for a vehicle where it is.

use nalgebra::Vector3;
use roads::{LaneTypes, Map};
use schemas::{ActorId, Pose};
use serde::{Deserialize, Serialize};

use super::TrafficPlan;
use crate::overlap::OrientedBox;

/// How long a stop sign holds who comes to it, in seconds. **Source:** CARLA's server.
const STOP_SECS: f32 = 2.0;

/// What lights and signs say to one vehicle. Stays as it is while the vehicle sleeps and none
/// holds it for a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct RoadRules {
    /// 0 where none is posted.
    pub speed_limit_mps: f32,
    /// The light in whose box it is.
    light: Option<ActorId>,
    /// The stop sign in whose box it is.
    stop: Option<ActorId>,
    /// For how long that will hold it.
    stop_secs: f32,
}

impl RoadRules {
    /// The light in whose box it is, or the stop sign that holds it.
    pub(crate) fn holder(&self) -> Option<ActorId> {
        self.light.or(self.stop.filter(|_| self.is_held_for_a_time()))
    }

    pub(crate) fn is_held_for_a_time(&self) -> bool {
        self.stop_secs > 0.0
    }

    /// Looks around anew, `dt_secs` after the last time. Ids of lights and signs begin at the
    /// first actor's.
    ///
    /// - **Cost:** logarithmic in the size of the map; a microsecond or two.
    pub(crate) fn update(
        &mut self,
        map: &Map,
        (plan, first_actor): (&TrafficPlan, ActorId),
        world_from_vehicle: &Pose,
        vehicle: &OrientedBox,
        near: &mut Vec<u32>,
        dt_secs: f64,
    ) {
        let holder = plan.holder_at(vehicle, near);
        let id_of = |position: usize| first_actor.plus(position as u32);
        self.light = holder.filter(|position| *position < plan.light_count()).map(id_of);
        let stop = holder.map(id_of).filter(|_| self.light.is_none());
        self.stop_secs = if stop == self.stop {
            (self.stop_secs - dt_secs as f32).max(0.0)
        } else {
            stop.map_or(0.0, |_| STOP_SECS)
        };
        self.stop = stop;
        let position_m: Vector3<f64> = nalgebra::convert(world_from_vehicle.translation.vector);
        let Some(place) = map.nearest(position_m.into(), LaneTypes::DRIVING) else { return };
        // Ways cross in a junction, and the nearest may be another's: the limit of before holds on.
        if self.speed_limit_mps == 0.0 || !map.lane(&place).is_junction {
            self.speed_limit_mps = map.speed_limit_mps(&place).unwrap_or(0.0) as f32;
        }
    }
}
