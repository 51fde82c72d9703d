//! Ways through junctions of our towns, and who is granted them.

use super::*;
use crate::network::Conflict;

fn network() -> Network {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    Network::new(&roads::Map::parse("Town10HD_Opt", &text).unwrap())
}

fn id(id: u32) -> ActorId {
    ActorId::new(id).unwrap()
}

/// One who is at the junction.
fn asker(number: u32, rank: u8) -> Asker {
    Asker { id: id(number), rank, eta_secs: 0.0, leads_circle: false }
}

fn way(network: &Network, lane: LaneId) -> Way {
    let exit_m = 10.0 + network.lane(lane).unwrap().length_m();
    Way { lanes: vec![lane], entry_m: 10.0, exit_m, next_m: f32::INFINITY }
}

/// A way to the left that oncoming traffic crosses deep inside, a way of that traffic, which comes
/// along more than 20 m of road, and one that crosses the part before it.
fn left_turn(network: &Network) -> [LaneId; 3] {
    let lanes = (0..network.lane_count() as LaneId).filter_map(|id| {
        let lane = network.lane(id)?;
        let other = |conflict: &Conflict| Some((*conflict, network.lane(conflict.lane)?));
        let met: Vec<_> = lane.conflicts.iter().filter_map(other).collect();
        let oncoming = met.iter().filter(|(_, other)| other.is_oncoming(lane));
        let (first, _) = oncoming.min_by(|a, b| a.0.from_m.total_cmp(&b.0.from_m))?;
        let crossing = met.iter().find(|(conflict, other)| {
            !other.is_oncoming(lane) && conflict.until_m < first.from_m - BEFORE_M
        });
        let joins = network.lane(first.lane)?.joins(lane);
        let deep = first.from_m > 10.0 && !joins;
        let before = network.lane(*network.lane(first.lane)?.previous.first()?)?;
        let fits = deep && before.length_m() > 20.0;
        Some([id, first.lane, crossing?.0.lane]).filter(|_| fits)
    });
    lanes.into_iter().next().unwrap()
}

#[test]
fn who_turns_left_waits_before_oncoming_traffic_and_lets_it_pass() {
    let network = network();
    let [left, straight, crossing] = left_turn(&network);
    let [left, straight, crossing] = [left, straight, crossing].map(|it| way(&network, it));
    let mut claims = Claims::default();
    assert_eq!(claims.grant(&network, &straight, &asker(1, 1)), Ok(()));
    assert_eq!(claims.grant(&network, &left, &asker(2, 1)), Err(id(1)));
    let until_m = claims.grant_part(&network, &left, &asker(2, 1)).unwrap();
    let lane = network.lane(left.lanes[0]).unwrap();
    assert!(until_m < lane.conflict(straight.lanes[0]).unwrap().from_m);
    assert_eq!(claims.grant(&network, &straight, &asker(3, 1)), Ok(()), "more oncoming traffic");
    assert_eq!(claims.grant_part(&network, &left, &asker(4, 1)), None, "one at a time");
    let mut claims = Claims::default();
    claims.hold(&network, &left, id(2), Some(until_m));
    assert_eq!(claims.grant(&network, &crossing, &asker(5, 1)), Err(id(2)));
}

#[test]
fn what_is_claimed_in_one_junction_keeps_nobody_from_another() {
    let network = network();
    let [left, straight, _] = left_turn(&network);
    let junction = network.lane(left).unwrap().junction;
    let elsewhere = (0..network.lane_count() as LaneId).find(|id| {
        let lane = network.lane(*id).unwrap();
        lane.junction.is_some() && lane.junction != junction && !lane.conflicts.is_empty()
    });
    let mut claims = Claims::default();
    for lane in [straight, elsewhere.unwrap()] {
        assert_eq!(claims.grant(&network, &way(&network, lane), &asker(1, 1)), Ok(()));
        let held = &claims.told(&network, lane).unwrap().held;
        assert!(held.len() == 1 && held[0].lane == lane, "{held:?}");
    }
    assert_eq!(claims.grant(&network, &way(&network, left), &asker(2, 1)), Err(id(1)));
}

#[test]
fn who_left_a_crossing_behind_leaves_it_to_others() {
    let network = network();
    let [left, straight, _] = left_turn(&network);
    let until_m = network.lane(straight).unwrap().conflict(left).unwrap().until_m;
    let left = way(&network, left);
    for (rear_m, free) in [(until_m, false), (until_m + CLEAR_M + 0.1, true)] {
        let mut claims = Claims::default();
        claims.tell(&network, Hold { rear_m, ..Hold::of(straight, id(1)) });
        assert_eq!(claims.grant(&network, &left, &asker(2, 1)).is_ok(), free, "{rear_m} m");
    }
}

/// Somebody at rest behind others who holds what another one asks for.
#[test]
fn who_stands_behind_somebody_keeps_nobody_before_it_from_a_junction() {
    let network = network();
    let [left, straight, _] = left_turn(&network).map(|it| way(&network, it));
    let behind = |number: u32| Held::Behind(id(number));
    let room = |number: u32| Held::Room(id(number));
    for (waits, is_granted) in [
        (vec![], false),
        (vec![(1, behind(2))], true),
        (vec![(1, behind(3)), (3, behind(2))], true),
        (vec![(1, Held::Beside(id(2)))], true),
        (vec![(1, behind(3))], false),
        (vec![(1, room(2))], false),
        (vec![(1, behind(3)), (3, room(2))], false),
        (vec![(1, behind(3)), (3, behind(1))], false),
    ] {
        let mut claims = Claims::default();
        waits.iter().for_each(|(number, held)| claims.wait(id(*number), *held));
        claims.hold(&network, &straight, id(1), None);
        let granted = claims.grant(&network, &left, &asker(2, 1));
        assert_eq!(granted, if is_granted { Ok(()) } else { Err(id(1)) }, "{waits:?}");
    }
}

#[test]
fn of_a_circle_the_lowest_number_that_a_junction_holds_leads_it_and_passes_the_others() {
    let network = network();
    let [left, straight, _] = left_turn(&network).map(|it| way(&network, it));
    let claims = || {
        let mut claims = Claims::default();
        claims.wait(id(1), Held::Behind(id(2)));
        claims.wait(id(2), Held::Room(id(5)));
        claims.wait(id(5), Held::Claim(id(4)));
        claims.wait(id(4), Held::Room(id(1)));
        // Whoever waits for one of a circle is no part of it.
        claims.wait(id(3), Held::Room(id(1)));
        claims.wait(id(6), Held::Line);
        claims.wait(id(7), Held::Room(id(6)));
        claims.hold(&network, &straight, id(4), None);
        claims
    };
    let leads: Vec<u32> = (1..9).filter(|number| claims().leads_circle(id(*number))).collect();
    assert_eq!(leads, [5], "who has room beyond the junction");
    let mut full = claims();
    full.wait(id(5), Held::Room(id(4)));
    let leads: Vec<u32> = (1..9).filter(|number| full.leads_circle(id(*number))).collect();
    assert_eq!(leads, [2], "where none has");
    assert_eq!(claims().grant(&network, &left, &asker(2, 1)), Err(id(4)));
    let leading = Asker { leads_circle: true, ..asker(2, 1) };
    assert_eq!(claims().grant(&network, &left, &leading), Ok(()));
    // Not those who do not wait for it.
    let mut moving = claims();
    moving.hold(&network, &straight, id(8), None);
    assert_eq!(moving.grant(&network, &left, &leading), Err(id(8)));
}

#[test]
fn who_has_a_higher_rank_and_comes_soon_is_let_through() {
    let network = network();
    let [left, straight, _] = left_turn(&network).map(|it| way(&network, it));
    for (eta_secs, rank, lets) in [(2.0, 2, true), (2.0, 1, false), (5.0, 2, false)] {
        let mut claims = Claims::default();
        claims.wish(&network, &straight, &Asker { eta_secs, ..asker(1, rank) });
        let wanted = if lets { Err(id(1)) } else { Ok(()) };
        assert_eq!(claims.grant(&network, &left, &asker(2, 1)), wanted, "{eta_secs} s, {rank}");
    }
}

/// A car on a lane, turned from its direction by so much and this fast.
fn car(network: &Network, (lane, at_m): (LaneId, f32), turn_rad: f32, mps: f32) -> Body {
    let point = network.lane(lane).unwrap().at(at_m);
    let heading_rad = point.heading_rad + turn_rad;
    let forward = schemas::Vec3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
    Body {
        id: id(1),
        is_walker: false,
        is_urgent: false,
        centre_m: point.point_m,
        forward,
        half_m: schemas::Vec3::new(2.4, 0.9, 0.8),
        velocity_mps: forward * mps,
    }
}

#[test]
fn blue_lights_are_at_a_junction_when_their_front_is() {
    let network = network();
    let [_, straight, _] = left_turn(&network);
    let before = *network.lane(straight).unwrap().previous.first().unwrap();
    let end_m = network.lane(before).unwrap().length_m();
    for (left_m, eta_secs) in [(12.4, 2.0), (1.0, 0.0)] {
        let body = car(&network, (before, end_m - left_m), 0.0, 5.0);
        let mut claims = Claims::default();
        claims.occupy(&network, &Body { is_urgent: true, ..body });
        let told = claims.told(&network, straight).unwrap();
        let wish = told.wishes.iter().find(|wish| wish.lane == straight).unwrap();
        assert!((wish.asker.eta_secs - eta_secs).abs() < 0.02, "{wish:?}");
    }
}

#[test]
fn who_asks_nobody_holds_what_it_is_on_and_may_enter_soon() {
    let network = network();
    let [left, straight, _] = left_turn(&network);
    let before = *network.lane(straight).unwrap().previous.first().unwrap();
    let end_m = network.lane(before).unwrap().length_m();
    let left = way(&network, left);
    let grant = |lane: LaneId, at_m: f32, turn_rad: f32, mps: f32| {
        let body = car(&network, (lane, at_m), turn_rad, mps);
        let mut claims = Claims::default();
        claims.occupy(&network, &body);
        claims.grant(&network, &left, &asker(2, 1))
    };
    assert_eq!(grant(straight, 3.0, 0.0, 0.0), Err(id(1)), "on it");
    assert_eq!(grant(straight, 3.0, std::f32::consts::PI, 0.0), Ok(()), "against it");
    assert_eq!(grant(before, end_m - 4.0, 0.0, 0.0), Err(id(1)), "at its entry");
    assert_eq!(grant(before, end_m - 15.0, 0.0, 8.0), Err(id(1)), "soon at its entry");
    assert_eq!(grant(before, end_m - 15.0, 0.0, 0.0), Ok(()), "far from its entry");
}

#[test]
fn nobody_waits_inside_a_junction_for_traffic_from_the_side_or_behind_a_sign() {
    let network = network();
    let [left, straight, crossing] = left_turn(&network).map(|it| way(&network, it));
    let mut claims = Claims::default();
    assert_eq!(claims.grant(&network, &straight, &asker(1, 1)), Ok(()));
    assert_eq!(claims.grant_part(&network, &left, &asker(2, 0)), None);
    let mut claims = Claims::default();
    assert_eq!(claims.grant(&network, &crossing, &asker(1, 1)), Ok(()));
    assert_eq!(claims.grant_part(&network, &left, &asker(2, 1)), None);
}

/// A left turn of our towns that oncoming traffic crosses where nobody has room to wait before
/// it, and a way of that traffic; it meets nobody else there.
fn short_left_turn() -> (Network, [LaneId; 2]) {
    let towns = ["Town03_Opt", "Town05_Opt", "Town07_Opt", "Town02_Opt"];
    let found = towns.into_iter().find_map(|town| {
        let text = roads::town::build(town).unwrap();
        let network = Network::new(&roads::Map::parse(town, &text).unwrap());
        let lanes = (0..network.lane_count() as LaneId).find_map(|id| {
            let lane = network.lane(id)?;
            let oncoming = lane.conflicts.iter().filter(|conflict| {
                network.lane(conflict.lane).is_some_and(|other| other.is_oncoming(lane))
            });
            let first = oncoming.min_by(|a, b| a.from_m.total_cmp(&b.from_m))?;
            let short = (BEFORE_M..BEFORE_M + INSIDE_M_MIN).contains(&first.from_m);
            let joins = network.lane(first.lane)?.joins(lane);
            Some([id, first.lane]).filter(|_| short && !joins)
        });
        Some((network, lanes?))
    });
    found.unwrap()
}

#[test]
fn nobody_waits_inside_a_junction_before_he_is_well_inside() {
    let (network, [left, straight]) = short_left_turn();
    let [left, straight] = [left, straight].map(|it| way(&network, it));
    let mut claims = Claims::default();
    assert_eq!(claims.grant(&network, &straight, &asker(1, 1)), Ok(()));
    assert_eq!(claims.grant(&network, &left, &asker(2, 1)), Err(id(1)));
    assert_eq!(claims.grant_part(&network, &left, &asker(2, 1)), None);
}

/// Two ways through one junction, of which the second comes from the right of the first.
fn from_right(network: &Network) -> [LaneId; 2] {
    let lanes = (0..network.lane_count() as LaneId).find_map(|id| {
        let lane = network.lane(id)?;
        let mut met = lane.conflicts.iter().map(|conflict| conflict.lane);
        let right = met.find(|other| {
            network.lane(*other).is_some_and(|other| other.is_from_first_side_of(lane))
        });
        Some([id, right?])
    });
    lanes.unwrap()
}

#[test]
fn of_equals_who_comes_from_the_right_goes_first() {
    let network = network();
    let [left, right] = from_right(&network).map(|it| way(&network, it));
    let [a, b] = [&left, &right].map(|way| network.lane(way.lanes[0]).unwrap().at(0.0));
    let turn_rad = crate::network::wrapped(b.heading_rad - a.heading_rad);
    assert!(turn_rad > 0.0, "who drives to the left comes from the right: {turn_rad}");
    for (rank, other_rank, lets) in [(1, 1, true), (0, 0, false), (2, 1, false), (2, 2, false)] {
        let mut claims = Claims::default();
        claims.wish(&network, &right, &Asker { eta_secs: 2.0, ..asker(1, other_rank) });
        let wanted = if lets { Err(id(1)) } else { Ok(()) };
        assert_eq!(claims.grant(&network, &left, &asker(2, rank)), wanted, "{rank}, {other_rank}");
        let mut claims = Claims::default();
        claims.wish(&network, &left, &Asker { eta_secs: 2.0, ..asker(1, 1) });
        assert_eq!(claims.grant(&network, &right, &asker(2, 1)), Ok(()));
    }
}

#[test]
fn a_circle_is_of_those_who_wait_for_each_other_and_not_of_those_behind_it() {
    let mut claims = Claims::default();
    for (number, held) in [
        (1, Held::Behind(id(2))),
        (2, Held::Room(id(3))),
        (3, Held::Beside(id(1))),
        (4, Held::Behind(id(3))),
        (5, Held::Behind(id(6))),
        (6, Held::Line),
    ] {
        claims.wait(id(number), held);
    }
    let found = [1, 2, 3, 4, 5, 6].map(|number| claims.is_in_circle(id(number)));
    assert_eq!(found, [true, true, true, false, false, false]);
}
