//! Whether a vehicle passes a line before a red light.

use agents::{Network, RedLights};
use schemas::Vec3;
use serde::{Deserialize, Serialize};

/// What the lights showed at the line that a vehicle is at, or has passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) enum Seen {
    /// Not red, or not all along.
    #[default]
    Free,
    /// Red since it came.
    Red,
    /// Several lights have the line: which of them were red since it came.
    Several(RedLights),
    /// As before, and it has passed the line; it is not known yet which of them hold its way.
    Passed(RedLights),
}

/// The lights at a line, and which of them are red.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// The one that holds whoever is at the line.
    pub light: u32,
    /// All, in order; none where that is the only one.
    pub all: &'a [u32],
    pub is_red: &'a dyn Fn(u32) -> bool,
}

impl Line<'_> {
    fn red(&self) -> Seen {
        if self.all.is_empty() {
            return if (self.is_red)(self.light) { Seen::Red } else { Seen::Free };
        }
        Seen::Several(RedLights::of(self.light, self.all, self.is_red))
    }
}

impl Seen {
    /// Takes in what the lights show of the line that it is at, if it is at one; it `came` there
    /// now, or before.
    pub(super) fn look(&mut self, line: Option<Line<'_>>, came: bool) {
        let now = line.map(|line| line.red());
        *self = match (*self, now) {
            (Self::Passed(_), None) => *self,
            (_, Some(now)) if came => now,
            (Self::Red, Some(Self::Red)) => Self::Red,
            (Self::Several(red), Some(Self::Several(now))) => Self::Several(now.and(red)),
            _ => Self::Free,
        };
    }

    /// It passes the line of a light; whether it is known that it ran it.
    pub(super) fn pass(&mut self) -> bool {
        let seen = std::mem::take(self);
        if let Self::Several(red) = seen
            && !red.is_empty()
        {
            *self = Self::Passed(red);
        }
        seen == Self::Red
    }

    /// Whether it is not known yet whether it ran a light.
    pub(super) fn is_unclear(&self) -> bool {
        matches!(self, Self::Passed(_))
    }

    /// Where it has passed the line of several lights, of which some were red: whether it ran
    /// them, as soon as it is known which way it takes with its front there.
    pub(super) fn runs(&mut self, network: &Network, (front_m, forward): (Vec3, Vec3)) -> bool {
        let Self::Passed(red) = *self else { return false };
        let runs = red.hold_way(network, &front_m, &forward);
        if runs.is_some() {
            *self = Self::Free;
        }
        runs == Some(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What was seen by whoever came to a line of these lights, saw them red so, and passed it.
    fn passed(all: &[u32], red: &[&[u32]]) -> (bool, Seen) {
        let mut seen = Seen::default();
        for (index, red) in red.iter().enumerate() {
            let is_red = |light: u32| red.contains(&light);
            seen.look(Some(Line { light: 4, all, is_red: &is_red }), index == 0);
        }
        let runs = seen.pass();
        seen.look(None, true);
        (runs, seen)
    }

    #[test]
    fn a_light_alone_is_run_if_it_was_red_all_along() {
        assert_eq!(passed(&[], &[&[4], &[4]]), (true, Seen::Free));
        assert_eq!(passed(&[], &[&[4], &[], &[4]]), (false, Seen::Free));
        assert_eq!(passed(&[], &[&[], &[4]]), (false, Seen::Free), "it turned red at the line");
        assert_eq!(passed(&[], &[&[9]]), (false, Seen::Free), "another one's colour");
    }

    #[test]
    fn of_several_lights_those_are_kept_in_mind_that_were_red_all_along() {
        let all = [2, 4, 9];
        let unclear = |red: &[u32]| {
            (false, Seen::Passed(RedLights::of(4, &all, |light| red.contains(&light))))
        };
        assert_eq!(passed(&all, &[&[2, 9], &[2, 4, 9]]), unclear(&[2, 9]));
        assert_eq!(passed(&all, &[&[2, 9], &[9]]), unclear(&[9]));
        assert_eq!(passed(&all, &[&[2, 9], &[4]]), (false, Seen::Free));
    }
}
