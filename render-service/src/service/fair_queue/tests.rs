use super::*;

fn of(tenant: &str, session: u64) -> Whose {
    (tenant.parse().unwrap(), WorldId::new(session).unwrap())
}

/// Takes the next thing that may be taken.
fn take<T>(queue: &mut FairQueue<T>, may_be_taken: impl Fn(&T) -> bool) -> Option<(Whose, T)> {
    let next = queue.next(|_, thing| may_be_taken(thing))?;
    queue.take(next)
}

#[test]
fn what_is_not_used_is_not_saved_up() {
    let mut queue = FairQueue::new(16, 0);
    for _ in 0..4 {
        queue.push(of("busy", 1), "busy").unwrap();
    }
    for _ in 0..2 {
        let (whose, _) = take(&mut queue, |_| true).unwrap();
        queue.charge(&whose, 1_000);
    }
    for _ in 0..4 {
        queue.push(of("late", 2), "late").unwrap();
    }
    let mut order = Vec::new();
    while let Some((whose, who)) = take(&mut queue, |_| true) {
        queue.charge(&whose, 1_000);
        order.push(who);
    }
    assert_eq!(order, ["late", "busy", "late", "busy", "late", "late"]);
    assert_eq!(queue.count, 0);
}

/// How many things a tenant that was served once gets, when it comes back after another had ten,
/// before that one has its turn; both ask for four.
fn turns_of_one_who_comes_back(saved_max: u64) -> usize {
    let mut queue = FairQueue::new(16, saved_max);
    let serve = |queue: &mut FairQueue<bool>| {
        let (whose, is_back) = take(queue, |_| true).unwrap();
        queue.charge(&whose, 1_000);
        is_back
    };
    queue.push(of("back", 2), true).unwrap();
    serve(&mut queue);
    for _ in 0..10 {
        queue.push(of("busy", 1), false).unwrap();
        serve(&mut queue);
    }
    for _ in 0..4 {
        queue.push(of("busy", 1), false).unwrap();
        queue.push(of("back", 2), true).unwrap();
    }
    (0..8).take_while(|_| serve(&mut queue)).count()
}

#[test]
fn who_comes_back_has_saved_no_more_than_may_be_saved() {
    assert_eq!([0, 2_000, 20_000].map(turns_of_one_who_comes_back), [2, 2, 4]);
}

#[test]
fn who_has_used_less_than_the_next_is_owed_by_tenant_and_by_session() {
    let mut queue = FairQueue::new(16, u64::MAX);
    let used = [("one", 1, 3_000), ("one", 2, 1_000), ("two", 3, 2_000), ("three", 4, 9_000)];
    for (tenant, session, cost) in used {
        queue.charge(&of(tenant, session), cost);
    }
    queue.push(of("one", 1), ()).unwrap();
    let next = queue.next(|_, _| true).unwrap();
    let is_owed = |tenant, session| queue.is_owed(&of(tenant, session), &next);
    assert!(is_owed("two", 3) && is_owed("one", 2));
    assert!(!is_owed("three", 4) && !is_owed("one", 1) && !is_owed("nobody", 5));
}

#[test]
fn what_is_put_back_comes_before_the_rest_of_its_session() {
    let mut queue = FairQueue::new(16, 0);
    queue.push(of("one", 1), "first").unwrap();
    queue.push(of("one", 1), "second").unwrap();
    let (whose, first) = take(&mut queue, |_| true).unwrap();
    queue.put_back(whose, first);
    assert_eq!([(); 2].map(|()| take(&mut queue, |_| true).unwrap().1), ["first", "second"]);
}

#[test]
fn who_must_wait_for_something_else_holds_up_nobody_and_is_owed_nothing() {
    let mut queue = FairQueue::new(16, 0);
    for _ in 0..3 {
        queue.push(of("aside", 1), "aside").unwrap();
        queue.push(of("other", 2), "other").unwrap();
    }
    let mut take = |may: &dyn Fn(&&str) -> bool| {
        let (whose, who) = take(&mut queue, may).unwrap();
        queue.charge(&whose, 1_000);
        who
    };
    let not_aside = |who: &&str| *who != "aside";
    assert_eq!([take(&not_aside), take(&not_aside)], ["other"; 2]);
    let all = |_: &&str| true;
    assert_eq!([take(&all), take(&all), take(&all)], ["aside", "aside", "other"]);
    assert_eq!(queue.remove(|who| *who == "aside"), ["aside"]);
    assert_eq!(queue.count, 0);
}

/// Sessions that are known after so many have asked for one picture each, eight at a time.
fn known_after(sessions: u64, saved_max: u64) -> usize {
    let mut queue = FairQueue::new(64, saved_max);
    for session in 1..=sessions {
        queue.push(of("one", session), session).unwrap();
        if session >= 8 {
            let (whose, _) = take(&mut queue, |_| true).unwrap();
            queue.charge(&whose, 8);
        }
    }
    queue.tenants.of.values().map(|share| share.waiting.of.len()).sum()
}

#[test]
fn sessions_of_one_picture_each_are_forgotten() {
    let known = known_after(10_000, 60);
    assert!(known <= 200, "{known} sessions are known");
    let known = known_after(2_000, u64::MAX);
    assert!(known <= IDLE_MAX + 16, "{known} sessions are known");
}

#[test]
fn a_session_that_has_paid_is_not_starved_by_newcomers() {
    let mut queue = FairQueue::new(64, 0);
    let paid = of("one", 1_000);
    queue.push(paid.clone(), 1_000).unwrap();
    take(&mut queue, |_| true).unwrap();
    queue.charge(&paid, 1_000);
    queue.push(paid.clone(), 1_000).unwrap();
    for session in 1..=4 {
        queue.push(of("one", session), session).unwrap();
    }
    let before = (5..100).position(|session| {
        let (whose, _) = take(&mut queue, |_| true).unwrap();
        queue.charge(&whose, 1_000);
        queue.push(of("one", session), session).unwrap();
        whose == paid
    });
    assert!(before.is_some_and(|before| before < 20), "{before:?} newcomers went before it");
}

#[test]
fn a_tenant_with_a_backlog_leaves_room_for_others() {
    let mut queue = FairQueue::new(4, 0);
    queue.push(of("many", 1), 1).unwrap();
    queue.push(of("many", 2), 2).unwrap();
    let (refused, error) = queue.push(of("many", 3), 3).unwrap_err();
    assert_eq!((refused, error.code), (3, ErrorCode::Capacity));
    queue.push(of("few", 1), 4).unwrap();
    queue.push(of("few", 1), 5).unwrap();
    assert_eq!(queue.push(of("other", 1), 6).unwrap_err().1.code, ErrorCode::Capacity);
}
