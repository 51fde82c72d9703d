//! What an agent observes: named columns with units, ranges and scales, in named blocks.
//!
//! **Frame:** origin on the ground under the middle of the rear axle, x forward, y left; metres,
//! radians, seconds.

mod drive;
mod roads;
mod route;
mod wide;

use std::sync::Arc;

use ::roads::Map;
use serde::{Deserialize, Serialize};

use crate::action::Action;
use crate::line::{LightAhead, StopLine};
use crate::motion::{Motion, Shape};
use crate::route::{Abreast, Route};
use crate::scene::Scene;
use wide::Wide;

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

/// Columns that belong together: `count` things of `width` columns each, one after the other.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Block {
    /// E.g. `partners`; its columns' names begin with it.
    pub name: &'static str,
    /// Its first column.
    pub first: usize,
    /// How many things, e.g. places for partners.
    pub count: usize,
    /// Columns of each.
    pub width: usize,
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
    /// That, the light ahead on its way, and the 16 nearest others.
    Drive,
    /// 1,847 numbers as self-play simulators have them: the vehicle, two points of its way, 63
    /// others, 4 lights, and 196 pieces of road.
    Wide,
}

impl Observation {
    /// Its columns in their order.
    #[must_use]
    pub fn columns(self) -> Vec<Column> {
        match self {
            Self::Route => route::columns(),
            Self::Drive => drive::columns(),
            Self::Wide => wide::columns(),
        }
    }

    /// Its blocks in their order; together they are all columns.
    #[must_use]
    pub fn blocks(self) -> Vec<Block> {
        let sizes = match self {
            Self::Route => route::BLOCKS.as_slice(),
            Self::Drive => drive::BLOCKS.as_slice(),
            Self::Wide => wide::BLOCKS.as_slice(),
        };
        let mut first = 0;
        let block = |&(name, count, width): &(&'static str, usize, usize)| {
            let begin = first;
            first += count * width;
            Block { name, first: begin, count, width }
        };
        sizes.iter().map(block).collect()
    }

    /// How many columns it has.
    pub(crate) fn width(self) -> usize {
        self.blocks().last().map_or(0, |block| block.first + block.count * block.width)
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
    /// The next one on its way.
    pub light: Option<LightAhead>,
    /// Its own position in the scene.
    pub index: usize,
    pub scene: &'a Scene,
}

/// Writes rows of one kind.
#[derive(Clone, Debug)]
pub(crate) struct Encoder {
    observation: Observation,
    scale: Vec<f32>,
    low: Vec<f32>,
    high: Vec<f32>,
    /// For [`Observation::Wide`], which brings its columns within their bounds itself.
    wide: Option<Arc<Wide>>,
}

impl Encoder {
    /// One for worlds of a map, some of whose lines of lights count, that multiplies columns by
    /// their scales, or leaves them in their units.
    pub(crate) fn new(
        observation: Observation,
        normalise: bool,
        map: &Map,
        lines: &[StopLine],
    ) -> Self {
        let wide =
            (observation == Observation::Wide).then(|| Arc::new(Wide::new(map, lines, normalise)));
        let columns = observation.columns();
        let scales = || columns.iter().map(|it| if normalise { it.scale } else { 1.0 });
        Self {
            observation,
            scale: scales().collect(),
            low: columns.iter().zip(scales()).map(|(it, scale)| it.low * scale).collect(),
            high: columns.iter().zip(scales()).map(|(it, scale)| it.high * scale).collect(),
            wide,
        }
    }

    pub(crate) fn width(&self) -> usize {
        self.scale.len()
    }

    /// Whether it looks at anybody but the agent itself.
    pub(crate) fn sees_others(&self) -> bool {
        self.observation != Observation::Route
    }

    /// - **Domain:** `row` is as wide as there are columns.
    pub(crate) fn encode(&self, view: &View<'_>, row: &mut [f32]) {
        match (self.observation, &self.wide) {
            (_, Some(wide)) => return wide.encode(view, row),
            (Observation::Drive, _) => drive::encode(view, row),
            (Observation::Route | Observation::Wide, _) => route::encode(view, row),
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
    #[inline]
    fn seen(&self, x_m: f32, y_m: f32) -> (f32, f32) {
        let motion = self.motion;
        let (x, y) = (x_m - motion.x_m, y_m - motion.y_m);
        let ahead_m = x * motion.cos + y * motion.sin + self.shape.rear_m;
        (ahead_m, y * motion.cos - x * motion.sin)
    }

    /// A direction in the vehicle's frame.
    #[inline]
    fn turned(&self, x: f32, y: f32) -> (f32, f32) {
        let motion = self.motion;
        (x * motion.cos + y * motion.sin, y * motion.cos - x * motion.sin)
    }

    /// Calls for everybody else whose middle is within a distance of the vehicle's, with its
    /// square and position in the scene, in their order.
    fn around(&self, within_m: f32, mut tell: impl FnMut(f32, usize)) {
        let most = within_m * within_m;
        for (index, other) in self.scene.everybody.iter().enumerate() {
            let (x, y) = (other.x_m - self.motion.x_m, other.y_m - self.motion.y_m);
            let away = x * x + y * y;
            if away <= most && index != self.index && other.is_there {
                tell(away, index);
            }
        }
    }
}

#[cfg(test)]
mod tests;
