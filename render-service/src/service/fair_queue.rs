//! A bounded queue from which tenants take equal shares of somebody's time, and sessions equal
//! shares of their tenant's.

use std::collections::{BTreeMap, VecDeque};

use schemas::{Error, ErrorCode, Tenant, WorldId};

/// Whose turn it is: a tenant and a session of it.
pub(crate) type Whose = (Tenant, WorldId);

/// Things that wait.
///
/// Who has used least comes first; within a session the oldest. Of what somebody does not use a
/// little is saved up: what those miss meanwhile who ask again as soon as they are answered.
///
/// - **Source:** start-time fair queueing (Goyal, Vin, Cheng, 1996) with costs that are corrected
///   once they are known, at two levels.
#[derive(Debug)]
pub(crate) struct FairQueue<T> {
    tenants: Shares<Tenant, Sessions<T>>,
    saved_max: u64,
    count: usize,
    count_max: usize,
}

type Sessions<T> = Shares<WorldId, VecDeque<T>>;

/// Those who share, and what each has used.
#[derive(Debug)]
struct Shares<K, W> {
    /// What whoever was served last had used.
    served: u64,
    of: BTreeMap<K, Share<W>>,
}

#[derive(Debug)]
struct Share<W> {
    used: u64,
    waiting: W,
}

/// What may wait.
trait Waiting: Default {
    fn count(&self) -> usize;
}

impl<T> Waiting for VecDeque<T> {
    fn count(&self) -> usize {
        self.len()
    }
}

impl<T> Waiting for Sessions<T> {
    fn count(&self) -> usize {
        self.of.values().map(|share| share.waiting.len()).sum()
    }
}

impl<K, W> Default for Shares<K, W> {
    fn default() -> Self {
        Self { served: 0, of: BTreeMap::new() }
    }
}

impl<K: Ord + Clone, W: Waiting> Shares<K, W> {
    /// The share of somebody who has something to wait from now on.
    fn joined(&mut self, key: K, saved_max: u64) -> &mut W {
        let used_min = self.served.saturating_sub(saved_max);
        let share = self.share(key);
        if share.waiting.count() == 0 {
            share.used = share.used.max(used_min);
        }
        &mut share.waiting
    }

    fn share(&mut self, key: K) -> &mut Share<W> {
        let served = self.served;
        self.of.entry(key).or_insert_with(|| Share { used: served, waiting: W::default() })
    }

    /// Those who wait, the one who has used least first.
    fn in_order(&self) -> Vec<K> {
        let waiting = self.of.iter().filter(|(_, share)| share.waiting.count() > 0);
        let mut waiting: Vec<_> = waiting.map(|(key, share)| (share.used, key)).collect();
        waiting.sort();
        waiting.into_iter().map(|(_, key)| key.clone()).collect()
    }

    /// Notes that somebody is served, and who could not be though it was his turn: to them nothing
    /// is owed for it.
    fn serve(&mut self, key: &K, passed_over: &[K]) {
        self.served = self.served.max(self.of.get(key).map_or(0, |share| share.used));
        for key in passed_over {
            if let Some(share) = self.of.get_mut(key) {
                share.used = share.used.max(self.served);
            }
        }
    }

    fn charge(&mut self, key: &K, cost: i64) {
        let share = self.share(key.clone());
        share.used = share.used.saturating_add_signed(cost);
    }

    /// Forgets those who wait for nothing and would get no more and no less as newcomers.
    fn forget_idle(&mut self, saved_max: u64) {
        let used_min = self.served.saturating_sub(saved_max);
        self.of.retain(|_, share| share.waiting.count() > 0 || share.used > used_min);
    }
}

impl<T> FairQueue<T> {
    /// Of so many things, whose costs are counted in any unit; this much may be saved up.
    pub(crate) fn new(count_max: usize, saved_max: u64) -> Self {
        Self { tenants: Shares::default(), saved_max, count: 0, count_max }
    }

    /// Appends.
    ///
    /// One tenant alone may use half of the room, so that a backlog never shuts others out.
    ///
    /// # Errors
    /// The thing itself with [`ErrorCode::Capacity`] when there is no room.
    pub(crate) fn push(&mut self, (tenant, session): Whose, thing: T) -> Result<(), (T, Error)> {
        let waiting = self.tenants.of.get(&tenant).map_or(0, |share| share.waiting.count());
        if self.count >= self.count_max || waiting >= self.count_max.div_ceil(2) {
            let error =
                Error::new(ErrorCode::Capacity, "too many pictures are waiting to be drawn")
                    .wanted(format_args!(
                        "at most {} jobs, half of them of one tenant",
                        self.count_max
                    ))
                    .found(format_args!("{} jobs, {waiting} of {tenant}", self.count));
            return Err((thing, error));
        }
        let saved_max = self.saved_max;
        self.tenants.forget_idle(saved_max);
        let sessions = self.tenants.joined(tenant, saved_max);
        sessions.forget_idle(saved_max);
        sessions.joined(session, saved_max).push_back(thing);
        self.count += 1;
        Ok(())
    }

    /// Puts back what was taken and is not done, before all others of its session.
    pub(crate) fn put_back(&mut self, (tenant, session): Whose, thing: T) {
        self.tenants.share(tenant).waiting.share(session).waiting.push_front(thing);
        self.count += 1;
    }

    /// Takes the next thing that may be taken now.
    pub(crate) fn take(
        &mut self,
        may_be_taken: impl Fn(&Tenant, &T) -> bool,
    ) -> Option<(Whose, T)> {
        let tenants = self.tenants.in_order();
        for (at, tenant) in tenants.iter().enumerate() {
            let sessions = &mut self.tenants.share(tenant.clone()).waiting;
            let in_order = sessions.in_order();
            let may_go = |session: &WorldId| {
                let waiting = sessions.of.get(session).and_then(|share| share.waiting.front());
                waiting.is_some_and(|thing| may_be_taken(tenant, thing))
            };
            let Some(place) = in_order.iter().position(may_go) else { continue };
            let (passed_over, session) = (in_order.get(..place)?, *in_order.get(place)?);
            sessions.serve(&session, passed_over);
            let thing = sessions.share(session).waiting.pop_front()?;
            self.tenants.serve(tenant, tenants.get(..at)?);
            self.count -= 1;
            return Some(((tenant.clone(), session), thing));
        }
        None
    }

    /// Adds to what somebody has used, or takes from it what was too much.
    pub(crate) fn charge(&mut self, (tenant, session): &Whose, cost: i64) {
        self.tenants.charge(tenant, cost);
        self.tenants.share(tenant.clone()).waiting.charge(session, cost);
    }

    /// What each session waits for first, by tenant; who has used least comes first.
    pub(crate) fn first_of_each(&self) -> Vec<(&Tenant, &T)> {
        let tenants = self.tenants.in_order();
        let tenants = tenants.iter().filter_map(|tenant| self.tenants.of.get_key_value(tenant));
        let firsts = tenants.flat_map(|(tenant, share)| {
            let sessions = &share.waiting;
            let sessions = sessions.in_order().into_iter();
            sessions.filter_map(move |session| {
                Some((tenant, share.waiting.of.get(&session)?.waiting.front()?))
            })
        });
        firsts.collect()
    }

    /// Takes out all for which this holds.
    pub(crate) fn remove(&mut self, is_wanted: impl Fn(&T) -> bool) -> Vec<T> {
        let mut removed = Vec::new();
        for tenant in self.tenants.of.values_mut() {
            for session in tenant.waiting.of.values_mut() {
                let (out, left) =
                    std::mem::take(&mut session.waiting).into_iter().partition(&is_wanted);
                session.waiting = left;
                removed.extend::<VecDeque<T>>(out);
            }
        }
        self.count -= removed.len();
        removed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(tenant: &str, session: u64) -> Whose {
        (tenant.parse().unwrap(), WorldId::new(session).unwrap())
    }

    /// Somebody who asks again as soon as there is an answer.
    struct Asker {
        whose: Whose,
        cost: u64,
        got: u64,
    }

    /// Serves slices of at most 30 until so much time is gone; who is answered asks again after a
    /// pause of 1.
    fn served(mut askers: Vec<Asker>, time: u64) -> Vec<Asker> {
        let mut queue = FairQueue::new(64, 60);
        let mut asking: Vec<(u64, usize)> = (0..askers.len()).map(|at| (0, at)).collect();
        let mut now = 0;
        while now < time {
            for (_, at) in asking.extract_if(.., |(when, _)| *when <= now) {
                queue.push(askers[at].whose.clone(), (at, askers[at].cost)).unwrap();
            }
            let Some((whose, (at, left))) = queue.take(|_, _| true) else {
                now += 1;
                continue;
            };
            let slice = left.min(30);
            // An estimate that is wrong by half, and what it was in truth.
            queue.charge(&whose, (slice / 2) as i64);
            queue.charge(&whose, (slice - slice / 2) as i64);
            now += slice;
            askers[at].got += slice;
            if left > slice {
                queue.put_back(whose, (at, left - slice));
            } else {
                asking.push((now + 1, at));
            }
        }
        askers
    }

    /// The design's goal: at least 80 % of an eighth each.
    #[test]
    fn seven_small_tenants_beside_a_wild_one_get_their_eighths() {
        let mut askers: Vec<Asker> = (0..32)
            .map(|session| Asker { whose: of("wild", session + 1), cost: 2_000, got: 0 })
            .collect();
        let small =
            |at: u64| Asker { whose: of(&format!("small-{at}"), 100 + at), cost: 8, got: 0 };
        askers.extend((0..7).map(small));
        let time = 80_000;
        let served = served(askers, time);
        for asker in served.iter().skip(32) {
            let share = asker.got as f64 / (time as f64 / 8.0);
            assert!(share >= 0.8, "{:?} got {share:.2} of its eighth", asker.whose);
        }
        let wild: u64 = served.iter().take(32).map(|asker| asker.got).sum();
        assert!(wild >= time / 10, "the wild one got {wild} of {time}");
    }

    #[test]
    fn sessions_of_a_tenant_share_what_it_gets() {
        let costs = [2_000, 2_000, 100, 8];
        let askers = costs.iter().zip(1..);
        let askers = askers.map(|(cost, at)| Asker { whose: of("one", at), cost: *cost, got: 0 });
        let served = served(askers.collect(), 40_000);
        for asker in &served {
            assert!(asker.got >= 8_000, "{:?} got {} of 10000", asker.whose, asker.got);
        }
    }

    #[test]
    fn what_is_not_used_is_not_saved_up() {
        let mut queue = FairQueue::new(16, 0);
        for _ in 0..4 {
            queue.push(of("busy", 1), "busy").unwrap();
        }
        for _ in 0..2 {
            let (whose, _) = queue.take(|_, _| true).unwrap();
            queue.charge(&whose, 1_000);
        }
        for _ in 0..4 {
            queue.push(of("late", 2), "late").unwrap();
        }
        let mut order = Vec::new();
        while let Some((whose, who)) = queue.take(|_, _| true) {
            queue.charge(&whose, 1_000);
            order.push(who);
        }
        assert_eq!(order, ["late", "busy", "late", "busy", "late", "late"]);
        assert_eq!(queue.count, 0);
    }

    #[test]
    fn who_must_wait_for_something_else_holds_up_nobody_and_is_owed_nothing() {
        let mut queue = FairQueue::new(16, 0);
        for _ in 0..3 {
            queue.push(of("aside", 1), "aside").unwrap();
            queue.push(of("other", 2), "other").unwrap();
        }
        let mut take = |may: &dyn Fn(&&str) -> bool| {
            let (whose, who) = queue.take(|_, thing| may(thing)).unwrap();
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
}
