//! Who shares a world's clock, and who of them has asked for the next tick.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, ServiceId};

/// Participants of one world, at most.
const PARTICIPANTS_MAX: usize = 64;
/// How long one waits for the others, at most: less than whoever asked does.
const WAIT_MAX: Duration = Duration::from_secs(20);

/// The participants of one world. `T` is what each of them waits with.
pub(super) struct Roster<T> {
    members: BTreeMap<ServiceId, Member<T>>,
    /// Since when somebody waits; later for who joins later.
    round_began: Option<Instant>,
}

struct Member<T> {
    lease: Duration,
    /// With what, and since when.
    waiting: Option<(T, Instant)>,
}

impl<T> Default for Roster<T> {
    fn default() -> Self {
        Self { members: BTreeMap::new(), round_began: None }
    }
}

impl<T> Roster<T> {
    /// Whether nobody shares the clock: then everybody may tick.
    pub(super) fn is_empty(&self) -> bool {
        self.members.is_empty()
    }

    /// Whether somebody takes part.
    pub(super) fn has(&self, name: &ServiceId) -> bool {
        self.members.contains_key(name)
    }

    /// Who takes part beside this one, by name.
    pub(super) fn others(&self, name: &ServiceId) -> Vec<ServiceId> {
        self.members.keys().filter(|other| *other != name).cloned().collect()
    }

    /// Takes a participant in, or changes its lease.
    ///
    /// # Errors
    /// `Capacity`.
    pub(super) fn join(
        &mut self,
        now: Instant,
        name: ServiceId,
        lease: Duration,
    ) -> Result<(), Error> {
        if let Some(member) = self.members.get_mut(&name) {
            member.lease = lease;
            return Ok(());
        }
        if self.members.len() >= PARTICIPANTS_MAX {
            return Err(Error::new(ErrorCode::Capacity, "too many share the world's clock")
                .wanted(format_args!("at most {PARTICIPANTS_MAX}")));
        }
        self.members.insert(name, Member { lease, waiting: None });
        self.round_began = self.round_began.map(|_| now);
        Ok(())
    }

    /// Lets a participant go, with what it waited with.
    pub(super) fn leave(&mut self, name: &ServiceId) -> Option<T> {
        self.members.remove(name)?.waiting.map(|(with, _)| with)
    }

    /// Whether a participant may wait now.
    ///
    /// # Errors
    /// `InvalidArgument` for a stranger, nobody, or who waits already.
    pub(super) fn check(&self, name: Option<&ServiceId>) -> Result<(), Error> {
        let refuse = |why: &str| Error::new(ErrorCode::InvalidArgument, why);
        match name {
            None if self.is_empty() => Ok(()),
            None => Err(refuse("the world's clock is shared").wanted("a tick of a participant")),
            Some(name) => match self.members.get(name) {
                None => Err(refuse("no participant of this world, or no longer")
                    .wanted("a request to share its clock first")
                    .found(name)),
                Some(Member { waiting: Some(_), .. }) => {
                    Err(refuse("the participant waits already").found(name))
                }
                Some(_) => Ok(()),
            },
        }
    }

    /// A participant waits for the next tick.
    pub(super) fn wait(&mut self, now: Instant, name: &ServiceId, with: T) {
        if let Some(member) = self.members.get_mut(name) {
            member.waiting = Some((with, now));
            self.round_began.get_or_insert(now);
        }
    }

    /// When the lease of the next one that is waited for ends, or the next one has waited for as
    /// long as one may.
    pub(super) fn next_end(&self) -> Option<Instant> {
        let began = self.round_began?;
        let end = |member: &Member<T>| match &member.waiting {
            Some((_, since)) => *since + WAIT_MAX,
            None => began + member.lease,
        };
        self.members.values().map(end).min()
    }

    /// Lets go of those who were waited for longer than their lease.
    pub(super) fn expire(&mut self, now: Instant) -> Vec<ServiceId> {
        let Some(began) = self.round_began else { return Vec::new() };
        let is_over = |member: &Member<T>| member.waiting.is_none() && began + member.lease <= now;
        let over: Vec<ServiceId> = self
            .members
            .iter()
            .filter(|(_, member)| is_over(member))
            .map(|(name, _)| name.clone())
            .collect();
        self.members.retain(|_, member| !is_over(member));
        over
    }

    /// What those wait with who have waited for as long as one may. They take part as before.
    pub(super) fn take_overdue(&mut self, now: Instant) -> Vec<T> {
        let is_overdue = |(_, since): &mut (T, Instant)| *since + WAIT_MAX <= now;
        let members = self.members.values_mut();
        let taken = members.filter_map(|member| member.waiting.take_if(is_overdue));
        let overdue: Vec<T> = taken.map(|(with, _)| with).collect();
        if self.members.values().all(|member| member.waiting.is_none()) {
            self.round_began = None;
        }
        overdue
    }

    /// What all wait with, ordered by name, once nobody is missing; a new round begins.
    pub(super) fn complete(&mut self) -> Vec<T> {
        if self.members.values().any(|member| member.waiting.is_none()) {
            return Vec::new();
        }
        self.drain()
    }

    /// What those who wait wait with, ordered by name.
    pub(super) fn drain(&mut self) -> Vec<T> {
        self.round_began = None;
        let waiting = self.members.values_mut().filter_map(|member| member.waiting.take());
        waiting.map(|(with, _)| with).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(text: &str) -> ServiceId {
        text.parse().unwrap()
    }

    fn roster(now: Instant, names: &[&str]) -> Roster<u32> {
        let mut roster = Roster::default();
        for text in names {
            roster.join(now, name(text), Duration::from_millis(100)).unwrap();
        }
        roster
    }

    #[test]
    fn a_round_is_complete_when_nobody_is_missing() {
        let now = Instant::now();
        let mut roster = roster(now, &["b", "a"]);
        roster.wait(now, &name("b"), 2);
        assert!(roster.complete().is_empty());
        assert!(roster.check(Some(&name("b"))).is_err(), "it waits already");
        roster.wait(now, &name("a"), 1);
        assert_eq!(roster.complete(), [1, 2]);
        assert!(roster.complete().is_empty() && roster.next_end().is_none());
    }

    #[test]
    fn who_stays_away_longer_than_its_lease_takes_part_no_more() {
        let now = Instant::now();
        let mut roster = roster(now, &["dead", "alive"]);
        assert!(roster.expire(now + Duration::from_hours(1)).is_empty(), "nobody waits");
        roster.wait(now, &name("alive"), 1);
        let end = roster.next_end().unwrap();
        assert_eq!(end, now + Duration::from_millis(100));
        assert!(roster.expire(end - Duration::from_millis(1)).is_empty());
        assert_eq!(roster.expire(end), [name("dead")]);
        assert_eq!(roster.complete(), [1]);
        assert!(roster.check(Some(&name("dead"))).is_err());
    }

    #[test]
    fn nobody_waits_for_ever_and_who_has_waited_takes_part_still() {
        let now = Instant::now();
        let mut roster = Roster::default();
        roster.join(now, name("patient"), Duration::from_hours(1)).unwrap();
        roster.join(now, name("guest"), Duration::from_secs(5)).unwrap();
        roster.wait(now, &name("guest"), 1);
        let end = roster.next_end().unwrap();
        assert_eq!(end, now + WAIT_MAX);
        assert!(roster.take_overdue(end - Duration::from_millis(1)).is_empty());
        assert_eq!(roster.take_overdue(end), [1]);
        assert_eq!(roster.next_end(), None);
        roster.wait(end, &name("guest"), 2);
        roster.wait(end, &name("patient"), 3);
        assert_eq!(roster.complete(), [2, 3]);
    }

    #[test]
    fn strangers_and_the_nameless_are_refused_while_the_clock_is_shared() {
        let now = Instant::now();
        let mut roster = roster(now, &["a"]);
        assert!(roster.check(None).is_err() && roster.check(Some(&name("c"))).is_err());
        assert_eq!(roster.leave(&name("a")), None);
        assert!(roster.check(None).is_ok() && roster.is_empty());
    }
}
