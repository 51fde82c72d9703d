use std::fmt::Write as _;

use super::*;

/// Type and width of a lane.
type Lane = (&'static str, f64);

/// A straight road 200 m long that begins at a place; its lanes from the middle outward.
struct Road {
    from_m: (f64, f64),
    heading_rad: f64,
    left: &'static [Lane],
    right: &'static [Lane],
}

/// Along x, traffic towards +x south of it.
const EAST: Road = Road { from_m: (0.0, 0.0), heading_rad: 0.0, left: &[], right: DRIVING };
const DRIVING: &[Lane] = &[("driving", 3.5)];
/// Beside a lane with nothing beyond it.
const BESIDE: Option<(f64, f64)> = Some((2.55, 2.55));

fn map(roads: &[Road]) -> roads::Map {
    let mut text = "<?xml version=\"1.0\"?><OpenDRIVE><header revMajor=\"1\" revMinor=\"4\" \
                    name=\"kerbs\" version=\"1\" north=\"0\" south=\"0\" east=\"0\" west=\"0\"/>"
        .to_owned();
    for (id, road) in (1..).zip(roads) {
        let lane = |id: i32, (kind, width_m): Lane| {
            format!(
                "<lane id=\"{id}\" type=\"{kind}\" level=\"false\">\
                 <width sOffset=\"0\" a=\"{width_m}\" b=\"0\" c=\"0\" d=\"0\"/></lane>"
            )
        };
        let side = |tag: &str, lanes: &[Lane], sign: i32| {
            let lanes = (1..).zip(lanes).map(|(number, own)| lane(sign * number, *own));
            let lanes: String = lanes.collect();
            if lanes.is_empty() { lanes } else { format!("<{tag}>{lanes}</{tag}>") }
        };
        write!(
            text,
            "<road name=\"\" length=\"200\" id=\"{id}\" junction=\"-1\"><planView>\
             <geometry s=\"0\" x=\"{}\" y=\"{}\" hdg=\"{}\" length=\"200\"><line/></geometry>\
             </planView><lanes><laneSection s=\"0\">{}<center><lane id=\"0\" type=\"none\" \
             level=\"false\"/></center>{}</laneSection></lanes></road>",
            road.from_m.0,
            road.from_m.1,
            road.heading_rad,
            side("left", road.left, 1),
            side("right", road.right, -1)
        )
        .unwrap();
    }
    text.push_str("</OpenDRIVE>");
    roads::Map::parse("kerbs", &text).unwrap()
}

/// From the middle of the lane towards +x to where people stand on its left and right, and to where
/// they step out; in metres.
fn kerbs_m(roads: &[Road]) -> [Option<(f64, f64)>; 2] {
    let map = map(roads);
    let over = map.waypoint(1, -1, 100.0).unwrap();
    let millimetres = |m: f64| (m * 1_000.0).round() / 1_000.0;
    [Side::Left, Side::Right].map(|side| {
        let kerb = kerb(Lanes::new(&map), over, side)?;
        Some((millimetres(kerb.stands_m), millimetres(kerb.steps_out_m)))
    })
}

#[test]
fn people_stand_at_the_outer_edge_of_a_road_and_not_on_its_median() {
    let left = &[("median", 4.0), ("driving", 3.5), ("shoulder", 0.5), ("sidewalk", 3.0)];
    let right = &[("driving", 3.5), ("parking", 2.3), ("shoulder", 0.5), ("sidewalk", 3.0)];
    assert_eq!(
        kerbs_m(&[Road { left, right, ..EAST }]),
        [Some((10.55, 10.05)), Some((5.35, 2.55))]
    );
    let left = &[("none", 1.0), ("sidewalk", 2.0), ("none", 1.0), ("driving", 3.5), ("none", 2.0)];
    assert_eq!(kerbs_m(&[Road { left, ..EAST }]), [Some((10.05, 10.05)), BESIDE]);
}

#[test]
fn a_carriageway_beyond_a_median_is_of_the_same_road_if_nobody_walks_between() {
    let right = &[("driving", 3.5), ("shoulder", 1.0)];
    let west =
        || Road { from_m: (200.0, 4.0), heading_rad: std::f64::consts::PI, left: &[], right };
    assert_eq!(kerbs_m(&[EAST, west()]), [Some((11.05, 10.05)), BESIDE]);
    let left = &[("sidewalk", 2.0)];
    assert_eq!(kerbs_m(&[Road { left, ..EAST }, west()]), [BESIDE, BESIDE]);
}

#[test]
fn nobody_stands_where_a_road_is_too_wide_or_another_one_begins() {
    let left = &[("driving", 3.5); 4];
    assert_eq!(kerbs_m(&[Road { left, ..EAST }]), [None, BESIDE]);
    let north = Road {
        from_m: (100.0, 2.0),
        heading_rad: std::f64::consts::FRAC_PI_2,
        left: DRIVING,
        right: DRIVING,
    };
    assert_eq!(kerbs_m(&[EAST, north]), [None, BESIDE]);
    let right = &[("driving", 1.8)];
    assert_eq!(kerbs_m(&[Road { right, ..EAST }]), [None, None], "no lane for cars");
}
