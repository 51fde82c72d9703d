//! How far a vehicle is beyond the edge of the road.

use nalgebra::{Point3, Vector3};
use roads::{LaneType, LaneTypes, Map, Waypoint};
use schemas::ActorState;

/// First and last step along a lane in search of the place nearest to a vehicle.
const SEARCH_M: f64 = 4.0;
const SEARCH_M_MIN: f64 = 0.01;
/// Lanes on each side of a road's middle that are looked at.
const LANES_MAX: i32 = 16;

/// How far the middle of a vehicle is beyond the edge or the end of the nearest driving lane.
pub(super) fn beyond_edge_m(map: &Map, vehicle: &ActorState) -> f64 {
    beyond_m(map, nalgebra::convert(vehicle.world_from_actor.translation.vector))
}

fn beyond_m(map: &Map, here: Vector3<f64>) -> f64 {
    let Some(named) = map.nearest(Point3::from(here), LaneTypes::DRIVING) else {
        return f64::INFINITY;
    };
    // The map's search takes bends for chords, as CARLA's does: the lane that it names may be one
    // beside the nearest, also one that has no width yet.
    let beside = (-LANES_MAX..=LANES_MAX).filter_map(|lane| {
        let at = map.waypoint(named.road, lane, named.s)?;
        (map.lane(&at).lane_type == LaneType::Driving).then_some(at)
    });
    let mut least_m = f64::INFINITY;
    for lane in std::iter::once(named).chain(beside) {
        least_m = least_m.min(beyond_lane_m(map, lane, here));
        if least_m <= SEARCH_M_MIN {
            break;
        }
    }
    least_m
}

/// How far a point is beyond the edge of a lane and those that it comes from and leads to, where
/// that is least near a place.
fn beyond_lane_m(map: &Map, mut lane: Waypoint, here: Vector3<f64>) -> f64 {
    let mut least_m = away_m(map, &lane, here);
    // For the same reason the place may be metres off along the lane.
    let mut step_m = SEARCH_M;
    while least_m > SEARCH_M_MIN && step_m > SEARCH_M_MIN {
        let around = [map.next(&lane, step_m), map.previous(&lane, step_m)].into_iter().flatten();
        let nearer = around.map(|place| (away_m(map, &place, here), place));
        match nearer.min_by(|(a, _), (b, _)| a.total_cmp(b)) {
            Some((found_m, place)) if found_m < least_m => (least_m, lane) = (found_m, place),
            _ => step_m /= 2.0,
        }
    }
    least_m
}

/// How far a point is beyond the edge of a lane, or along from this place on it.
fn away_m(map: &Map, lane: &Waypoint, here: Vector3<f64>) -> f64 {
    let away_m = map.pose(lane).inverse().transform_point(&Point3::from(here));
    let beside_m = (away_m.y.abs() - map.lane(lane).width_m / 2.0).max(0.0);
    beside_m.hypot(away_m.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lane 12 m outside of a road that turns half around a circle of 2 m.
    #[test]
    fn the_middle_of_a_lane_is_on_the_road_in_every_bend() {
        let text = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="arc" version="1" north="0" south="0" east="0" west="0"/>
  <road name="arc" length="6.2" id="1" junction="-1">
    <planView>
      <geometry s="0" x="0" y="0" hdg="0" length="6.2"><arc curvature="0.5"/></geometry>
    </planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="shoulder" level="false">
        <width sOffset="0" a="10" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="driving" level="false">
        <width sOffset="0" a="3" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;
        let map = Map::parse("arc", text).unwrap();
        let (entry, exit) = map.driving_lanes()[0];
        for share in 0..=20 {
            let s = entry.s + (exit.s - entry.s) * f64::from(share) / 20.0;
            let place = map.pose(&Waypoint { s, ..entry });
            let found_m = beyond_m(&map, place.translation.vector);
            assert!(found_m < 0.1, "{share}: {found_m} m");
            let beside = place.transform_point(&Point3::new(0.0, -2.5, 0.0));
            let found_m = beyond_m(&map, beside.coords);
            assert!((found_m - 1.0).abs() < 0.1, "{share}: {found_m} m of 1");
        }
    }

    /// A turning lane between two others opens from width zero, where its middle is nearest to
    /// whoever drives along the edge between those.
    #[test]
    fn a_lane_without_width_hides_no_lane_beside_it() {
        let text = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="turn" version="1" north="0" south="0" east="0" west="0"/>
  <road name="turn" length="60" id="1" junction="-1">
    <planView><geometry s="0" x="0" y="0" hdg="0" length="60"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="4" b="0" c="0" d="0"/></lane>
      <lane id="-2" type="driving" level="false">
        <width sOffset="0" a="0" b="0" c="0" d="0"/>
        <width sOffset="40" a="0" b="0" c="0.0225" d="-0.00075"/></lane>
      <lane id="-3" type="driving" level="false">
        <width sOffset="0" a="4" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;
        let map = Map::parse("turn", text).unwrap();
        for right_m in [1.0, 2.5, 3.5, 4.5, 7.0] {
            let found_m = beyond_m(&map, Vector3::new(20.0, -right_m, 0.0));
            assert!(found_m < 0.01, "{right_m} m to the right: {found_m} m");
        }
        let found_m = beyond_m(&map, Vector3::new(20.0, -9.0, 0.0));
        assert!((found_m - 1.0).abs() < 0.01, "{found_m} m of 1");
    }
}
