//! Figures of real vehicles, each with where it is from, and ours beside them.

use crate::Result;
use crate::corner::circle;
use crate::straight;
use crate::track::Rig;

/// What is known of a real vehicle, or of its class.
#[derive(Debug)]
pub struct Known {
    /// Blueprint.
    pub id: &'static str,
    /// What it stands for in the report.
    pub class: &'static str,
    /// Seconds from a stand.
    pub start: Figure,
    /// Metres to a stand.
    pub stop: Figure,
    /// Highest sideways acceleration over gravity, and the speed of the circle.
    pub corner: Figure,
}

/// One figure.
#[derive(Debug)]
pub struct Figure {
    /// Speed at which, to which or from which, km/h.
    pub kmh: f32,
    /// The figure itself.
    pub value: f32,
    /// Share of the figure by which ours may differ.
    pub tolerance: f32,
    /// Whose figure it is.
    pub source: &'static str,
}

/// One measured value beside the published one.
#[derive(Debug)]
pub struct Row {
    /// Manoeuvre and unit.
    pub what: String,
    /// Ours.
    pub measured: f32,
    /// Theirs.
    pub published: f32,
    /// Share of the published value.
    pub tolerance: f32,
    /// Whose figure it is.
    pub source: &'static str,
}

const fn figure(kmh: f32, value: f32, tolerance: f32, source: &'static str) -> Figure {
    Figure { kmh, value, tolerance, source }
}

/// A compact car, a sports car, a lorry and a motorcycle.
pub const VEHICLES: [Known; 4] = [
    Known {
        id: "vehicle.mini.cooper_s",
        class: "compact",
        start: figure(100.0, 7.1, 0.12, "maker, Cooper S R56, 2007"),
        stop: figure(100.0, 39.0, 0.1, "class: compact car, summer tyres"),
        corner: figure(50.0, 0.87, 0.12, "class: compact car, summer tyres"),
    },
    Known {
        id: "vehicle.audi.tt",
        class: "sports car",
        start: figure(100.0, 5.3, 0.15, "maker, TT 2.0 TFSI quattro, 2015"),
        stop: figure(112.65, 48.5, 0.12, "road test of a TT 3.2 quattro, 2008: 159 ft from 70 mph"),
        corner: figure(50.0, 0.93, 0.12, "road test of a TT 3.2 quattro, 2008"),
    },
    Known {
        id: "vehicle.carlamotors.firetruck",
        class: "lorry",
        start: figure(65.0, 18.0, 0.3, "class: two-axle fire engine"),
        stop: figure(65.0, 27.0, 0.25, "class: two-axle lorry, air brakes, anti-lock"),
        corner: figure(50.0, 0.6, 0.25, "class: two-axle lorry"),
    },
    Known {
        id: "vehicle.kawasaki.ninja",
        class: "motorcycle",
        start: figure(100.0, 3.3, 0.2, "class: 600 cm³ sports motorcycle"),
        stop: figure(100.0, 41.0, 0.15, "class: 600 cm³ sports motorcycle"),
        corner: figure(50.0, 0.85, 0.15, "class: 600 cm³ sports motorcycle"),
    },
];

/// Drives what is published of a vehicle.
///
/// # Errors
/// The world refused or diverged.
pub fn measure(known: &Known) -> Result<[Row; 3]> {
    let Known { id, start, stop, corner, .. } = known;
    let (start_secs, _) = straight::start(id, start.kmh / 3.6)?;
    let stop_m = straight::stop(id, stop.kmh / 3.6)?;
    let corner_mps = corner.kmh / 3.6;
    let held = circle(Rig::rolling(id, corner_mps)?, corner_mps)?.highest_mps2;
    Ok([
        start.row(format!("0 to {:.0} km/h, s", start.kmh), start_secs),
        stop.row(format!("{:.0} to 0 km/h, m", stop.kmh), stop_m),
        corner.row("steady circle, g".to_owned(), held / 9.81),
    ])
}

impl Figure {
    fn row(&self, what: String, measured: f32) -> Row {
        let Self { value: published, tolerance, source, .. } = *self;
        Row { what, measured, published, tolerance, source }
    }
}
