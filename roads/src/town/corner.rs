//! Corners of junctions: where the sidewalk goes on from an arm to the next, counter-clockwise.

use super::course::{Pose, join};
use super::draft::{LaneDraft, LaneKind, LineKind, Piece};
use super::plan::Arm;
use super::profile::{Edge, Side};

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
    /// itself: `first` is the number of the first of them, counted outward from 1.
    pub(super) fn lanes(&self, first: i32) -> Vec<LaneDraft> {
        let sides = self.sides();
        let signs = [self.from.inbound_sign(), -self.to.inbound_sign()];
        // The lane of each arm that is so many places outside of its driving lanes.
        let links = |outward: i32, is_there: fn(Edge) -> bool| {
            [0, 1].map(|end| {
                let side = sides[end].filter(|side| is_there(side.edge))?;
                Some(signs[end] * (side.driving + outward))
            })
        };
        let is_walked = self.has_sidewalk();
        let [predecessor, successor] = links(1, |_| true);
        let mut lanes = vec![LaneDraft {
            id: -first,
            kind: LaneKind::Shoulder,
            width_m: sides.map(|side| side.map_or(0.0, |side| side.edge.shoulder_m())),
            line: if is_walked { LineKind::Kerb } else { LineKind::None },
            predecessor,
            successor,
        }];
        if is_walked {
            let widths_m = sides.map(|side| side.map_or(0.0, |side| side.edge.sidewalk_m()));
            let widest_m = widths_m[0].max(widths_m[1]);
            let [predecessor, successor] = links(2, Edge::has_sidewalk);
            lanes.push(LaneDraft {
                id: -first - 1,
                kind: LaneKind::Sidewalk,
                width_m: widths_m.map(|width_m| if width_m > 0.0 { width_m } else { widest_m }),
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
