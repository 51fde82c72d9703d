//! A vehicle on a straight way, and bodies about it.

use super::*;
use crate::network::LanePoint;

const OWN: u32 = 1;

fn id(id: u32) -> ActorId {
    ActorId::new(id).unwrap()
}

/// Straight along x for 78 m.
fn way() -> Vec<PathPoint> {
    let point = |index: u8| {
        let at_m = 2.0 * f32::from(index);
        let point = LanePoint {
            at_m,
            point_m: Vec3::new(at_m, 0.0, 0.0),
            heading_rad: 0.0,
            curvature_per_m: 0.0,
            limit_mps: 0.0,
            width_m: 3.5,
        };
        PathPoint { point, ahead_m: at_m }
    };
    (0..40).map(point).collect()
}

/// A car at 3 m/s.
fn car(number: u32, centre_m: Vec3, forward: Vec3) -> Body {
    let half_m = Vec3::new(2.4, 0.9, 0.8);
    let velocity_mps = forward * 3.0;
    let id = id(number);
    Body { id, is_walker: false, is_urgent: false, centre_m, forward, half_m, velocity_mps }
}

fn walker(centre_m: Vec3) -> Body {
    let half_m = Vec3::new(0.25, 0.25, 0.9);
    Body { is_walker: true, half_m, ..car(2, centre_m, Vec3::x()) }
}

fn queue(bodies: Vec<Body>) -> Vec<Ahead> {
    let room = Room {
        id: id(OWN),
        front_m: 2.0,
        half_width_m: 0.9,
        beside_m: 0.35,
        beside_walkers_m: 0.6,
    };
    Scene::new(bodies, Vec::new()).queue(&way(), &room).all()
}

fn ahead(body: Body) -> Option<Ahead> {
    queue(vec![body]).first().copied()
}

#[test]
fn the_gap_to_whoever_drives_ahead_is_from_bumper_to_bumper() {
    for step in 0..40u8 {
        let at_m = 10.0 + 0.1 * f32::from(step);
        let found = ahead(car(2, Vec3::new(at_m, 0.3, 0.0), Vec3::x())).unwrap();
        assert!((found.gap_m - (at_m - 4.4)).abs() < 1.0e-3, "{at_m}: {found:?}");
        assert!((found.along_mps - 3.0).abs() < 1.0e-3, "{found:?}");
    }
}

#[test]
fn whoever_crosses_is_as_near_as_his_side_and_beside_the_way_is_not_in_it() {
    let found = ahead(car(2, Vec3::new(20.0, 1.0, 0.0), Vec3::y())).unwrap();
    assert!((found.gap_m - (20.0 - 0.9 - 2.0)).abs() < 1.0e-3, "{found:?}");
    assert!(found.along_mps.abs() < 1.0e-3 && (found.speed_mps - 3.0).abs() < 1.0e-3);
    assert_eq!(ahead(car(2, Vec3::new(20.0, 2.3, 0.0), Vec3::x())), None);
}

#[test]
fn nobody_behind_on_another_storey_or_oneself_is_in_the_way() {
    assert_eq!(ahead(car(2, Vec3::new(-3.2, 0.0, 0.0), Vec3::x())), None);
    assert_eq!(ahead(car(2, Vec3::new(20.0, 0.0, 4.0), Vec3::x())), None);
    assert_eq!(ahead(car(OWN, Vec3::new(0.5, 0.0, 0.0), Vec3::x())), None);
}

#[test]
fn a_queue_is_in_order_of_the_way() {
    let places_m = [25.0, 60.0, 18.0];
    let bodies = (2..).zip(places_m).map(|(id, x_m)| car(id, Vec3::new(x_m, 0.0, 0.0), Vec3::x()));
    let found: Vec<u32> = queue(bodies.collect()).iter().map(|ahead| ahead.id.get()).collect();
    assert_eq!(found, [4, 2, 3]);
}

#[test]
fn people_get_more_room_beside_and_ahead() {
    let found = ahead(walker(Vec3::new(20.0, 1.6, 0.0))).unwrap();
    assert!((found.gap_m - (20.0 - 0.25 - 2.0)).abs() < 1.0e-3, "{found:?}");
    assert_eq!(found.leader(), (found.gap_m - MORE_TO_WALKERS_M, found.along_mps));
    let as_car = Body { is_walker: false, ..walker(Vec3::new(20.0, 1.6, 0.0)) };
    assert_eq!(ahead(as_car), None);
    let car = ahead(car(2, Vec3::new(20.0, 0.0, 0.0), Vec3::x())).unwrap();
    assert_eq!(car.leader(), (car.gap_m, car.along_mps));
}

const RADIUS_M: f32 = 16.75;
const STRAIGHT_M: f32 = 10.0;

/// 10 m straight ahead, then to the left on a circle.
fn left_turn(at_m: f32) -> LanePoint {
    let turn_rad = (at_m - STRAIGHT_M).max(0.0) / RADIUS_M;
    let forward_m = at_m.min(STRAIGHT_M) + RADIUS_M * turn_rad.sin();
    LanePoint {
        at_m,
        point_m: Vec3::new(forward_m, RADIUS_M * (1.0 - turn_rad.cos()), 0.0),
        heading_rad: turn_rad,
        curvature_per_m: if at_m < STRAIGHT_M { 0.0 } else { 1.0 / RADIUS_M },
        limit_mps: 0.0,
        width_m: 3.5,
    }
}

/// A car that has driven so far on the left turn. Its middle is on the turn, and its rear axle,
/// 1.4 m behind, follows its own course within it.
fn turning(driven_m: f32) -> Body {
    let at = left_turn(driven_m);
    let heading_rad = at.heading_rad - 1.4 * at.curvature_per_m;
    let forward = Vec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
    Body { half_m: Vec3::new(2.45, 0.95, 0.7), ..car(OWN, at.point_m, forward) }
}

/// Whether two boxes touch: no side of either has the other beyond it.
fn touch(a: &Body, b: &Body) -> bool {
    let sides = |body: &Body| [body.forward, Vec3::new(-body.forward.y, body.forward.x, 0.0)];
    let reach_m = |body: &Body, along: &Vec3| {
        let [length, width] = sides(body).map(|side| side.dot(along).abs());
        length * body.half_m.x + width * body.half_m.y
    };
    let apart = |along: &Vec3| {
        (a.centre_m - b.centre_m).dot(along).abs() > reach_m(a, along) + reach_m(b, along)
    };
    !sides(a).iter().chain(&sides(b)).any(apart)
}

/// Cars stand about the way straight ahead, and for each of them it is tried out whether a car
/// that turns off would touch it.
#[test]
fn whoever_would_be_touched_in_a_turn_is_seen_before() {
    let points: Vec<PathPoint> = (0..18)
        .map(|index| 2.0 * index as f32)
        .map(|ahead_m| PathPoint { point: left_turn(ahead_m), ahead_m })
        .collect();
    let own = turning(0.0).half_m;
    let room = Room {
        id: id(OWN),
        front_m: own.x,
        half_width_m: own.y,
        beside_m: 0.1,
        beside_walkers_m: 0.6,
    };
    let mut touched = 0;
    for step in 0..1_000_u16 {
        let [ahead, across, turn] = [step % 20, step / 20 % 10, step / 200].map(f32::from);
        let heading_rad = 0.2 * (turn - 2.0);
        let forward = Vec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
        let centre_m = Vec3::new(17.0 + 0.25 * ahead, 0.3 * (across - 5.0), 0.0);
        let other = Body { velocity_mps: Vec3::zeros(), ..car(2, centre_m, forward) };
        let mut places_m = (0..500).map(|place| 0.05 * place as f32);
        let Some(touch_m) = places_m.find(|at_m| touch(&turning(*at_m), &other)) else { continue };
        touched += 1;
        let seen = Scene::new(vec![other], Vec::new()).ahead(&points, &room);
        let gap_m = seen.map(|ahead| ahead.gap_m);
        assert!(gap_m.is_some_and(|gap_m| gap_m < touch_m + 0.5), "{other:?}: {gap_m:?}");
    }
    assert!((300..900).contains(&touched), "{touched} of 1000");
}

/// A way of 78 m that bends to the left after 20 m.
fn bend() -> Vec<PathPoint> {
    let mut points = way();
    let (mut at_m, mut heading_rad) = (Vec3::zeros(), 0.0f32);
    for point in &mut points {
        let curvature_per_m = if point.ahead_m > 20.0 { 0.05 } else { 0.0 };
        (point.point.point_m, point.point.heading_rad) = (at_m, heading_rad);
        point.point.curvature_per_m = curvature_per_m;
        at_m += Vec3::new(heading_rad.cos(), heading_rad.sin(), 0.0) * 2.0;
        heading_rad += 2.0 * curvature_per_m;
    }
    points
}

#[test]
fn who_is_left_out_unseen_is_not_in_the_way() {
    let points = bend();
    let others = (0..4_000u16).map(|index| {
        let [x, y, turn] = [7.0, 11.0, 13.0].map(|step| f32::from(index) * step);
        let centre_m = Vec3::new(x % 101.0 - 20.0, y % 97.0 - 20.0, 0.0);
        let forward = Vec3::new(turn.cos(), turn.sin(), 0.0);
        let body = car(2 + u32::from(index), centre_m, forward);
        let length_m = 0.3 + 6.0 * turn.sin().abs();
        Body { half_m: Vec3::new(length_m, 1.2, 1.0), is_walker: index % 5 == 0, ..body }
    });
    let others: Vec<Body> = others.collect();
    let room = Room::of(&car(OWN, Vec3::zeros(), Vec3::x()), 0.35, 0.6);
    let strip = Strip::new(&points, &room, Extent::of(&points, &room).swing_m);
    let mut found = Scene::new(others.clone(), Vec::new()).queue(&points, &room).all();
    let mut all: Vec<Ahead> = others.iter().filter_map(|body| strip.ahead(body, 0)).collect();
    let order = |a: &Ahead, b: &Ahead| a.gap_m.total_cmp(&b.gap_m).then(a.id.cmp(&b.id));
    all.sort_by(order);
    found.sort_by(order);
    assert!(all.len() > 100, "{}", all.len());
    assert_eq!(found, all);
}

#[test]
fn the_first_who_is_in_the_way_is_the_first_of_all() {
    let points = bend();
    let room = Room::of(&car(OWN, Vec3::zeros(), Vec3::x()), 0.35, 0.6);
    for round in 0..400u16 {
        let others = (0..1 + round % 30).map(|index| {
            let [x, y, turn] =
                [7.0, 11.0, 13.0].map(|step| f32::from(index + 31 * (round / 2)) * step);
            let centre_m = Vec3::new(x % 101.0 - 20.0, y % 97.0 - 20.0, 0.0);
            let forward = Vec3::new(turn.cos(), turn.sin(), 0.0);
            car(2 + u32::from(index), centre_m, forward)
        });
        // Two of each, for equal gaps.
        let others = others.flat_map(|body| [body, Body { id: id(1_000 + body.id.get()), ..body }]);
        let scene = Scene::new(others.collect(), Vec::new());
        let queue = scene.queue(&points, &room);
        assert_eq!(queue.first(), queue.all().first().copied());
    }
}

#[test]
fn all_in_some_cells_are_told_of_once_by_column_and_row() {
    let bodies: Vec<Body> = (0..300u32)
        .map(|number| {
            let [x, y] = [7, 13].map(|times| (number * times * 31 % 211) as f32 - 100.0);
            car(number + 1, Vec3::new(x, y, 0.0), Vec3::x())
        })
        .collect();
    let scene = Scene::new(bodies.clone(), Vec::new());
    for low in [[-9, -9], [-3, -2], [0, 0], [2, -7]] {
        for high in [[-8, 9], [-1, 1], [3, 0], [9, 9], [1, -8]] {
            let is_within = |body: &&Body| {
                let [x, y] = cell(&body.centre_m);
                (low[0]..=high[0]).contains(&x) && (low[1]..=high[1]).contains(&y)
            };
            let mut wanted: Vec<&Body> = bodies.iter().filter(is_within).collect();
            wanted.sort_by_key(|body| cell(&body.centre_m));
            let mut found = Vec::new();
            scene.within([low, high], |body, _| found.push(body.id));
            let wanted: Vec<ActorId> = wanted.iter().map(|body| body.id).collect();
            assert_eq!(found, wanted, "{low:?} to {high:?}");
        }
    }
}
