//! A town as it will be written: roads, junctions, signals and objects as plain numbers.

use super::course::length_m;

/// A piece of a reference line.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) heading_rad: f64,
    pub(super) length_m: f64,
    /// 0 for a line.
    pub(super) curvature: f64,
}

/// What a road's link names.
#[derive(Clone, Copy, Debug)]
pub(super) enum LinkTo {
    Junction(u32),
    /// A road, and whether it is entered at its end.
    Road {
        id: u32,
        at_end: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LaneKind {
    /// For nobody.
    None,
    Driving,
    Parking,
    Biking,
    Median,
    Shoulder,
    Sidewalk,
}

impl LaneKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Driving => "driving",
            Self::Parking => "parking",
            Self::Biking => "biking",
            Self::Median => "median",
            Self::Shoulder => "shoulder",
            Self::Sidewalk => "sidewalk",
        }
    }
}

/// The line on the outer side of a lane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LineKind {
    Broken,
    Solid,
    Kerb,
    None,
}

#[derive(Clone, Debug)]
pub(super) struct LaneDraft {
    pub(super) id: i32,
    pub(super) kind: LaneKind,
    /// Along its section, from whose start they count.
    pub(super) widths: Vec<Cubic>,
    pub(super) line: LineKind,
    pub(super) predecessor: Option<i32>,
    pub(super) successor: Option<i32>,
}

impl LaneDraft {
    /// A lane right of the reference line that is only there so that others have their numbers.
    pub(super) fn without_width(number: i32) -> Self {
        Self {
            id: -number,
            kind: LaneKind::None,
            widths: vec![Cubic::flat(0.0, 0.0)],
            line: LineKind::None,
            predecessor: None,
            successor: None,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct SectionDraft {
    pub(super) start_s: f64,
    /// All lanes but the centre lane.
    pub(super) lanes: Vec<LaneDraft>,
}

/// A height or a width from `start_s` on: `a + b t + c t² + d t³`, `t` metres behind it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cubic {
    pub(super) start_s: f64,
    pub(super) abcd: [f64; 4],
}

impl Cubic {
    /// The same everywhere.
    pub(super) fn flat(start_s: f64, value: f64) -> Self {
        Self { start_s, abcd: [value, 0.0, 0.0, 0.0] }
    }

    /// From value to value over a length, level at both.
    pub(super) fn smooth(start_s: f64, length_m: f64, ends: [f64; 2]) -> Self {
        Self::sloped(start_s, length_m, ends, [0.0; 2])
    }

    /// From value to value over a length, with these slopes at both.
    pub(super) fn sloped(
        start_s: f64,
        length_m: f64,
        [from, to]: [f64; 2],
        [first, last]: [f64; 2],
    ) -> Self {
        let rise = to - from;
        let c = 3.0 * rise / length_m.powi(2) - (2.0 * first + last) / length_m;
        let d = -2.0 * rise / length_m.powi(3) + (first + last) / length_m.powi(2);
        Self { start_s, abcd: [from, first, c, d] }
    }

    pub(super) fn value(&self, s: f64) -> f64 {
        let [a, b, c, d] = self.abcd;
        let t = s - self.start_s;
        a + t * (b + t * (c + t * d))
    }

    pub(super) fn times(&self, factor: f64) -> Self {
        Self { abcd: self.abcd.map(|k| k * factor), ..*self }
    }

    /// The same curve, told from another place on.
    pub(super) fn told_from(&self, start_s: f64) -> Self {
        let [_, b, c, d] = self.abcd;
        let t = start_s - self.start_s;
        let slope = b + t * (2.0 * c + t * 3.0 * d);
        Self { start_s, abcd: [self.value(start_s), slope, c + 3.0 * d * t, d] }
    }
}

#[derive(Clone, Debug)]
pub(super) struct RoadDraft {
    pub(super) id: u32,
    pub(super) junction: Option<u32>,
    pub(super) limit_kmh: u32,
    pub(super) predecessor: LinkTo,
    pub(super) successor: LinkTo,
    pub(super) pieces: Vec<Piece>,
    pub(super) rises: Vec<Cubic>,
    /// Whether the middle line is painted.
    pub(super) centre_line: bool,
    pub(super) sections: Vec<SectionDraft>,
    pub(super) objects: Vec<ObjectDraft>,
    pub(super) signals: Vec<SignalDraft>,
    /// Lights that hold driving lanes of this road at its start.
    pub(super) held_by: Option<u32>,
}

impl RoadDraft {
    pub(super) fn length_m(&self) -> f64 {
        length_m(&self.pieces)
    }

    /// The point at road coordinate `s`, `t` metres left of the reference line.
    pub(super) fn place(&self, s: f64, t: f64) -> [f64; 2] {
        let mut along_m = s;
        for piece in &self.pieces {
            if along_m <= piece.length_m {
                return piece.pose_at(along_m).left(t).at;
            }
            along_m -= piece.length_m;
        }
        let last = self.pieces.last().map(|piece| piece.pose_at(piece.length_m));
        last.map_or([0.0; 2], |end| end.left(t).at)
    }

    pub(super) fn height_m(&self, s: f64) -> f64 {
        let rise = self.rises.iter().rfind(|rise| rise.start_s <= s);
        rise.map_or(0.0, |rise| rise.value(s))
    }

    /// The id of the lane of a kind with this sign, at the road's start or at its end.
    pub(super) fn end_lane(&self, at_end: bool, sign: i32, kind: LaneKind) -> Option<i32> {
        let section = if at_end { self.sections.last() } else { self.sections.first() }?;
        let lane = |lane: &&LaneDraft| lane.id.signum() == sign && lane.kind == kind;
        section.lanes.iter().find(lane).map(|lane| lane.id)
    }

    /// Ids of the outer and of the inner driving lane right of the reference line.
    pub(super) fn driving_right(&self) -> Option<[i32; 2]> {
        let lanes = self.sections.first()?.lanes.iter();
        let driving = lanes.filter(|lane| lane.id < 0 && lane.kind == LaneKind::Driving);
        let ids = driving.map(|lane| lane.id);
        ids.clone().min().zip(ids.max()).map(<[i32; 2]>::from)
    }
}

/// A traffic light's post or a sign.
#[derive(Clone, Debug)]
pub(super) struct SignalDraft {
    pub(super) id: u32,
    pub(super) kind: SignalKind,
    pub(super) s: f64,
    pub(super) t: f64,
    /// Sign of the lanes whose traffic it faces.
    pub(super) lane_sign: i32,
    /// Numbers of the innermost and the outermost lane it is valid for, counted outward from 1.
    pub(super) lanes: [i32; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalKind {
    /// Holds the connecting roads that refer to it, and no lane beside itself.
    Light,
    Stop,
    Yield,
    SpeedLimit {
        kmh: u32,
    },
}

#[derive(Clone, Debug)]
pub(super) struct ObjectDraft {
    pub(super) object_type: &'static str,
    pub(super) name: &'static str,
    pub(super) s: f64,
    pub(super) t: f64,
    pub(super) z_offset_m: f64,
    pub(super) heading_rad: f64,
    pub(super) length_m: f64,
    pub(super) width_m: f64,
    pub(super) height_m: f64,
    /// Corners `(u, v)`; empty for a plain box.
    pub(super) outline: Vec<[f64; 2]>,
}

#[derive(Clone, Debug)]
pub(super) struct ConnectionDraft {
    pub(super) incoming: u32,
    pub(super) connecting: u32,
    /// Lane of the incoming road, lane of the connecting road.
    pub(super) lanes: Vec<(i32, i32)>,
}

#[derive(Clone, Debug)]
pub(super) struct JunctionDraft {
    pub(super) id: u32,
    pub(super) connections: Vec<ConnectionDraft>,
    /// Ids of its controllers, in the order of their phases.
    pub(super) controllers: Vec<u32>,
}

/// Lights that are green together.
#[derive(Clone, Debug)]
pub(super) struct ControllerDraft {
    pub(super) id: u32,
    pub(super) lights: Vec<u32>,
}

#[derive(Clone, Debug, Default)]
pub(super) struct TownDraft {
    /// Streets first, in the order of the plan.
    pub(super) roads: Vec<RoadDraft>,
    pub(super) junctions: Vec<JunctionDraft>,
    pub(super) controllers: Vec<ControllerDraft>,
    pub(super) signal_count: u32,
}

impl TownDraft {
    pub(super) fn road(&self, id: u32) -> Option<&RoadDraft> {
        self.roads.iter().find(|road| road.id == id)
    }

    pub(super) fn road_mut(&mut self, id: u32) -> Option<&mut RoadDraft> {
        self.roads.iter_mut().find(|road| road.id == id)
    }

    /// Adds an object where the world coordinates say, to the nearest road with a straight piece
    /// beside it; where there is none, to the nearest with a bend beside it. Without such a road
    /// nothing is added.
    pub(super) fn place(&mut self, at: [f64; 2], heading_rad: f64, mut object: ObjectDraft) {
        let Some((index, s, t, road_heading_rad)) =
            self.beside(at, true).or_else(|| self.beside(at, false))
        else {
            return;
        };
        if let Some(road) = self.roads.get_mut(index) {
            (object.s, object.t) = (s, t);
            object.heading_rad = heading_rad - road_heading_rad;
            road.objects.push(object);
        }
    }

    /// The nearest road with a straight piece, or with a bend, beside a point: its index, road
    /// coordinates of the point, and the direction of the road there.
    fn beside(&self, at: [f64; 2], straight: bool) -> Option<(usize, f64, f64, f64)> {
        let mut best: Option<(usize, f64, f64, f64)> = None;
        for (index, road) in self.roads.iter().enumerate() {
            let mut start_s = 0.0;
            for piece in &road.pieces {
                let [along_m, t] = piece.local(at);
                if (piece.curvature == 0.0) == straight
                    && (0.0..=piece.length_m).contains(&along_m)
                    && best.is_none_or(|(_, _, known_t, _)| t.abs() < known_t.abs())
                {
                    let heading_rad = piece.pose_at(along_m).heading_rad;
                    best = Some((index, start_s + along_m, t, heading_rad));
                }
                start_s += piece.length_m;
            }
        }
        best
    }
}
