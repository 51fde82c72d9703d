//! Every event in every state, without a bus.

mod simulation;

use super::*;

const NEAR: bool = true;
const FAR: bool = false;

fn id(name: &str) -> ServiceId {
    name.parse().unwrap()
}

fn nobody() -> BTreeSet<ServiceId> {
    BTreeSet::new()
}

fn world(number: u32) -> WorldId {
    WorldId::of_host(number, 1)
}

/// Hosts `a` and so on with the numbers 1 and so on.
fn roster(names: &[&str], is_near: bool) -> Roster<u32> {
    let mut roster = Roster::new(1);
    for (index, name) in names.iter().enumerate() {
        let number = index as u32 + 1;
        let coming = roster.come_up(&id(name), number).unwrap();
        roster.open(&id(name), coming, number, is_near);
    }
    roster
}

fn places(roster: &mut Roster<u32>, count: usize) -> BTreeMap<ServiceId, usize> {
    let mut placed = BTreeMap::new();
    for _ in 0..count {
        *placed.entry(roster.place(&nobody()).unwrap().0).or_default() += 1;
    }
    placed
}

#[test]
fn who_is_heard_is_asked_by_the_way_that_was_opened_to_it() {
    let mut roster: Roster<u32> = Roster::new(1);
    assert!(!roster.is_any_up() && roster.place(&nobody()).is_none());
    let coming = roster.come_up(&id("a"), 1).unwrap();
    assert_eq!(roster.place(&nobody()), Some((id("a"), None)));
    assert_eq!(roster.host_of(world(1)), Some((&id("a"), None)));
    roster.open(&id("a"), coming, 7, NEAR);
    assert_eq!(roster.place(&nobody()), Some((id("a"), Some(7))));
    assert_eq!(roster.host_of(world(1)), Some((&id("a"), Some(&7))));
    assert_eq!(roster.host_of(world(2)), None, "nobody has this world");
}

#[test]
fn a_world_is_gone_with_its_process_unless_one_has_not_said_its_number() {
    let mut roster = roster(&["a", "b"], NEAR);
    assert!(!roster.is_gone(world(1)) && roster.is_gone(world(3)));
    let (coming, _) = roster.fall_silent(&id("a")).unwrap();
    assert!(!roster.is_gone(world(1)), "it may live");
    roster.die(&id("a"), coming);
    assert!(roster.is_gone(world(1)));
    roster.come_up(&id("c"), 0);
    assert!(!roster.is_gone(world(1)), "c may have it");
    roster.note_world(&id("c"), world(7));
    assert!(roster.is_gone(world(1)) && !roster.is_gone(world(7)));
}

#[test]
fn who_falls_silent_on_another_machine_is_forgotten() {
    let mut roster = roster(&["a"], FAR);
    assert_eq!(roster.fall_silent(&id("a")), None);
    assert!(!roster.is_any_up() && roster.host_of(world(1)).is_none());
    assert_eq!(roster.fall_silent(&id("a")), None, "nobody is not heard");
}

#[test]
fn who_falls_silent_on_this_machine_keeps_its_worlds_until_it_is_dead() {
    let mut roster = roster(&["a", "b"], NEAR);
    let (coming, way) = roster.fall_silent(&id("a")).unwrap();
    assert_eq!(way, 1);
    assert_eq!(roster.host_of(world(1)), Some((&id("a"), Some(&1))));
    assert_eq!(roster.heard(), [(id("b"), Some(2))]);
    assert_eq!(places(&mut roster, 20), BTreeMap::from([(id("b"), 20)]));
    roster.die(&id("a"), coming + 1);
    assert!(roster.host_of(world(1)).is_some(), "another coming was meant");
    roster.die(&id("a"), coming);
    assert!(roster.host_of(world(1)).is_none() && roster.is_any_up());
}

#[test]
fn the_only_one_is_asked_though_it_is_silent_or_drains() {
    let mut roster = roster(&["a"], NEAR);
    roster.note_draining(|_| true);
    assert!(!roster.is_open());
    assert_eq!(roster.place(&nobody()).unwrap().0, id("a"));
    roster.note_draining(|_| false);
    roster.fall_silent(&id("a")).unwrap();
    assert!(!roster.is_open());
    assert_eq!(roster.place(&nobody()).unwrap().0, id("a"));
}

#[test]
fn a_process_that_is_heard_again_is_the_same_and_stale_news_of_its_death_is_not_believed() {
    let mut roster = roster(&["a"], NEAR);
    let (coming, _) = roster.fall_silent(&id("a")).unwrap();
    assert_eq!(roster.come_up(&id("a"), 1), None, "its way is open already");
    roster.die(&id("a"), coming);
    assert_eq!(roster.host_of(world(1)), Some((&id("a"), Some(&1))));
    roster.fall_silent(&id("a")).unwrap();
    assert_eq!(roster.come_up(&id("a"), 0), None, "it is too busy to say its number");
    assert_eq!(roster.host_of(world(1)), Some((&id("a"), Some(&1))));
}

#[test]
fn another_process_of_the_same_name_has_none_of_the_worlds_before() {
    for is_silent in [false, true] {
        let mut roster = roster(&["a"], NEAR);
        let silent = is_silent.then(|| roster.fall_silent(&id("a")).unwrap());
        let coming = roster.come_up(&id("a"), 9).unwrap();
        assert!(roster.host_of(world(1)).is_none());
        assert_eq!(roster.host_of(world(9)), Some((&id("a"), None)));
        if let Some((earlier, _)) = silent {
            roster.die(&id("a"), earlier);
            roster.open(&id("a"), earlier, 1, NEAR);
        }
        assert_eq!(roster.host_of(world(9)), Some((&id("a"), None)), "old news");
        roster.open(&id("a"), coming, 2, NEAR);
        assert_eq!(roster.host_of(world(9)), Some((&id("a"), Some(&2))));
    }
}

#[test]
fn who_did_not_say_its_number_is_known_by_its_first_world() {
    let mut roster: Roster<u32> = Roster::new(1);
    roster.come_up(&id("a"), 0).unwrap();
    assert!(roster.host_of(world(5)).is_none());
    roster.note_world(&id("a"), world(5));
    roster.note_world(&id("a"), world(6));
    assert!(roster.host_of(world(5)).is_some() && roster.host_of(world(6)).is_none());
}

#[test]
fn who_was_taken_for_the_process_before_is_known_by_its_first_world() {
    for number in [1, 6] {
        let mut roster = roster(&["a"], NEAR);
        roster.note_world(&id("a"), world(6));
        assert!(roster.host_of(world(6)).is_none(), "an answer of another process is late");
        roster.fall_silent(&id("a")).unwrap();
        assert_eq!(roster.come_up(&id("a"), 0), None);
        roster.note_world(&id("a"), world(number));
        let way = (number == 1).then_some(&1);
        assert_eq!(roster.host_of(world(number)), Some((&id("a"), way)));
        assert_eq!(roster.host_of(world(1)).is_some(), number == 1);
    }
}

#[test]
fn new_worlds_go_past_who_drains_and_theirs_should_move() {
    let mut roster = roster(&["a", "b"], NEAR);
    assert!(roster.note_draining(|host| *host == id("a")));
    assert!(!roster.note_draining(|host| *host == id("a")), "nothing new");
    assert!(roster.should_move(world(1)) && !roster.should_move(world(2)));
    assert_eq!(places(&mut roster, 20), BTreeMap::from([(id("b"), 20)]));
    roster.note_draining(|_| true);
    assert!(!roster.should_move(world(1)), "nobody else takes it");
    roster.note_draining(|_| false);
    assert_eq!(places(&mut roster, 100).len(), 2);
}

#[test]
fn who_is_full_is_asked_again_after_its_next_load_and_before_nobody() {
    let mut roster = roster(&["a", "b"], NEAR);
    roster.note_full(&id("a"));
    assert_eq!(places(&mut roster, 20), BTreeMap::from([(id("b"), 20)]));
    let but = BTreeSet::from([id("b")]);
    assert_eq!(roster.place(&but).unwrap().0, id("a"));
    assert!(roster.place(&BTreeSet::from([id("a"), id("b")])).is_none());
    roster.hear_load(&id("a"), Load { worlds: 1, worlds_max: 2, busy: 0.0 });
    roster.hear_load(&id("b"), Load { worlds: 2, worlds_max: 2, busy: 0.0 });
    assert_eq!(roster.place(&nobody()).unwrap().0, id("a"));
}

#[test]
fn worlds_are_spread_also_before_any_load_was_told() {
    let placed = places(&mut roster(&["a", "b", "c"], NEAR), 300);
    assert!(placed.values().all(|count| (95..=105).contains(count)), "{placed:?}");
    assert_eq!(placed, places(&mut roster(&["a", "b", "c"], NEAR), 300), "the same seed");
}
