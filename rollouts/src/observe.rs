//! What an agent observes: named columns with units, ranges and scales.
//!
//! **Frame:** origin on the ground under the middle of the rear axle, x forward, y left; metres,
//! radians, seconds.

mod route;

use serde::{Deserialize, Serialize};

use crate::action::Action;
use crate::motion::{Motion, Shape};
use crate::route::{Abreast, Route};

/// One column of a row.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Column {
    /// E.g. `ego.speed` or `route.10m.x`.
    pub name: String,
    /// E.g. `m/s`; empty for plain numbers.
    pub unit: &'static str,
    /// Least value in the unit; less is shown as this.
    pub low: f32,
    /// Greatest value in the unit; more is shown as this.
    pub high: f32,
    /// By which the value is multiplied where the spec normalises.
    pub scale: f32,
}

impl Column {
    fn new(
        name: impl Into<String>,
        unit: &'static str,
        (low, high): (f32, f32),
        scale: f32,
    ) -> Self {
        Self { name: name.into(), unit, low, high, scale }
    }
}

/// What a row holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Observation {
    /// The vehicle, eight points of its way ahead, and the distance to the goal.
    #[default]
    Route,
}

impl Observation {
    /// Its columns in their order.
    #[must_use]
    pub fn columns(self) -> Vec<Column> {
        match self {
            Self::Route => route::columns(),
        }
    }
}

/// What there is to observe of one agent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View<'a> {
    pub motion: &'a Motion,
    pub shape: Shape,
    pub route: &'a Route,
    pub place: &'a Abreast,
    pub last: Action,
}

/// Writes rows of one kind.
#[derive(Clone, Debug)]
pub(crate) struct Encoder {
    observation: Observation,
    scale: Vec<f32>,
    low: Vec<f32>,
    high: Vec<f32>,
}

impl Encoder {
    /// One that multiplies columns by their scales, or leaves them in their units.
    pub(crate) fn new(observation: Observation, normalise: bool) -> Self {
        let columns = observation.columns();
        let scales = || columns.iter().map(|it| if normalise { it.scale } else { 1.0 });
        Self {
            observation,
            scale: scales().collect(),
            low: columns.iter().zip(scales()).map(|(it, scale)| it.low * scale).collect(),
            high: columns.iter().zip(scales()).map(|(it, scale)| it.high * scale).collect(),
        }
    }

    pub(crate) fn width(&self) -> usize {
        self.scale.len()
    }

    /// - **Domain:** `row` is as wide as there are columns.
    pub(crate) fn encode(&self, view: &View<'_>, row: &mut [f32]) {
        match self.observation {
            Observation::Route => route::encode(view, row),
        }
        let bounds = self.scale.iter().zip(self.low.iter().zip(&self.high));
        for (value, (scale, (low, high))) in row.iter_mut().zip(bounds) {
            // Not `clamp`, which asks for each of them whether its bounds are in order.
            *value = (*value * scale).max(*low).min(*high);
        }
    }
}

impl View<'_> {
    /// A point on the ground in the vehicle's frame.
    fn seen(&self, x_m: f32, y_m: f32) -> (f32, f32) {
        let motion = self.motion;
        let (x, y) = (x_m - motion.x_m, y_m - motion.y_m);
        let ahead_m = x * motion.cos + y * motion.sin + self.shape.rear_m;
        (ahead_m, y * motion.cos - x * motion.sin)
    }
}
