//! Places that programs of CARLA's users name by coordinates are on the road in our towns.

#[path = "common/towns.rs"]
mod generated;

use generated::town;
use nalgebra::Point3;
use roads::LaneType;

/// Where egos of scenario_runner's examples begin: x and y in metres, yaw in degrees, as CARLA
/// counts them, y to the south and yaw clockwise.
type Start = [f64; 3];
const TOWN01: [Start; 10] = [
    [107.0, 133.0, 0.0],
    [105.0, 199.1, 0.0],
    [100.0, 133.0, 0.0],
    [270.0, 129.0, 180.0],
    [312.0, 129.0, 180.0],
    [130.0, 55.0, 180.0],
    [392.0, 195.0, 90.0],
    [-2.0, 160.0, 90.0],
    [169.0, 59.6, 0.0],
    [282.0, 199.0, 0.0],
];
const TOWN02: [Start; 10] = [
    [28.7, 302.5, 180.0],
    [137.0, 105.0, 180.0],
    [8.0, 109.5, 0.0],
    [181.0, 105.0, 180.0],
    [27.0, 109.5, 0.0],
    [55.0, 306.5, 0.0],
    [57.0, 191.5, 0.0],
    [30.0, 187.5, 180.0],
    [88.0, 237.0, 180.0],
    [132.0, 215.0, 90.0],
];
const TOWN03: [Start; 14] = [
    [-74.3, -50.0, 270.0],
    [239.0, 113.0, 270.0],
    [232.0, 113.0, 90.0],
    [110.0, 129.0, 180.0],
    [90.0, 129.0, 180.0],
    [120.0, 193.0, 180.0],
    [150.0, 193.0, 180.0],
    [-134.0, 137.0, 0.0],
    [17.0, 136.0, 0.0],
    [15.0, 208.0, 0.0],
    [-85.0, -87.0, 89.0],
    [-48.0, 135.0, 0.0],
    [207.0, 59.0, 180.0],
    [237.0, -95.0, 90.0],
];
const TOWN04: [Start; 12] = [
    [245.0, -249.0, 180.0],
    [246.0, -311.0, 181.0],
    [255.0, -300.0, 90.0],
    [156.0, 19.0, 180.0],
    [284.0, 16.4, 187.0],
    [-326.0, 436.0, 0.0],
    [178.0, -396.0, 180.0],
    [203.0, -210.0, 270.0],
    [63.0, -190.0, 270.0],
    [389.0, -140.0, 90.0],
    [-510.0, 88.0, 91.0],
    [-12.0, -17.0, 90.0],
];
const TOWN05: [Start; 12] = [
    [-55.0, 25.0, 90.0],
    [-26.0, 95.0, 1.0],
    [72.0, -6.0, 180.0],
    [-170.0, 95.0, 0.0],
    [-151.0, 205.0, 0.0],
    [149.0, -104.0, 90.0],
    [171.0, -182.0, 223.0],
    [-150.0, -190.0, 1.0],
    [-146.0, -1.0, 180.0],
    [-76.0, -1.0, 180.0],
    [94.0, 145.0, 341.0],
    [189.0, -100.0, 90.0],
];
/// Where vehicles of leaderboard's routes begin or come along.
const TOWN06: [Start; 12] = [
    [635.9, 41.7, 0.0],
    [-9.3, 74.7, 90.0],
    [-75.1, -15.7, 180.0],
    [51.6, -23.1, 180.0],
    [-273.4, 52.1, 357.0],
    [-12.1, -61.3, 90.0],
    [153.7, 194.7, 310.0],
    [-5.6, 10.7, 90.0],
    [63.9, 38.0, 0.0],
    [0.7, -152.4, 181.0],
    [-366.2, 172.1, 89.0],
    [668.0, 191.9, 271.0],
];
/// Where LEAD's routes lead along.
const TOWN07: [Start; 14] = [
    [-2.3, 35.8, 270.0],
    [-102.8, 15.2, 90.0],
    [82.4, 32.1, 89.0],
    [33.9, -3.6, 180.0],
    [-130.3, -231.8, 227.0],
    [-45.8, -88.2, 0.0],
    [66.0, -128.5, 255.0],
    [-202.9, 89.5, 91.0],
    [-156.9, -105.4, 137.0],
    [31.4, 63.6, 2.0],
    [-149.2, -1.6, 271.0],
    [-84.6, -123.7, 114.0],
    [-36.0, -158.0, 1.0],
    [-201.5, -195.0, 90.0],
];
/// One of an example, then where a route of scenario_runner leads along.
const TOWN10: [Start; 7] = [
    [-19.4, 69.5, 0.0],
    [85.7, 66.4, 180.0],
    [-2.8, 66.2, 180.0],
    [-41.7, 47.7, 270.0],
    [-41.7, -32.0, 270.0],
    [12.7, -57.4, 0.0],
    [-0.8, 13.2, 180.0],
];
/// A start is no farther from the middle of a lane, in metres: half of a lane, and a third lane
/// that stands for a turning lane.
const BESIDE_MAX_M: f64 = 2.0;
/// Roads are lower than this, in metres; the starts are given without a height.
const HEIGHT_MAX_M: f64 = 12.0;
/// A start is on a lane that leads the same way within this angle, in degrees.
const SAME_WAY_DEG: f64 = 20.0;

#[test]
fn vehicles_of_examples_and_routes_begin_on_lanes_that_lead_their_way() {
    let towns: [(&str, &[Start]); 8] = [
        ("Town01", &TOWN01),
        ("Town02", &TOWN02),
        ("Town03", &TOWN03),
        ("Town04", &TOWN04),
        ("Town05", &TOWN05),
        ("Town06", &TOWN06),
        ("Town07", &TOWN07),
        ("Town10HD", &TOWN10),
    ];
    for (name, starts) in towns {
        let map = town(name);
        for [x_m, y_m, yaw_deg] in starts {
            let at = format!("{name}: {x_m} {y_m}");
            let point = Point3::new(*x_m, -*y_m, 0.0);
            let near = map.nearest_within(point, LaneType::Driving.into(), HEIGHT_MAX_M);
            let (place, _) = near.unwrap_or_else(|| panic!("{at}: no lane"));
            let pose = map.lane_pose(&place).unwrap();
            let beside_m = (pose.point - point).xy().norm();
            assert!(beside_m < BESIDE_MAX_M, "{at}: {beside_m} m beside the middle of a lane");
            let heading_deg = -pose.heading_rad.to_degrees();
            let off_deg = (heading_deg - yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
            assert!(off_deg.abs() < SAME_WAY_DEG, "{at}: the lane leads to {heading_deg}");
        }
    }
}

/// Where Bench2Drive's routes put actors on slopes, and places of CARLA's Town07: town, then x, y
/// and z as CARLA counts them.
const HIGH: [(&str, [f64; 3]); 16] = [
    ("Town03", [84.0, -94.0, 8.0]),
    ("Town03", [84.0, -116.0, 8.0]),
    ("Town03", [38.0, -134.0, 2.0]),
    ("Town03", [64.0, -137.0, 7.5]),
    ("Town03", [144.0, 193.0, 2.1]),
    ("Town03", [126.0, 193.0, 2.1]),
    ("Town03", [-125.0, -134.0, 0.8]),
    ("Town05", [-41.0, -208.0, 4.6]),
    ("Town05", [-73.0, -208.0, 8.6]),
    ("Town05", [-105.0, -208.0, 10.0]),
    // The viaduct's other end, on CARLA's own map.
    ("Town05", [-54.0, 198.0, 4.0]),
    ("Town07", [59.0, -61.1, 4.2]),
    ("Town07", [67.3, -120.3, 9.1]),
    ("Town07", [44.7, -174.7, 6.1]),
    ("Town07", [-69.0, -226.7, 4.9]),
    ("Town07", [-128.9, -230.3, 4.4]),
];
/// Streets are as high as CARLA's within this, in metres.
const ABOVE_MAX_M: f64 = 1.0;

#[test]
fn streets_climb_where_carlas_do() {
    for (name, [x_m, y_m, z_m]) in HIGH {
        let point = Point3::new(x_m, -y_m, z_m);
        let map = town(name);
        let place = map.nearest(point, LaneType::Driving.into()).unwrap();
        let off = map.lane_pose(&place).unwrap().point - point;
        assert!(off.z.abs() < ABOVE_MAX_M, "{name}: {off} beside {point}");
        assert!(off.xy().norm() < 5.0, "{name}: {off} beside {point}");
    }
}

/// Agents of leaderboards make metres of degrees by numbers that hold around CARLA's origin alone.
#[test]
fn latitudes_and_longitudes_of_our_towns_begin_at_zero_as_those_of_carlas() {
    for map in generated::towns() {
        let place = map.geo_place(&Point3::origin());
        assert_eq!([place.latitude_deg, place.longitude_deg], [0.0, 0.0], "{}", map.name());
    }
}
