//! A town as it will be written: roads, junctions and objects as plain numbers.

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
    Driving,
    Shoulder,
    Sidewalk,
}

impl LaneKind {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Driving => "driving",
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

#[derive(Clone, Copy, Debug)]
pub(super) struct LaneDraft {
    pub(super) id: i32,
    pub(super) kind: LaneKind,
    pub(super) width_m: f64,
    pub(super) line: LineKind,
    pub(super) predecessor: Option<i32>,
    pub(super) successor: Option<i32>,
}

#[derive(Clone, Debug)]
pub(super) struct RoadDraft {
    pub(super) id: u32,
    pub(super) junction: Option<u32>,
    pub(super) limit_kmh: u32,
    pub(super) predecessor: LinkTo,
    pub(super) successor: LinkTo,
    pub(super) pieces: Vec<Piece>,
    /// Whether the middle line is painted.
    pub(super) centre_line: bool,
    /// All lanes but the centre lane.
    pub(super) lanes: Vec<LaneDraft>,
    pub(super) objects: Vec<ObjectDraft>,
}

impl RoadDraft {
    pub(super) fn length_m(&self) -> f64 {
        self.pieces.iter().map(|piece| piece.length_m).sum()
    }
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
}

#[derive(Clone, Debug, Default)]
pub(super) struct TownDraft {
    /// Streets first, in the order of the plan.
    pub(super) roads: Vec<RoadDraft>,
    pub(super) junctions: Vec<JunctionDraft>,
}

impl TownDraft {
    /// Adds an object where the world coordinates say, to the nearest road with a straight piece
    /// beside it. Without such a road nothing is added.
    pub(super) fn place(&mut self, at: [f64; 2], heading_rad: f64, mut object: ObjectDraft) {
        let mut best: Option<(usize, f64, f64, f64)> = None;
        for (index, road) in self.roads.iter().enumerate() {
            let mut start_s = 0.0;
            for piece in &road.pieces {
                let (sin, cos) = piece.heading_rad.sin_cos();
                let (dx, dy) = (at[0] - piece.x, at[1] - piece.y);
                let (along_m, t) = (dx * cos + dy * sin, dy * cos - dx * sin);
                if piece.curvature == 0.0
                    && (0.0..=piece.length_m).contains(&along_m)
                    && best.is_none_or(|(_, _, known_t, _)| t.abs() < known_t.abs())
                {
                    best = Some((index, start_s + along_m, t, piece.heading_rad));
                }
                start_s += piece.length_m;
            }
        }
        let Some((index, s, t, road_heading_rad)) = best else { return };
        if let Some(road) = self.roads.get_mut(index) {
            (object.s, object.t) = (s, t);
            object.heading_rad = heading_rad - road_heading_rad;
            road.objects.push(object);
        }
    }
}
