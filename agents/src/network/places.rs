//! Which places on lanes a vehicle or a point means.

use roads::{LaneTypes, Map};
use schemas::{Pose, Vec3, yaw_rad};

use super::{Network, Place};

/// A vehicle's lane is at most this far from it.
const LANE_M: f32 = 5.0;
/// Half a lane's width, beyond which lanes lie side by side.
const SAME_M: f32 = 1.0;

impl Network {
    /// The lane that a vehicle is on and looks along; else the nearest one.
    pub(crate) fn vehicle_place(&self, map: &Map, world_from_vehicle: &Pose) -> Option<Place> {
        let position_m = world_from_vehicle.translation.vector;
        let along = self.along(&position_m, yaw_rad(world_from_vehicle), LANE_M);
        along.map(|near| near.place).or_else(|| self.nearest_place(map, &position_m))
    }

    /// Places on lanes that a point may mean: the nearest, and those hardly farther away.
    pub(crate) fn point_places(&self, map: &Map, point_m: &Vec3) -> Vec<Place> {
        let near = self.near(point_m, LANE_M);
        let least_m = near.iter().map(|near| near.away_m).fold(f32::INFINITY, f32::min);
        let same = near.iter().filter(|near| near.away_m < least_m + SAME_M);
        let places: Vec<Place> = same.map(|near| near.place).collect();
        if places.is_empty() {
            self.nearest_place(map, point_m).into_iter().collect()
        } else {
            places
        }
    }

    /// Where a point is on the map's own lanes, for points far from every lane's middle.
    fn nearest_place(&self, map: &Map, point_m: &Vec3) -> Option<Place> {
        let point: nalgebra::Vector3<f64> = nalgebra::convert(*point_m);
        self.place(&map.nearest(point.into(), LaneTypes::DRIVING)?)
    }
}
