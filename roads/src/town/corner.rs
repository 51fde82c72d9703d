//! Corners of junctions: where the sidewalk goes on from an arm to the next, counter-clockwise.

use super::course::{Pose, join};
use super::draft::{Cubic, LaneDraft, LaneKind, LineKind, Piece, TownDraft};
use super::plan::Arm;
use super::profile::Side;

/// The corner between the approach of an arm and the exit of the next arm to its right.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub(super) from: Arm,
    pub(super) to: Arm,
}

impl Corner {
    /// The corners of a junction, in the order of its arms: each begins at the arm of its place.
    pub(super) fn all(arms: &[Arm]) -> Vec<Self> {
        let nexts = arms.iter().cycle().skip(1);
        arms.iter().zip(nexts).map(|(from, to)| Self { from: *from, to: *to }).collect()
    }

    fn sides(&self) -> [Option<Side>; 2] {
        [self.from.inbound(), self.to.outbound()]
    }

    /// Whether people walk around it: one arm's sidewalk is enough, it then ends at the other arm.
    pub(super) fn has_sidewalk(&self) -> bool {
        self.sides().into_iter().flatten().any(|side| side.edge.has_sidewalk())
    }

    /// Shoulder and sidewalk along the outer side of a way around this corner, or of the corner
    /// itself, over the length of that way: `first` is the number of the first of them, counted
    /// outward from 1.
    pub(super) fn lanes(&self, first: i32, length_m: f64, town: &TownDraft) -> Vec<LaneDraft> {
        let sides = self.sides();
        let links = |kind: LaneKind| {
            [(self.from, self.from.inbound_sign()), (self.to, -self.to.inbound_sign())]
                .map(|(arm, sign)| town.road(arm.street)?.end_lane(arm.ends_here, sign, kind))
        };
        let widths = |ends_m: [f64; 2]| vec![Cubic::smooth(0.0, length_m, ends_m)];
        let is_walked = self.has_sidewalk();
        let [predecessor, successor] = links(LaneKind::Shoulder);
        let mut lanes = vec![LaneDraft {
            id: -first,
            kind: LaneKind::Shoulder,
            widths: widths(sides.map(|side| side.map_or(0.0, |side| side.edge.shoulder_m()))),
            line: if is_walked { LineKind::Kerb } else { LineKind::None },
            predecessor,
            successor,
        }];
        if is_walked {
            let widths_m = sides.map(|side| side.map_or(0.0, |side| side.edge.sidewalk_m()));
            let widest_m = widths_m[0].max(widths_m[1]);
            let [predecessor, successor] = links(LaneKind::Sidewalk);
            lanes.push(LaneDraft {
                id: -first - 1,
                kind: LaneKind::Sidewalk,
                widths: widths(
                    widths_m.map(|width_m| if width_m > 0.0 { width_m } else { widest_m }),
                ),
                line: LineKind::None,
                predecessor,
                successor,
            });
        }
        lanes
    }

    /// The border of the lanes that vehicles use, from arm to arm.
    pub(super) fn pieces(&self) -> Vec<Piece> {
        let inner_m =
            |side: Option<Side>| side.map_or(0.0, |side| side.kerb_m() - side.edge.shoulder_m());
        let [before_m, after_m] = self.sides().map(inner_m);
        let start: Pose = self.from.entering().left(-before_m);
        join(start, self.to.pose.left(-after_m))
    }
}
