//! How the lanes of ways through junctions are counted.

#[path = "common/town_texts.rs"]
#[allow(dead_code, reason = "other tests read more of the texts")]
mod texts;

use roxmltree::Node;
use texts::*;

/// Ways that turn by less lead straight on, in radians.
const AHEAD_RAD: f64 = 0.44;

#[test]
fn who_goes_straight_on_through_a_junction_keeps_the_number_of_the_lane() {
    for_each_town(|town, document| {
        let mut kept = 0;
        for road in all(document, "road").filter(|road| is_connecting(*road)) {
            if turn_rad(road).abs() > AHEAD_RAD {
                continue;
            }
            let is_driven = |lane: &Node<'_, '_>| lane.attribute("type") == Some("driving");
            for lane in inside(road, "lane").filter(is_driven) {
                let from = inside(lane, "predecessor").next().map(|from| id(from, "id").abs());
                assert_eq!(Some(id(lane, "id").abs()), from, "{town}: {road:?}");
                kept += 1;
            }
        }
        assert!(kept > 0, "{town}");
    });
}
