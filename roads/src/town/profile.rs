//! Cross-sections: which lanes a street has beside each other.

use super::draft::{LaneKind, LineKind};

/// Width of every driving lane, in metres.
pub(super) const LANE_M: f64 = 3.5;
/// Width of sidewalks, in metres.
pub(super) const SIDEWALK_M: f64 = 3.0;
/// Width of a lane for parked cars, in metres.
const PARKING_M: f64 = 2.3;
/// Width of a lane for bicycles, in metres.
const BIKING_M: f64 = 1.8;

/// What lies outside of the driving lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    /// A gutter, a kerb, a sidewalk.
    Sidewalk,
    /// A narrow strip of asphalt before the grass.
    Verge,
    /// A lane for broken-down cars.
    HardShoulder,
}

impl Edge {
    pub(super) fn shoulder_m(self) -> f64 {
        match self {
            Self::Sidewalk => 0.5,
            Self::Verge => 1.0,
            Self::HardShoulder => 2.5,
        }
    }

    pub(super) fn sidewalk_m(self) -> f64 {
        match self {
            Self::Sidewalk => SIDEWALK_M,
            Self::Verge | Self::HardShoulder => 0.0,
        }
    }

    pub(super) fn has_sidewalk(self) -> bool {
        self == Self::Sidewalk
    }
}

/// A lane that is only there between junctions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extra {
    Parking,
    Biking,
}

impl Extra {
    pub(super) fn width_m(self) -> f64 {
        match self {
            Self::Parking => PARKING_M,
            Self::Biking => BIKING_M,
        }
    }

    pub(super) fn kind(self) -> LaneKind {
        match self {
            Self::Parking => LaneKind::Parking,
            Self::Biking => LaneKind::Biking,
        }
    }
}

/// The lanes of one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Side {
    /// Width of this side's half of the strip between both directions, in metres.
    pub(super) median_m: f64,
    /// Number of driving lanes.
    pub(super) driving: i32,
    pub(super) extra: Option<Extra>,
    pub(super) edge: Edge,
}

impl Side {
    /// From the reference line to the outer border of the shoulder, at the street's ends.
    pub(super) fn kerb_m(self) -> f64 {
        self.driving_m()[1] + self.edge.shoulder_m()
    }

    /// From the reference line to the inner and to the outer border of the driving lanes.
    pub(super) fn driving_m(self) -> [f64; 2] {
        [self.median_m, self.median_m + f64::from(self.driving) * LANE_M]
    }

    /// The number that a driving lane has among all lanes, both counted outward from 1.
    pub(super) fn lane_number(self, driving: i32) -> i32 {
        driving + i32::from(self.median_m > 0.0)
    }

    /// From the reference line to the outermost border anywhere.
    pub(super) fn width_m(self) -> f64 {
        self.kerb_m() + self.edge.sidewalk_m() + self.extra.map_or(0.0, Extra::width_m)
    }

    /// The lanes from the middle outward: kind, width and outer line.
    pub(super) fn lanes(self, with_extra: bool) -> Vec<(LaneKind, f64, LineKind)> {
        let mut lanes = Vec::new();
        if self.median_m > 0.0 {
            lanes.push((LaneKind::Median, self.median_m, LineKind::Solid));
        }
        lanes.extend((1..=self.driving).map(|number| {
            let line = if number < self.driving { LineKind::Broken } else { LineKind::Solid };
            (LaneKind::Driving, LANE_M, line)
        }));
        if let Some(extra) = self.extra.filter(|_| with_extra) {
            lanes.push((extra.kind(), extra.width_m(), LineKind::Solid));
        }
        let kerb = if self.edge.has_sidewalk() { LineKind::Kerb } else { LineKind::None };
        lanes.push((LaneKind::Shoulder, self.edge.shoulder_m(), kerb));
        if self.edge.has_sidewalk() {
            lanes.push((LaneKind::Sidewalk, self.edge.sidewalk_m(), LineKind::None));
        }
        lanes
    }
}

/// What a street is like. Traffic along the reference line keeps to the right of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Profile {
    pub(super) left: Option<Side>,
    pub(super) right: Side,
    pub(super) limit_kmh: u32,
}

impl Profile {
    /// The same on both sides, with sidewalks.
    pub(super) const fn street(driving: i32, limit_kmh: u32) -> Self {
        Self::two_way(driving, Edge::Sidewalk, limit_kmh)
    }

    pub(super) const fn two_way(driving: i32, edge: Edge, limit_kmh: u32) -> Self {
        let side = Side { median_m: 0.0, driving, extra: None, edge };
        Self { left: Some(side), right: side, limit_kmh }
    }

    pub(super) const fn one_way(driving: i32, edge: Edge, limit_kmh: u32) -> Self {
        let right = Side { median_m: 0.0, driving, extra: None, edge };
        Self { left: None, right, limit_kmh }
    }

    /// With a further lane on both sides between junctions.
    pub(super) const fn with(self, extra: Extra) -> Self {
        let left = match self.left {
            Some(left) => Some(Side { extra: Some(extra), ..left }),
            None => None,
        };
        Self { left, right: Side { extra: Some(extra), ..self.right }, ..self }
    }

    /// With other lanes on the left.
    pub(super) const fn with_left(self, driving: i32, edge: Edge) -> Self {
        let left = Some(Side { median_m: 0.0, driving, extra: None, edge });
        Self { left, ..self }
    }

    /// With a strip between both directions, of this width in metres.
    pub(super) const fn divided(self, width_m: f64) -> Self {
        let median_m = width_m / 2.0;
        let left = match self.left {
            Some(left) => Some(Side { median_m, ..left }),
            None => None,
        };
        Self { left, right: Side { median_m, ..self.right }, ..self }
    }

    /// The lanes with this sign.
    pub(super) fn side(self, sign: i32) -> Option<Side> {
        if sign < 0 { Some(self.right) } else { self.left }
    }

    /// From the reference line to the outermost border on the side with this sign.
    pub(super) fn width_m(self, sign: i32) -> f64 {
        self.side(sign).map_or(0.0, Side::width_m)
    }
}
