//! Posts of lights and signs in every town.

#[path = "common/towns.rs"]
mod generated;

use generated::towns;
use roads::Carried;

#[test]
fn every_light_of_a_town_has_a_post_with_lamps_and_no_post_stands_where_cars_drive() {
    let mut signs = 0;
    for map in towns() {
        let name = map.name();
        let posts = map.posts();
        let with_lamps = posts.iter().filter(|post| post.carried == Carried::Lamps);
        let lights: Vec<Option<usize>> = with_lamps.map(|post| post.light).collect();
        let mut known: Vec<usize> = lights.iter().copied().flatten().collect();
        known.sort_unstable();
        let wanted: Vec<usize> = (0..map.traffic_lights().lights.len()).collect();
        assert_eq!((lights.len(), known), (wanted.len(), wanted), "{name}");
        signs += posts.len() - lights.len();
        let on_lanes: Vec<_> =
            posts.iter().filter(|post| post.is_on_lane).map(|post| post.foot.translation).collect();
        assert!(on_lanes.is_empty(), "{name}: {on_lanes:?}");
    }
    assert!(signs > 100, "{signs}");
}
