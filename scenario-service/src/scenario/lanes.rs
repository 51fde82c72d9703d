//! The questions about lanes that scenarios and observations ask of a map.

use roads::{LaneType, LaneTypes, Map, Waypoint};
use schemas::{Pose, Translation3, Vec3};

use super::decision::Side;

/// A place on a driving lane.
pub(crate) type Place = Waypoint;

/// A map seen as driving lanes.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<'m> {
    map: &'m Map,
}

/// Lanes of one direction are not more than this many beside each other.
const LANES_ABREAST_MAX: u32 = 32;

impl<'m> Lanes<'m> {
    /// The driving lanes of a map.
    pub(crate) fn new(map: &'m Map) -> Self {
        Self { map }
    }

    /// The driving lane below each of the map's spread places.
    pub(crate) fn spawn_places(self) -> impl Iterator<Item = Place> + 'm {
        let map = self.map;
        let driving = LaneTypes::DRIVING;
        map.spread_places()
            .iter()
            .filter_map(move |pose| map.nearest(pose.translation.vector.into(), driving))
    }

    /// Middle of the lane, x along its traffic, y left, z up.
    pub(crate) fn pose(self, place: Place) -> Pose {
        self.map.pose(&place).cast()
    }

    /// Direction of traffic, counter-clockwise from x.
    pub(crate) fn heading_rad(self, place: Place) -> f64 {
        self.map.lane_pose(&place).map_or(0.0, |pose| pose.heading_rad)
    }

    /// The place this far along the lane; the straightest of several ways at a junction.
    pub(crate) fn ahead(self, place: Place, distance_m: f64) -> Option<Place> {
        let turn = |there: &Place| self.turn_rad(place, *there).abs();
        let ways = self.map.next(&place, distance_m);
        ways.into_iter().min_by(|a, b| turn(a).total_cmp(&turn(b)))
    }

    /// The place this far back along the lane; the straightest of several ways at a junction.
    pub(crate) fn behind(self, place: Place, distance_m: f64) -> Option<Place> {
        let turn = |there: &Place| self.turn_rad(place, *there).abs();
        let ways = self.map.previous(&place, distance_m);
        ways.into_iter().min_by(|a, b| turn(a).total_cmp(&turn(b)))
    }

    /// How much the lane's direction differs between two places, from -π to π, positive to the
    /// left.
    pub(crate) fn turn_rad(self, from: Place, to: Place) -> f64 {
        let turn = self.heading_rad(to) - self.heading_rad(from);
        turn.sin().atan2(turn.cos())
    }

    /// The lane to a side of the traffic here, of whatever type and direction.
    pub(crate) fn beside(self, place: Place, side: Side) -> Option<Place> {
        match side {
            Side::Left => self.map.left(&place),
            Side::Right => self.map.right(&place),
        }
    }

    /// What the lane is for.
    pub(crate) fn lane_type(self, place: Place) -> LaneType {
        self.map.lane(&place).lane_type
    }

    /// How wide the lane is here, in metres.
    pub(crate) fn width_m(self, place: Place) -> f64 {
        self.map.lane(&place).width_m
    }

    /// `None` where none is posted.
    pub(crate) fn speed_limit_mps(self, place: Place) -> Option<f64> {
        self.map.speed_limit_mps(&place).filter(|mps| *mps > 0.0)
    }

    /// All places this far ahead, one for every way the lane goes.
    pub(crate) fn ways_ahead(self, place: Place, distance_m: f64) -> Vec<Place> {
        self.map.next(&place, distance_m)
    }

    /// The driving lane of the same direction to the left.
    pub(crate) fn left(self, place: Place) -> Option<Place> {
        self.map.left_driving(&place)
    }

    /// The driving lane of the same direction to the right.
    pub(crate) fn right(self, place: Place) -> Option<Place> {
        self.map.right_driving(&place)
    }

    /// The driving lane a point is on; `None` beside the road.
    pub(crate) fn under(self, point_m: Vec3) -> Option<Place> {
        let point_m = point_m.cast::<f64>();
        let place = self.map.nearest(point_m.into(), LaneTypes::DRIVING)?;
        let offset_m = self.map.pose(&place).inverse() * Translation3::from(point_m);
        let offset_m = offset_m.translation.vector;
        let half_width_m = self.map.lane(&place).width_m / 2.0;
        (offset_m.y.abs() <= half_width_m && offset_m.x.abs() <= ALONG_M_MAX).then_some(place)
    }

    /// Number of a lane among those of its direction, from 0 at the left.
    pub(crate) fn number(self, place: Place) -> u32 {
        let mut number = 0;
        let mut place = place;
        while let Some(left) = self.map.left_driving(&place).filter(|_| number < LANES_ABREAST_MAX)
        {
            place = left;
            number += 1;
        }
        number
    }

    /// How many lanes of one direction lie beside each other here.
    pub(crate) fn abreast_count(self, place: Place) -> u32 {
        let mut count = self.number(place) + 1;
        let mut place = place;
        while let Some(right) = self.map.right_driving(&place).filter(|_| count < LANES_ABREAST_MAX)
        {
            place = right;
            count += 1;
        }
        count
    }
}

/// How far past the end of a lane a point may lie and still be on it; the map's own projection is
/// off along curves by some decimetres.
const ALONG_M_MAX: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing;

    #[test]
    fn lanes_are_numbered_from_the_left_of_their_own_direction() {
        let map = testing::map();
        let lanes = Lanes::new(&map);
        let mut pairs = 0;
        for place in lanes.spawn_places() {
            let number = lanes.number(place);
            assert_eq!(lanes.left(place).is_some(), number > 0);
            if let Some(right) = lanes.right(place) {
                assert_eq!(lanes.number(right), number + 1);
                assert_eq!(lanes.abreast_count(right), lanes.abreast_count(place));
                pairs += 1;
            }
        }
        assert!(pairs > 10, "{pairs}");
    }

    #[test]
    fn the_middle_of_a_lane_is_on_it_and_the_sky_of_the_field_beside_is_not() {
        let map = testing::map();
        let lanes = Lanes::new(&map);
        let place = lanes.spawn_places().next().unwrap();
        let middle = lanes.pose(place).translation.vector;
        assert_eq!(lanes.under(middle).map(|p| (p.road, p.lane)), Some((place.road, place.lane)));
        assert_eq!(lanes.under(Vec3::new(90_000.0, 90_000.0, 0.0)), None);
    }
}
