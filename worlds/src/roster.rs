//! What is known of the hosts that are up: a state machine that hears events and says what to do.
//!
//! | | unknown | heard | silent |
//! |---|---|---|---|
//! | it comes up | heard; open a way | heard; as another process: replaced | the same process: heard again; another: replaced |
//! | the bus hears it no more | | on this machine: silent, watch it; else forgotten | |
//! | nobody listens at its shortcut | | | forgotten |
//!
//! A process is known by its number, which is in the ids of its worlds: one that was started again
//! under the same name has another, and none of the worlds before.

use std::collections::{BTreeMap, BTreeSet};

use schemas::{Load, ServiceId, SplitMix64, WorldId};

use crate::placement::{Candidate, choose};

/// Which coming of a host is meant: what is told late of an earlier one is not about this one.
pub(crate) type Coming = u64;

/// The hosts that are up; `W` is the fast way to one.
#[derive(Debug)]
pub(crate) struct Roster<W> {
    hosts: BTreeMap<ServiceId, Known<W>>,
    comings: Coming,
    dice: SplitMix64,
}

/// What is known of one.
#[derive(Debug)]
struct Known<W> {
    coming: Coming,
    /// 0: not known yet.
    number: u32,
    /// Whether the process said the number itself, or made a world with it, since it came up.
    is_number_sure: bool,
    voice: Voice,
    is_draining: bool,
    load: Option<Load>,
    /// Worlds that were placed there since it told that.
    placed: u32,
    /// It refused one since then, as it has no room.
    is_full: bool,
    way: Option<Way<W>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Voice {
    /// On the bus.
    Heard,
    /// Not on the bus, and not proven dead: it stands still, or the machine is busy.
    Silent,
}

/// A way to a host.
#[derive(Clone, Debug)]
struct Way<W> {
    way: W,
    /// Whether it proves that the host lives.
    is_near: bool,
}

impl<W: Clone> Roster<W> {
    /// Nobody is up. The seed decides where new worlds go, and nothing else.
    pub(crate) fn new(seed: u64) -> Self {
        Self { hosts: BTreeMap::new(), comings: 0, dice: SplitMix64::new(seed) }
    }

    /// A host came up, with the number of its process, or 0. Gives its coming if a way to it is to
    /// be opened.
    pub(crate) fn come_up(&mut self, id: &ServiceId, number: u32) -> Option<Coming> {
        // One that is silent is not proven dead; on a machine that is so busy it may not come to
        // say its number.
        let is_same = |known: &&mut Known<W>| match number {
            0 => known.voice == Voice::Silent,
            number => known.number == number,
        };
        if let Some(known) = self.hosts.get_mut(id).filter(is_same) {
            known.voice = Voice::Heard;
            known.is_number_sure = number != 0;
            return None;
        }
        self.comings += 1;
        let known = Known {
            coming: self.comings,
            number,
            is_number_sure: number != 0,
            voice: Voice::Heard,
            is_draining: false,
            load: None,
            placed: 0,
            is_full: false,
            way: None,
        };
        self.hosts.insert(id.clone(), known);
        Some(self.comings)
    }

    /// The bus hears a host no more. Gives the way by which it is to be watched, if there is one.
    pub(crate) fn fall_silent(&mut self, id: &ServiceId) -> Option<(Coming, W)> {
        let known = self.hosts.get_mut(id)?;
        match &known.way {
            Some(Way { way, is_near: true }) => {
                known.voice = Voice::Silent;
                Some((known.coming, way.clone()))
            }
            _ => {
                self.hosts.remove(id);
                None
            }
        }
    }

    /// Nobody listens at the way to a host. One that is heard meanwhile serves at another.
    pub(crate) fn die(&mut self, id: &ServiceId, coming: Coming) {
        let is_meant = |known: &Known<W>| known.coming == coming && known.voice == Voice::Silent;
        if self.hosts.get(id).is_some_and(is_meant) {
            self.hosts.remove(id);
        }
    }

    /// A way was opened.
    pub(crate) fn open(&mut self, id: &ServiceId, coming: Coming, way: W, is_near: bool) {
        if let Some(known) = self.hosts.get_mut(id)
            && known.coming == coming
        {
            known.way = Some(Way { way, is_near });
        }
    }

    /// A host told how much it has to do.
    pub(crate) fn hear_load(&mut self, id: &ServiceId, load: Load) {
        if let Some(known) = self.hosts.get_mut(id) {
            (known.load, known.placed, known.is_full) = (Some(load), 0, false);
        }
    }

    /// Who drains may have changed. Gives whether it has.
    pub(crate) fn note_draining(&mut self, is_draining: impl Fn(&ServiceId) -> bool) -> bool {
        let mut has_changed = false;
        for (id, known) in &mut self.hosts {
            let now = is_draining(id);
            has_changed |= std::mem::replace(&mut known.is_draining, now) != now;
        }
        has_changed
    }

    /// A host had no room.
    pub(crate) fn note_full(&mut self, id: &ServiceId) {
        if let Some(known) = self.hosts.get_mut(id) {
            known.is_full = true;
        }
    }

    /// A host has made a world. If it did not say its number, and was taken for a process with
    /// another, the way to that one does not lead to it.
    pub(crate) fn note_world(&mut self, id: &ServiceId, world: WorldId) {
        let Some(known) = self.hosts.get_mut(id).filter(|known| !known.is_number_sure) else {
            return;
        };
        let before = std::mem::replace(&mut known.number, world.host());
        if before != 0 && before != known.number {
            known.way = None;
        }
        known.is_number_sure = true;
    }

    /// Where a new world goes, of all but some: one that takes new worlds, else one that is heard,
    /// else one that is silent. It counts as placed there.
    pub(crate) fn place(&mut self, but: &BTreeSet<ServiceId>) -> Option<(ServiceId, Option<W>)> {
        let is_left = |(id, _): &(&ServiceId, &Known<W>)| !but.contains(*id);
        let open: Vec<(&ServiceId, Candidate)> = self
            .hosts
            .iter()
            .filter(is_left)
            .filter(|(_, known)| known.is_open() && !known.is_full)
            .map(|(id, known)| (id, known.candidate()))
            .collect();
        let candidates: Vec<Candidate> = open.iter().map(|(_, candidate)| *candidate).collect();
        let chosen = choose(&candidates, &mut self.dice);
        let chosen = chosen.and_then(|index| open.get(index)).map(|(id, _)| (*id).clone());
        let worst_is_last = || {
            let left = self.hosts.iter().filter(is_left);
            let order =
                |known: &Known<W>| (known.voice == Voice::Silent, known.is_draining, known.is_full);
            left.min_by_key(|(_, known)| order(known)).map(|(id, _)| id.clone())
        };
        let id = chosen.or_else(worst_is_last)?;
        let known = self.hosts.get_mut(&id)?;
        known.placed = known.placed.saturating_add(1);
        let way = known.way.as_ref().map(|way| way.way.clone());
        Some((id, way))
    }

    /// Who has a world, and the way there.
    pub(crate) fn host_of(&self, world: WorldId) -> Option<(&ServiceId, Option<&W>)> {
        let (id, known) = self.with_number(world.host())?;
        Some((id, known.way.as_ref().map(|way| &way.way)))
    }

    /// Whether a world should be elsewhere: who has it drains, and somebody else takes new worlds.
    pub(crate) fn should_move(&self, world: WorldId) -> bool {
        let drains = self.with_number(world.host()).is_some_and(|(_, known)| known.is_draining);
        drains && self.is_open()
    }

    /// Whether the process that had a world is gone: who has not said its number may be it.
    pub(crate) fn is_gone(&self, world: WorldId) -> bool {
        self.hosts.values().all(|known| known.is_number_sure && known.number != world.host())
    }

    /// Those that are heard, by name, and the ways there.
    pub(crate) fn heard(&self) -> Vec<(ServiceId, Option<W>)> {
        let heard = self.hosts.iter().filter(|(_, known)| known.voice == Voice::Heard);
        let way = |known: &Known<W>| known.way.as_ref().map(|way| way.way.clone());
        heard.map(|(id, known)| (id.clone(), way(known))).collect()
    }

    /// Whether one is up.
    pub(crate) fn is_any_up(&self) -> bool {
        !self.hosts.is_empty()
    }

    /// Whether one is up that takes new worlds, or will when it has room again.
    pub(crate) fn is_open(&self) -> bool {
        self.hosts.values().any(Known::is_open)
    }

    fn with_number(&self, number: u32) -> Option<(&ServiceId, &Known<W>)> {
        self.hosts.iter().find(|(_, known)| known.number == number)
    }
}

impl<W> Known<W> {
    fn is_open(&self) -> bool {
        self.voice == Voice::Heard && !self.is_draining
    }

    fn candidate(&self) -> Candidate {
        let is_near = self.way.as_ref().is_some_and(|way| way.is_near);
        let is_known = self.number != 0 || self.load.is_some();
        Candidate { load: self.load, placed: self.placed, is_near, is_known }
    }
}

#[cfg(test)]
mod tests;
