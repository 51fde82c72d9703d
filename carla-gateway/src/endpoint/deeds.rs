//! What clients have done lately in the world of a session. Its state is kept by the session, which
//! knows of that only with a step; what came later is done again in the world that takes its place.

use std::collections::{BTreeSet, VecDeque};

use schemas::{ActorId, Command, CommandReply, Frame, Tick};
use worlds::bytes_of;

use crate::rpc::Refusal;

/// Bytes of deeds that are remembered; of more the earliest are forgotten.
const BYTES_MAX: usize = 1 << 20;

/// Commands in the order in which they were carried out, among the ticks.
#[derive(Default)]
pub(super) struct Deeds {
    done: VecDeque<Deed>,
    bytes: usize,
    /// Of no tick before this one all are known.
    since: Tick,
}

/// Commands, and the state that they led to; a tick is one without commands.
#[derive(Clone)]
struct Deed {
    after: (Tick, u64),
    commands: Vec<Command>,
    spawned: Vec<Option<ActorId>>,
    bytes: usize,
}

/// What is to be done again, and who has to come of it.
#[derive(Debug, PartialEq)]
pub(super) struct Again {
    pub(super) commands: Vec<Command>,
    pub(super) spawned: Vec<Option<ActorId>>,
}

/// Whom commands have brought, one for each.
pub(super) fn brought(replies: &[CommandReply]) -> Vec<Option<ActorId>> {
    replies.iter().map(|reply| reply.as_ref().ok().copied().flatten()).collect()
}

impl Deeds {
    /// Commands were carried out, and led to what a frame shows.
    pub(super) fn note(&mut self, frame: &Frame, commands: Vec<Command>, replies: &[CommandReply]) {
        if commands.is_empty() {
            return;
        }
        let bytes = size_of::<Deed>() + bytes_of(&commands);
        let after = (frame.tick, frame.state_hash);
        self.put(self.done.len(), Deed { after, commands, spawned: brought(replies), bytes });
    }

    /// The session's world has ticked. What was done after may have been told before.
    pub(super) fn note_tick(&mut self, frame: &Frame) {
        let index = self.done.partition_point(|deed| deed.after.0 < frame.tick);
        let (commands, spawned, bytes) = (Vec::new(), Vec::new(), size_of::<Deed>());
        let after = (frame.tick, frame.state_hash);
        self.put(index, Deed { after, commands, spawned, bytes });
    }

    fn put(&mut self, index: usize, deed: Deed) {
        self.bytes += deed.bytes;
        self.done.insert(index, deed);
        while self.bytes > BYTES_MAX
            && let Some(first) = self.done.pop_front()
        {
            self.bytes -= first.bytes;
            self.since = self.since.max(Tick(first.after.0.0 + 1));
        }
    }

    /// What has to be done again in a world that is as a frame shows it, in order: all that came
    /// after this state; where others have led it to one that was never seen here, all of its tick
    /// and later, but for actors that are there already.
    ///
    /// # Errors
    /// More was done than is remembered.
    pub(super) fn again(&self, frame: &Frame) -> Result<Vec<Again>, Refusal> {
        let state = (frame.tick, frame.state_hash);
        let known = self.done.iter().rposition(|deed| deed.after == state);
        if known.is_none() && frame.tick < self.since {
            return Err(Refusal("more was done there since than is remembered".to_owned()));
        }
        let present: BTreeSet<ActorId> = frame.actors.iter().map(|actor| actor.id).collect();
        let is_there = |actor: &Option<ActorId>| {
            known.is_none() && actor.is_some_and(|actor| present.contains(&actor))
        };
        let from = known.map_or_else(
            || self.done.partition_point(|deed| deed.after.0 < frame.tick),
            |it| it + 1,
        );
        let later = self.done.iter().skip(from).map(|deed| {
            let pairs = deed.commands.iter().zip(&deed.spawned);
            let missing = pairs.filter(|(_, actor)| !is_there(actor));
            let (commands, spawned) = missing.map(|(one, actor)| (one.clone(), *actor)).unzip();
            Again { commands, spawned }
        });
        Ok(later.filter(|again| !again.commands.is_empty()).collect())
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorKind, ActorState, MapRef, Pose, Vec3, WorldId};

    use super::*;

    fn frame(tick: u64, state_hash: u64) -> Frame {
        let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
        Frame { tick: Tick(tick), state_hash, ..Frame::empty(WorldId::of_host(1, 1), map) }
    }

    fn spawn() -> Command {
        Command::spawn("vehicle.audi.tt", Pose::identity(), Vec3::zeros())
    }

    fn end(number: u32) -> Command {
        Command::DestroyActor { actor: id(number) }
    }

    fn id(number: u32) -> ActorId {
        ActorId::new(number).unwrap()
    }

    fn again(commands: &[Command], spawned: &[Option<ActorId>]) -> Again {
        Again { commands: commands.to_vec(), spawned: spawned.to_vec() }
    }

    #[test]
    fn what_came_after_a_state_is_done_again() {
        let mut deeds = Deeds::default();
        deeds.note_tick(&frame(3, 30));
        deeds.note(&frame(3, 31), vec![spawn()], &[Ok(Some(id(5)))]);
        deeds.note(&frame(3, 32), vec![end(90)], &[Ok(None)]);
        // Was told late.
        deeds.note(&frame(4, 41), vec![end(91)], &[Ok(None)]);
        deeds.note_tick(&frame(4, 40));
        let spawned = || again(&[spawn()], &[Some(id(5))]);
        let (first, last) = (again(&[end(90)], &[None]), || again(&[end(91)], &[None]));
        assert_eq!(deeds.again(&frame(3, 30)).unwrap(), [spawned(), first, last()]);
        assert_eq!(deeds.again(&frame(3, 32)).unwrap(), [last()]);
        assert_eq!(deeds.again(&frame(4, 40)).unwrap(), [last()]);
        assert_eq!(deeds.again(&frame(4, 41)).unwrap(), []);
    }

    #[test]
    fn where_others_were_at_work_nobody_is_brought_twice() {
        let mut deeds = Deeds::default();
        deeds.note_tick(&frame(3, 30));
        let replies = [Ok(Some(id(5))), Ok(Some(id(6))), Ok(None)];
        deeds.note(&frame(3, 31), vec![spawn(), spawn(), end(90)], &replies);
        let mut seen = frame(3, 99);
        let pose = Pose::identity();
        seen.actors.push(ActorState::at_rest(id(5), ActorKind::Vehicle, 0, pose));
        let wanted = again(&[spawn(), end(90)], &[Some(id(6)), None]);
        assert_eq!(deeds.again(&seen).unwrap(), [wanted]);
        // Of the step before, which had not been done.
        assert_eq!(deeds.again(&frame(2, 98)).unwrap().len(), 1);
        assert_eq!(deeds.again(&frame(4, 97)).unwrap(), []);
    }

    #[test]
    fn what_is_forgotten_is_not_passed_over() {
        let mut deeds = Deeds::default();
        deeds.note(&frame(1, 10), vec![end(90)], &[Ok(None)]);
        let many = vec![end(90); BYTES_MAX / size_of::<Command>() - 1];
        deeds.note(&frame(2, 20), many, &[]);
        assert!(deeds.again(&frame(1, 99)).is_err());
        assert!(deeds.again(&frame(2, 99)).is_ok() && deeds.bytes <= BYTES_MAX);
    }

    #[test]
    fn a_state_that_is_known_is_gone_on_from_though_more_of_its_tick_is_forgotten() {
        let mut deeds = Deeds::default();
        for hash in [10, 11] {
            deeds.note(&frame(1, hash), vec![end(90)], &[Ok(None)]);
        }
        let room = BYTES_MAX - 2 * size_of::<Deed>() - size_of::<Command>();
        let count = room / size_of::<Command>();
        deeds.note(&frame(2, 20), vec![end(90); count], &vec![Ok(None); count]);
        assert!(deeds.again(&frame(1, 99)).is_err());
        assert_eq!(deeds.again(&frame(1, 11)).unwrap().len(), 1);
    }
}
