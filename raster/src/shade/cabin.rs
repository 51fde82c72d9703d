//! What is seen through the windows of vehicles: seats, the dashboard, and what is behind them.
//!
//! Every window is a triangle in the visibility buffer; the ray through it goes on in a plan of
//! what is inside. The formulas and numbers are those of `cabin.wgsl`.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use super::Sight;
use crate::light::Light;
use crate::surface::{Looks, Surface, WINDOWS};
use crate::vector::{LANES, V8, affine, clamp, dot, from_lanes, smoothstep, splat, to_lanes};

/// Half of a seat's back along the cabin.
const HALF_BACK: f32 = 0.045;
/// Half width of a head rest, as a part of a seat's.
const HEAD_REST: f32 = 0.45;
/// Of light that comes through both sides of a cabin, and of light that falls into it.
const THROUGH: f32 = 0.4;
const WITHIN: f32 = 0.45;
/// Linear reflectance of the floor and the dashboard, of seats, of what is above.
const DARK: f32 = 0.018;
const SEAT: f32 = 0.06;
const LINING: f32 = 0.11;

/// The inside of a body that fills the box from -1 to 1.
struct Plan {
    /// Middle of the foremost backs, from each row to the one behind it, and rows.
    rows: [f32; 3],
    /// Middle and half width of a seat on either side.
    seat_y: [f32; 2],
    /// The floor that is seen, lower edges of windows, tops of backs, of head rests, the lining.
    levels: [f32; 5],
    /// Hind end and top of the dashboard.
    dash: [f32; 2],
    /// A wall behind the seats; none for one that is outside.
    wall_x: f32,
}

/// Of cars, vans, trucks and buses, in the order of the patterns of their windows.
const PLANS: [Plan; 4] = [
    Plan {
        rows: [-0.14, 0.42, 2.0],
        seat_y: [0.40, 0.25],
        levels: [0.06, 0.20, 0.50, 0.72, 0.90],
        dash: [0.30, 0.28],
        wall_x: -9.0,
    },
    Plan {
        rows: [0.40, 0.5, 1.0],
        seat_y: [0.42, 0.30],
        levels: [-0.10, 0.12, 0.42, 0.58, 0.90],
        dash: [0.66, 0.14],
        wall_x: 0.16,
    },
    Plan {
        rows: [0.62, 0.5, 1.0],
        seat_y: [0.45, 0.30],
        levels: [-0.10, 0.04, 0.26, 0.40, 0.62],
        dash: [0.88, 0.06],
        wall_x: 0.52,
    },
    Plan {
        rows: [0.66, 0.20, 8.0],
        seat_y: [0.58, 0.30],
        levels: [-0.50, -0.06, 0.16, 0.28, 0.86],
        dash: [0.92, -0.14],
        wall_x: -9.0,
    },
];

/// A number of each lane's plan.
type Number<S> = f32x8<S>;

/// Eight rays that have come through a window, in the box of its vehicle.
pub(crate) struct Inside<S: Simd> {
    place: V8<S>,
    step: V8<S>,
    /// The inverse of the step.
    inverse: V8<S>,
    plan: [usize; LANES],
    /// 1 for what is a window, else 0.
    window: [f32; LANES],
}

/// Where a ray meets what is inside, and what that reflects.
#[derive(Clone, Copy)]
struct Met<S: Simd> {
    steps: f32x8<S>,
    albedo: f32x8<S>,
}

impl<S: Simd> Inside<S> {
    /// `None` if none of the surfaces is a window.
    #[inline(always)]
    pub(crate) fn of(
        simd: S,
        surfaces: [Option<&Surface>; LANES],
        sight: &Sight<S>,
    ) -> Option<Self> {
        let plan_of = |surface: &Surface| (surface.pattern as usize).checked_sub(WINDOWS.into());
        let plans = surfaces.map(|surface| plan_of(surface?));
        if plans.iter().all(Option::is_none) {
            return None;
        }
        let (place_m, direction) = (to_lanes(sight.place_m), to_lanes(sight.direction));
        let (mut place, mut step) = ([[0.0; 3]; LANES], [[1.0; 3]; LANES]);
        for (lane, surface) in surfaces.iter().enumerate() {
            let Some(surface) = surface.filter(|_| plans[lane].is_some()) else { continue };
            place[lane] = surface.box_from_world.map(|row| affine(row, place_m[lane]));
            step[lane] = surface.box_from_world.map(|[x, y, z, _]| {
                let along = dot([x, y, z], direction[lane]);
                if along.abs() < 1e-6 { 1e-6 } else { along }
            });
        }
        let (place, step) = (from_lanes(simd, &place), from_lanes(simd, &step));
        let one = splat(simd, 1.0);
        let inverse = V8 { x: one / step.x, y: one / step.y, z: one / step.z };
        let window = plans.map(|plan| if plan.is_some() { 1.0 } else { 0.0 });
        Some(Self { place, step, inverse, plan: plans.map(Option::unwrap_or_default), window })
    }

    /// What is seen behind the windows, in the place of what else the surfaces show.
    #[inline(always)]
    pub(crate) fn seen(
        &self,
        simd: S,
        light: &Light,
        (sight, looks): (&Sight<S>, &Looks<S>),
        (diffuse, plain): (V8<S>, V8<S>),
    ) -> V8<S> {
        let met = self.met(simd);
        let outside = beyond(simd, light, sight.direction).scaled(splat(simd, THROUGH));
        let lit = diffuse.scaled(splat(simd, WITHIN)).plus(looks.colour.scaled(looks.glow * 8.0));
        let within = lit.scaled(met.albedo);
        let is_solid = met.albedo.simd_gt(splat(simd, 0.0));
        let is_window = f32x8::load_array(simd, self.window).simd_gt(splat(simd, 0.0));
        within.or(is_solid, outside).or(is_window, plain)
    }

    /// The first thing inside; an albedo of 0 for none.
    #[inline(always)]
    fn met(&self, simd: S) -> Met<S> {
        let rows = [0, 1, 2].map(|at| self.number(simd, |plan| plan.rows[at]));
        let [middle, half] = [0, 1].map(|at| self.number(simd, |plan| plan.seat_y[at]));
        let [floor, sill, back, head, lining] =
            [0, 1, 2, 3, 4].map(|at| self.number(simd, |plan| plan.levels[at]));
        let mut met = self.shell(simd, [floor, sill, lining]);
        let [dash_x, dash_z] = [0, 1].map(|at| self.number(simd, |plan| plan.dash[at]));
        let wide = [splat(simd, -1.0), splat(simd, 1.0)];
        met = self.boxed(simd, met, [[dash_x, dash_x + 0.6], wide, [floor, dash_z]], DARK);
        for x in self.nearest_rows(simd, rows) {
            let along = [x - HALF_BACK, x + HALF_BACK];
            for side in [-1.0, 1.0] {
                let y = middle * side;
                let seat = [along, [y - half, y + half], [floor, back]];
                met = self.boxed(simd, met, seat, SEAT);
                let narrow = half * HEAD_REST;
                let rest = [along, [y - narrow, y + narrow], [back + 0.03, head]];
                met = self.boxed(simd, met, rest, SEAT);
            }
        }
        met
    }

    /// The row that is nearest and the next one that the rays come to.
    #[inline(always)]
    fn nearest_rows(&self, simd: S, [first, pitch, count]: [Number<S>; 3]) -> [f32x8<S>; 2] {
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let last = count - one;
        let nearest = ((first - self.place.x) / pitch + 0.5).floor().max(zero).min(last);
        let behind = self.step.x.simd_lt(zero).select(one, zero - one);
        let next = (nearest + behind).max(zero).min(last);
        [nearest, next].map(|row| first - row * pitch)
    }

    /// Floor, lining, walls below the windows and behind the seats.
    #[inline(always)]
    fn shell(&self, simd: S, [floor, sill, lining]: [Number<S>; 3]) -> Met<S> {
        let zero = splat(simd, 0.0);
        let falls = self.step.z.simd_lt(zero);
        let level = falls.select(floor, lining);
        let to_level = ((level - self.place.z) * self.inverse.z).max(zero);
        let left = self.step.y.simd_gt(zero).select(splat(simd, 1.0), splat(simd, -1.0));
        let to_side = ((left - self.place.y) * self.inverse.y).max(zero);
        let ahead = self.step.x.simd_gt(zero);
        let wall_x = self.number(simd, |plan| plan.wall_x);
        let end = ahead.select(splat(simd, 1.0), wall_x.max(splat(simd, -1.0)));
        let to_end = ((end - self.place.x) * self.inverse.x).max(zero);
        let steps = to_level.min(to_side).min(to_end);
        let is_level = to_level.simd_le(to_side) & to_level.simd_le(to_end);
        let above = self.place.z + self.step.z * steps;
        let is_wall = above.simd_lt(sill);
        let has_wall = wall_x.simd_gt(splat(simd, -1.0));
        let is_back = has_wall & !ahead & to_end.simd_le(to_side);
        let dark = splat(simd, DARK);
        let albedo = (is_wall | is_back).select(dark, zero);
        let of_level = falls.select(dark, splat(simd, LINING));
        Met { steps, albedo: is_level.select(of_level, albedo) }
    }

    /// A box that may be met before what else is.
    #[inline(always)]
    fn boxed(&self, simd: S, met: Met<S>, [x, y, z]: [[f32x8<S>; 2]; 3], albedo: f32) -> Met<S> {
        let slab = |[low, high]: [f32x8<S>; 2], place: f32x8<S>, inverse: f32x8<S>| {
            let (one, other) = ((low - place) * inverse, (high - place) * inverse);
            (one.min(other), one.max(other))
        };
        let along = slab(x, self.place.x, self.inverse.x);
        let across = slab(y, self.place.y, self.inverse.y);
        let up = slab(z, self.place.z, self.inverse.z);
        let enters = along.0.max(across.0).max(up.0);
        let leaves = along.1.min(across.1).min(up.1);
        let steps = enters.max(splat(simd, 0.0));
        let is_met = leaves.simd_gt(steps) & steps.simd_lt(met.steps);
        // Sides and tops are lighter than what faces the next seat.
        let is_face = along.0.simd_ge(enters);
        let shaded = is_face.select(splat(simd, albedo), splat(simd, albedo * 1.5));
        Met { steps: is_met.select(steps, met.steps), albedo: is_met.select(shaded, met.albedo) }
    }

    #[inline(always)]
    fn number(&self, simd: S, part: impl Fn(&Plan) -> f32) -> Number<S> {
        let of = |at: usize| PLANS.get(at).map_or(0.0, &part);
        f32x8::load_array(simd, self.plan.map(of))
    }
}

/// What is behind the vehicle, as far as anybody can tell: sky, or dark ground.
#[inline(always)]
fn beyond<S: Simd>(simd: S, light: &Light, direction: V8<S>) -> V8<S> {
    let below = V8::splat(simd, light.bounce.map(|part| part * 0.6));
    let is_above = smoothstep(simd, -0.12, 0.10, direction.z);
    below.mixed(light.sky(simd, clamp(simd, direction.z, -1.0, 1.0)), is_above)
}
