//! Where vehicles begin in the towns of our own.

#[path = "common/towns.rs"]
mod generated;

use generated::town;
use nalgebra::{Isometry3, Point3};
use roads::Map;

/// CARLA's numbers of spawn points, which programs count on.
const CARLA: [(&str, usize); 8] = [
    ("Town01", 255),
    ("Town02", 101),
    ("Town03", 265),
    ("Town04", 372),
    ("Town05", 302),
    ("Town06", 436),
    ("Town07", 116),
    ("Town10HD", 155),
];

#[test]
fn every_town_has_as_many_spawn_points_as_that_of_carla_and_room_for_a_car_at_each() {
    for (name, count) in CARLA {
        let map = town(name);
        let points = map.spawn_points();
        assert!(points.len() >= count, "{name}: {} of {count}", points.len());
        let spread = map.spread_places();
        assert!(spread.len() > 40 && points.starts_with(spread), "{name}: {}", spread.len());
        for (index, a) in points.iter().enumerate() {
            for b in &points[index + 1..] {
                // Seen from a: two cars of 5 m by 2 m abreast or in a row, whatever b's heading.
                let apart = a.inv_mul(b).translation.vector;
                let touch = apart.x.abs() < 5.0 && apart.y.abs() < 2.0 && apart.z.abs() < 2.0;
                assert!(!touch, "{name}: {apart} apart");
            }
        }
    }
}

/// Whoever names a spawn point by its index finds it where it was: how many, and where, to the
/// centimetre and hundredth of a degree.
#[test]
fn towns_keep_their_spawn_points_as_they_were() {
    let digest = |points: &[Isometry3<f64>]| {
        let mut hasher = blake3::Hasher::new();
        for point in points {
            let (roll, pitch, yaw) = point.rotation.euler_angles();
            let angles =
                [roll, pitch, yaw].map(|angle| (angle.to_degrees() * 100.0).round() as i64);
            let place = [point.translation.x, point.translation.y, point.translation.z];
            for value in place.map(|m| (m * 100.0).round() as i64).into_iter().chain(angles) {
                hasher.update(&value.to_le_bytes());
            }
        }
        hasher.finalize().to_hex()[..16].to_owned()
    };
    let found = CARLA.map(|(name, _)| {
        let points = town(name).spawn_points().to_owned();
        (name, points.len(), digest(&points))
    });
    let wanted = [
        ("Town01", 255, "096ffc1dcaa95c7b"),
        ("Town02", 101, "fd3a884424cff7fd"),
        ("Town03", 506, "187f355fa5a30252"),
        ("Town04", 967, "f55e527d614634a9"),
        ("Town05", 656, "2622c9cf0c214dd5"),
        ("Town06", 673, "65bf635aeb0e80e5"),
        ("Town07", 159, "b050af608277d8b7"),
        ("Town10HD", 155, "7ba432d4e44be534"),
    ];
    for ((name, count, digest), wanted) in found.iter().zip(wanted) {
        assert_eq!((*name, *count, digest.as_str()), wanted, "all of them: {found:#?}");
    }
}

/// A car of 5 m by 2 m, by points of it that are half a metre apart.
fn of_a_car() -> impl Iterator<Item = Point3<f64>> {
    let along = (-5..=5).map(|step| f64::from(step) * 0.5);
    let across = [-1.0, -0.5, 0.0, 0.5, 1.0];
    let up = [0.0, 0.5, 1.0, 1.5];
    along.flat_map(move |x| across.into_iter().flat_map(move |y| up.map(|z| Point3::new(x, y, z))))
}

#[test]
fn nothing_of_a_town_stands_where_a_car_begins() {
    for (name, _) in CARLA {
        let map = town(name);
        let posts = map.posts();
        for (index, point) in map.spawn_points().iter().enumerate() {
            let is_near = |at: &Isometry3<f64>, reach_m: f64| {
                (at.translation.vector - point.translation.vector).norm() < reach_m + 4.0
            };
            for thing in map.scenery() {
                if is_near(&thing.pose, thing.half_extent_m.norm()) {
                    let stands = of_a_car().any(|part| {
                        let local = thing.pose.inverse_transform_point(&(point * part));
                        (local.coords.abs() - thing.half_extent_m).max() < 0.0
                    });
                    assert!(!stands, "{name}: {thing:?} stands at spawn point {index}, {point}");
                }
            }
            for post in posts.iter().filter(|post| is_near(&post.foot, post.top_m)) {
                let stands = of_a_car().any(|part| {
                    let local = post.foot.inverse_transform_point(&(point * part));
                    local.coords.xy().norm() < post.radius_m + 0.25
                        && (-post.root_m..post.top_m).contains(&local.z)
                });
                assert!(!stands, "{name}: {post:?} stands at spawn point {index}, {point}");
            }
        }
    }
}

#[test]
fn a_town_under_both_of_its_names_has_the_same_spawn_points() {
    let text = roads::town::build("Town02").unwrap();
    let [plain, opt] = ["Town02", "Town02_Opt"].map(|name| Map::parse(name, &text).unwrap());
    assert_eq!(plain.spawn_points(), opt.spawn_points());
    let unknown = Map::parse("mine", &text).unwrap();
    assert_eq!(unknown.spawn_points(), plain.spread_places());
}

/// Two streets with these numbers, the first of them in the north.
fn two_streets(numbers: [u32; 2]) -> String {
    let street = |number: u32, y: f64| {
        format!(
            "<road id=\"{number}\" length=\"100\" junction=\"-1\"><planView>\
             <geometry s=\"0\" x=\"0\" y=\"{y}\" hdg=\"0\" length=\"100\"><line/></geometry>\
             </planView><lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center>\
             <right><lane id=\"-1\" type=\"driving\"><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" \
             d=\"0\"/></lane></right></laneSection></lanes></road>"
        )
    };
    let [north, south] = numbers;
    format!("<OpenDRIVE>{}{}</OpenDRIVE>", street(north, 50.0), street(south, -50.0))
}

#[test]
fn streets_come_in_the_order_of_the_text_whatever_their_numbers_are() {
    let points =
        |numbers| Map::parse("mine", &two_streets(numbers)).unwrap().spawn_points().to_vec();
    let found = points([1, 2]);
    assert!(found[0].translation.y > 0.0 && found.len() > 4, "{found:?}");
    assert_eq!(points([2, 1]), found);
}
