//! What a session knows of a world of its own that CARLA's clients may come into.

use std::collections::BTreeSet;

use schemas::{Error, Frame, ServiceId, WorldId};
use worlds::Seen;

use super::SessionContext;
use super::clock::Others;
use crate::world_port::Sharing;

pub(super) struct Opened {
    /// As whom the session ticks it.
    pub(super) participant: ServiceId,
    /// The first of the worlds that it goes on from.
    first: WorldId,
    /// Who shared its clock in the last step.
    guests: BTreeSet<ServiceId>,
    /// Whether the state to go on from may be another one than its ticks have told.
    is_changed: bool,
    /// Whether what is kept lacks something that others had done.
    is_behind: bool,
}

impl Opened {
    /// Has guests come into a world if they like.
    ///
    /// # Errors
    /// Those of the port.
    pub(super) async fn begin(context: &SessionContext, world: WorldId) -> Result<Self, Error> {
        let sharing = Sharing { world, stands_for: None, guests: Vec::new() };
        let participant = context.port.share_clock(sharing).await?;
        let (guests, is_changed, is_behind) = (BTreeSet::new(), false, false);
        Ok(Self { participant, first: world, guests, is_changed, is_behind })
    }

    /// Has them find the world that takes its place, whose clock is nobody's yet. Those of before
    /// are waited for, so that nothing happens without them.
    ///
    /// # Errors
    /// Those of the port.
    pub(super) async fn again(
        &self,
        context: &SessionContext,
        world: WorldId,
    ) -> Result<(), Error> {
        let guests = self.guests.iter().cloned().collect();
        let sharing = Sharing { world, stands_for: Some(self.first), guests };
        context.port.share_clock(sharing).await.map(drop)
    }

    /// A step is done beside others.
    pub(super) fn note_step(&mut self, others: Others) {
        self.is_behind |= others.have_acted;
        self.is_changed = self.is_behind;
        self.guests = others.guests;
    }

    /// A step broke off beside others.
    pub(super) fn note_broken_step(&mut self, others: Others) {
        self.is_behind |= others.have_acted;
        self.guests.extend(others.guests);
    }

    /// The state that is kept is that of this moment, whatever others have done since the step.
    pub(super) fn note_kept(&mut self) {
        (self.is_changed, self.is_behind) = (true, false);
    }

    /// Whether only a new state has all that was done.
    pub(super) fn is_behind(&self) -> bool {
        self.is_behind
    }
}

/// How far a world that is made from what is kept has to be as a frame shows it.
pub(super) fn seen<'a>(opened: Option<&Opened>, frame: &'a Frame) -> Seen<'a> {
    match opened.is_some_and(|opened| opened.is_changed) {
        true => Seen::WithOthers(frame),
        false => Seen::Alone(frame),
    }
}
