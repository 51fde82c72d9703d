//! Lane changes of a way: the one under the vehicle, and those ahead.

use std::ops::RangeInclusive;

use super::{Leg, Path};
use crate::network::{LaneId, LanePoint, Network};
use crate::route::across;

/// The next lane change of a way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NextChange {
    /// Of its leg.
    pub index: usize,
    /// From the vehicle to where it begins; below zero inside it.
    pub begins_m: f32,
    /// Changes one after the other, with it; from where it begins to where they must have ended.
    pub count: u8,
    pub room_m: f32,
    pub to_left: bool,
}

impl Path {
    /// Whether the first leg leads to the lane beside.
    pub(crate) fn is_changing(&self) -> bool {
        self.legs.front().is_some_and(|leg| leg.onto.is_some())
    }

    /// Whether the first leg leads to the lane on the left; `None` if it changes no lane.
    pub(crate) fn changes_to_left(&self, network: &Network) -> Option<bool> {
        let leg = self.legs.front()?;
        let onto = leg.onto?;
        Some(network.lane(leg.lane)?.left.is_some_and(|left| left.lane == onto))
    }

    /// The same way as if the change of a leg were done, abreast of the vehicle.
    pub(crate) fn changed(&self, network: &Network, index: usize) -> Option<Self> {
        let leg = self.legs.get(index)?;
        let (lane, onto) = (network.lane(leg.lane)?, network.lane(leg.onto?)?);
        let mut path = Self::default();
        path.push(Leg {
            lane: leg.onto?,
            from_m: lane.abreast_m(self.at_on(leg), onto),
            to_m: lane.abreast_m(leg.to_m, onto),
            onto: None,
        });
        self.legs.iter().skip(index + 1).for_each(|leg| path.push(*leg));
        Some(path)
    }

    /// The lane that a leg changes to, abreast of the vehicle.
    pub(crate) fn beside_point(&self, network: &Network, index: usize) -> Option<LanePoint> {
        let leg = self.legs.get(index)?;
        let (lane, onto) = (network.lane(leg.lane)?, network.lane(leg.onto?)?);
        Some(onto.at(lane.abreast_m(self.at_on(leg), onto)))
    }

    /// Where the vehicle is on the lane of a leg, at the earliest where the leg begins if it is on
    /// another lane.
    fn at_on(&self, leg: &Leg) -> f32 {
        let own = self.legs.front().is_some_and(|first| first.lane == leg.lane);
        if own { self.at_m } else { leg.from_m }
    }

    /// Ends a change on the lane that the vehicle is nearer to; the way ends with that lane.
    pub(crate) fn settle(&mut self, network: &Network) {
        let Some(here) = self.place(network) else { return };
        let Some(lane) = network.lane(here.lane) else { return };
        *self = Self::default();
        let (from_m, to_m) = (here.at_m, lane.length_m());
        self.push(Leg { lane: here.lane, from_m, to_m, onto: None });
    }

    /// The change under the vehicle, or the first one ahead.
    pub(crate) fn next_change(&self, network: &Network) -> Option<NextChange> {
        let mut legs = self.ahead().enumerate();
        let (index, (begins_m, leg)) = legs.find(|(_, (_, leg))| leg.onto.is_some())?;
        let onto = leg.onto?;
        let lane = network.lane(leg.lane)?;
        let to_left = lane.left.is_some_and(|left| left.lane == onto);
        let marked = [lane.left, lane.right].into_iter().flatten().find(|side| side.lane == onto);
        let end_m = marked.map_or(leg.to_m, |side| side.to_m).min(lane.length_m());
        let (_, last) = self.chain(index);
        let chain = self.legs.iter().take(last + 1).skip(index);
        let count = chain.filter(|leg| leg.onto.is_some()).count().min(100) as u8;
        let last = self.legs.get(last)?;
        let ends_m = network.lane(last.lane)?.abreast_m(last.to_m, lane);
        let room_m = end_m.min(ends_m).max(leg.to_m) - leg.from_m;
        Some(NextChange { index, begins_m, count, room_m, to_left })
    }

    /// First and last leg of the changes one after the other around the one of a leg: from the leg
    /// on the own lane before it to the one on the last lane after it.
    fn chain(&self, index: usize) -> (usize, usize) {
        let lane_of = |index: usize| self.legs.get(index).map(|leg| leg.lane);
        let before = index.checked_sub(1).filter(|before| lane_of(*before) == lane_of(index));
        let mut last = index;
        while let Some(leg) = self.legs.get(last)
            && lane_of(last + 1) == Some(leg.last_lane())
            && (leg.onto.is_some()
                || self.legs.get(last + 1).is_some_and(|next| next.onto.is_some()))
        {
            last += 1;
        }
        (before.unwrap_or(index), last)
    }

    /// The same way with its next change, and those that follow it at once, begun some metres
    /// ahead of the vehicle at the earliest.
    pub(crate) fn postponed(&self, network: &Network, ahead_m: f32) -> Option<Self> {
        let next = self.next_change(network)?;
        let (first, last) = self.chain(next.index);
        let begin = self.legs.get(first)?;
        let end = self.legs.get(last).filter(|end| end.onto.is_none())?;
        let length_m = network.lane(begin.lane)?.length_m();
        let begins_m = (self.at_on(begin) + ahead_m).clamp(begin.from_m, length_m);
        let mut run = vec![begin.lane];
        run.extend((first..=last).filter_map(|index| self.legs.get(index)?.onto));
        let whole_m = network.lane(end.lane)?.length_m();
        let ends_m = Some(end.to_m).filter(|to_m| *to_m < whole_m - 0.01);
        let mut legs = vec![Leg { to_m: begins_m, onto: None, ..*begin }];
        across(network, &run, (begins_m, ends_m), &mut legs);
        Some(self.with(first..=last, legs))
    }

    /// The same way with other legs instead of some; the first leg begins where it did.
    pub(crate) fn with(
        &self,
        instead: RangeInclusive<usize>,
        legs: impl IntoIterator<Item = Leg>,
    ) -> Self {
        let before = self.legs.iter().take(*instead.start()).copied();
        let after = self.legs.iter().skip(instead.end() + 1).copied();
        Self { at_m: self.at_m, legs: before.chain(legs).chain(after).collect() }
    }

    /// The way that changes from here on to a lane beside the vehicle's, to the end of that lane.
    pub(crate) fn aside(&self, network: &Network, onto: LaneId, length_m: f32) -> Option<Self> {
        let (id, lane) = self.own(network)?;
        let target = network.lane(onto)?;
        let to_m = self.at_m + length_m;
        let mut path = Self::default();
        path.push(Leg { lane: id, from_m: self.at_m, to_m, onto: Some(onto) });
        let from_m = lane.abreast_m(to_m, target);
        path.push(Leg { lane: onto, from_m, to_m: target.length_m(), onto: None });
        Some(path)
    }
}
