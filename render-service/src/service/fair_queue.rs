//! A bounded queue from which tenants take equal shares of somebody's time, and sessions equal
//! shares of their tenant's.

use std::collections::{BTreeMap, VecDeque};

use schemas::{Error, ErrorCode, Tenant, WorldId};

/// Whose turn it is: a tenant and a session of it.
pub(crate) type Whose = (Tenant, WorldId);

/// Tenants, and sessions of a tenant, of whom it is known what they have used though they wait for
/// nothing.
const IDLE_MAX: usize = 1_024;

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
    /// What a newcomer counts as having used: at least what anybody had who was served.
    served: u64,
    /// What was charged and has not moved `served` on yet.
    charged: i64,
    of: BTreeMap<K, Share<W>>,
}

#[derive(Debug)]
struct Share<W> {
    used: u64,
    waiting: W,
}

/// Whose turn it is, and who could not be served though it was theirs.
#[derive(Debug)]
pub(crate) struct Next {
    pub(crate) whose: Whose,
    tenants_passed: Vec<Tenant>,
    sessions_passed: Vec<WorldId>,
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
        Self { served: 0, charged: 0, of: BTreeMap::new() }
    }
}

impl<K: Ord + Clone, W: Waiting> Shares<K, W> {
    /// The share of somebody, who may be new.
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

    /// Whether somebody who joined now would come before another, who waits.
    fn comes_before(&self, key: &K, other: &K, saved_max: u64) -> bool {
        let used = |key: &K| self.of.get(key).map(|share| share.used);
        let joined = used(key).map(|used| used.max(self.served.saturating_sub(saved_max)));
        joined.zip(used(other)).is_some_and(|(joined, other)| joined < other)
    }

    /// Moves on by an equal part of what was charged for each of those who wait, though never past
    /// whoever has used most: newcomers are not before others for ever.
    fn advance(&mut self) {
        let Ok(charged) = u64::try_from(self.charged) else { return };
        let waiting = self.of.values().filter(|share| share.waiting.count() > 0).count();
        let part = charged.div_ceil(waiting.max(1) as u64);
        let used_max = self.of.values().map(|share| share.used).max().unwrap_or(0);
        self.served = self.served.max(used_max.min(self.served.saturating_add(part)));
        self.charged = 0;
    }

    /// Notes that somebody who still waits is served, and who could not be though it was his turn:
    /// to them nothing is owed for it.
    fn serve(&mut self, key: &K, passed_over: &[K]) {
        self.advance();
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
        self.charged = self.charged.saturating_add(cost);
    }

    /// Forgets those who wait for nothing and would get no more and no less as newcomers, and
    /// whoever has used least where there are too many others.
    fn forget_idle(&mut self, saved_max: u64) {
        let used_min = self.served.saturating_sub(saved_max);
        self.of.retain(|_, share| share.waiting.count() > 0 || share.used > used_min);
        if self.of.len() <= IDLE_MAX {
            return;
        }
        let idle = self.of.iter().filter(|(_, share)| share.waiting.count() == 0);
        let mut idle: Vec<_> = idle.map(|(key, share)| (share.used, key.clone())).collect();
        idle.sort();
        let excess = idle.len().saturating_sub(IDLE_MAX);
        for (_, key) in idle.into_iter().take(excess) {
            self.of.remove(&key);
        }
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
        let sessions = &mut self.tenants.share(tenant).waiting;
        sessions.forget_idle(saved_max);
        sessions.share(session).waiting.push_back(thing);
        self.count += 1;
        Ok(())
    }

    /// Puts back what was taken and is not done, before all others of its session.
    pub(crate) fn put_back(&mut self, (tenant, session): Whose, thing: T) {
        self.tenants.share(tenant).waiting.share(session).waiting.push_front(thing);
        self.count += 1;
    }

    /// Whose thing comes next, of those that may be taken now.
    pub(crate) fn next(&self, may_be_taken: impl Fn(&Tenant, &T) -> bool) -> Option<Next> {
        let mut tenants = self.tenants.in_order();
        for (at, tenant) in tenants.iter().enumerate() {
            let sessions = &self.tenants.of.get(tenant)?.waiting;
            let mut in_order = sessions.in_order();
            let may_go = |session: &WorldId| {
                let waiting = sessions.of.get(session).and_then(|share| share.waiting.front());
                waiting.is_some_and(|thing| may_be_taken(tenant, thing))
            };
            let Some(place) = in_order.iter().position(may_go) else { continue };
            let whose = (tenant.clone(), *in_order.get(place)?);
            in_order.truncate(place);
            tenants.truncate(at);
            return Some(Next { whose, tenants_passed: tenants, sessions_passed: in_order });
        }
        None
    }

    /// What comes next.
    pub(crate) fn front(&self, next: &Next) -> Option<&T> {
        let (tenant, session) = &next.whose;
        self.tenants.of.get(tenant)?.waiting.of.get(session)?.waiting.front()
    }

    /// Takes what comes next.
    pub(crate) fn take(&mut self, next: Next) -> Option<(Whose, T)> {
        let Next { whose, tenants_passed, sessions_passed } = next;
        let (tenant, session) = &whose;
        self.tenants.serve(tenant, &tenants_passed);
        let sessions = &mut self.tenants.share(tenant.clone()).waiting;
        sessions.serve(session, &sessions_passed);
        let thing = sessions.share(*session).waiting.pop_front()?;
        self.count -= 1;
        Some((whose, thing))
    }

    /// Whether somebody who waits for nothing would come before whoever comes next, asking now.
    pub(crate) fn is_owed(&self, (tenant, session): &Whose, next: &Next) -> bool {
        let (next_tenant, next_session) = &next.whose;
        if tenant != next_tenant {
            return self.tenants.comes_before(tenant, next_tenant, self.saved_max);
        }
        let sessions = self.tenants.of.get(tenant).map(|share| &share.waiting);
        sessions
            .is_some_and(|sessions| sessions.comes_before(session, next_session, self.saved_max))
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
mod tests;
