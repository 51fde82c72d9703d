//! Roads of one direction that begin and end away from the middle of their junctions.

use super::course::{Bend, Pose, direction};
use super::plan::{End, Plan};
use super::profile::Profile;

/// A road of one direction, as traffic drives it: around corners, from one junction into another.
/// The places are those of its left border.
pub(super) struct OneWay<'a> {
    /// The junction, and where the road begins.
    pub(super) from: (usize, [f64; 2]),
    pub(super) bends: &'a [Bend],
    /// The junction, and where the road ends.
    pub(super) to: (usize, [f64; 2]),
    pub(super) profile: Profile,
}

impl OneWay<'_> {
    pub(super) fn add(&self, plan: &mut Plan) {
        let ((from, start), (to, end)) = (self.from, self.to);
        let first = self.bends.first().map_or(end, |bend| bend.at);
        let last = self.bends.last().map_or(start, |bend| bend.at);
        let from = End::at(from, Pose::new(start, direction(start, first)));
        let to = End::at(to, Pose::new(end, direction(end, last)));
        plan.connect(from, to, self.bends, self.profile);
    }
}
