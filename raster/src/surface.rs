//! What a triangle looks like at a pixel: from its corners, without anything interpolated before.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8};

use crate::draw::Seen;
use crate::model::{Corner, Model};
use crate::quality::Quality;
use crate::scene::{Family, Scene};
use crate::vector::{LANES, V3, V8, affine, clamp01, cross, dot, scale, splat, sub, unit};

/// The first pattern of a vehicle's windows; all from it on are.
pub(crate) const WINDOWS: u8 = 7;

/// A triangle in the world, as shading needs it.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    first_m: V3,
    /// What changes along the surface from the first corner: 1 at the second, and at the third.
    toward: [V3; 2],
    pub(crate) normals: [V3; 3],
    facade_m: [[f32; 2]; 3],
    /// Whether its normals are one.
    pub(crate) is_flat: bool,
    pub(crate) colour: V3,
    pub(crate) glow: f32,
    pub(crate) gloss: f32,
    pub(crate) pattern: f32,
    pub(crate) variant: f32,
    pub(crate) family: Family,
    /// The position of its coat among those of the scene, and 1; 0: none.
    pub(crate) coat: u16,
    /// Rows of the model's frame from the world, of a vehicle's window in pictures of high quality.
    pub(crate) box_from_world: [[f32; 4]; 3],
}

impl Surface {
    /// Of a triangle that is seen. Small ones have one normal in pictures of low quality.
    pub(crate) fn of(seen: &Seen, scene: &Scene<'_>, quality: Quality) -> Option<Self> {
        let Scene { placed, materials, .. } = *scene;
        let placed = placed.get(seen.placed as usize)?;
        let triangle = placed.model.triangles.get(seen.triangle as usize)?;
        let corners = placed.model.corners_of(triangle)?;
        let corner = corners[0];
        let material = materials.get(usize::from(corner.material))?;
        let matrix = &placed.world_from_model;
        let is_flat = (seen.is_small && quality == Quality::Low)
            || corners.iter().all(|other| other.normal == corner.normal);
        let first_normal = world_normal(matrix, corner.normal);
        let normal = |at: usize| world_normal(matrix, corners[at].normal);
        let normals =
            if is_flat { [first_normal; 3] } else { [first_normal, normal(1), normal(2)] };
        // Where a pixel is on it matters to nothing else.
        let is_facade = material.family == Family::Facade;
        let has_places = !is_flat || is_facade;
        let (first_m, toward) =
            if has_places { places(matrix, corners) } else { ([0.0; 3], [[0.0; 3]; 2]) };
        let is_window = quality == Quality::High && material.pattern >= WINDOWS;
        let tint = placed.tints.get(usize::from(material.tint));
        let [r, g, b, glow] =
            tint.map_or([1.0, 1.0, 1.0, 0.0], |tint| tint.map(|part| f32::from(part) / 255.0));
        let [red, green, blue] = material.colour;
        Some(Self {
            first_m,
            toward,
            normals,
            facade_m: if is_facade { corners.map(|corner| corner.facade_m) } else { [[0.0; 2]; 3] },
            is_flat,
            colour: [red * r, green * g, blue * b],
            glow,
            gloss: material.gloss,
            pattern: if material.pattern < WINDOWS || is_window {
                material.pattern.into()
            } else {
                0.0
            },
            variant: f32::from(corner.variant),
            family: material.family,
            coat: coat_of(scene, placed.model, seen.triangle),
            box_from_world: if is_window { inverse(matrix) } else { [[0.0; 4]; 3] },
        })
    }

    /// Unit normals, and metres along and up a facade, at places on it.
    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, place_m: V8<S>) -> (V8<S>, [f32x8<S>; 2]) {
        let zeros = [splat(simd, 0.0); 2];
        if self.is_flat && self.family != Family::Facade {
            return (V8::splat(simd, self.normals[0]), zeros);
        }
        let from_first = place_m.minus(V8::splat(simd, self.first_m));
        let [second, third] = self.toward;
        let second = clamp01(simd, from_first.dot(V8::splat(simd, second)));
        let third = clamp01(simd, from_first.dot(V8::splat(simd, third)));
        let [a, b, c] = self.normals;
        let normal = if self.is_flat {
            V8::splat(simd, a)
        } else {
            let bend = V8::splat(simd, sub(b, a)).scaled(second);
            let bend = bend.plus(V8::splat(simd, sub(c, a)).scaled(third));
            let bent = V8::splat(simd, a).plus(bend);
            // Opposite normals have none between them.
            let has_length = bent.dot(bent).simd_gt(splat(simd, 1e-12));
            bent.unit(simd).or(has_length, V8::splat(simd, a))
        };
        let [a, b, c] = self.facade_m;
        let along = second * (b[0] - a[0]) + third * (c[0] - a[0]) + a[0];
        let up = second * (b[1] - a[1]) + third * (c[1] - a[1]) + a[1];
        (normal, [along, up])
    }
}

/// The position of the coat of a triangle, and 1; 0 for none.
fn coat_of(scene: &Scene<'_>, model: &Model, triangle: u32) -> u16 {
    if scene.coats.is_empty() {
        return 0;
    }
    let thing = model.thing(triangle as usize);
    let find = |thing| scene.coats.binary_search_by_key(&thing, |coat| coat.thing).ok();
    thing.and_then(find).and_then(|at| u16::try_from(at + 1).ok()).unwrap_or(0)
}

/// The first corner in the world, and what changes from it along the surface: 1 at the second
/// corner, and at the third.
fn places(matrix: &[[f32; 4]; 3], corners: [&Corner; 3]) -> (V3, [V3; 2]) {
    let place = |Corner { position, .. }: &Corner| matrix.map(|row| affine(row, *position));
    let [first, second, third] = corners.map(place);
    let (along, aside) = (sub(second, first), sub(third, first));
    let upright = cross(along, aside);
    let per_area = 1.0 / dot(upright, upright).max(1e-30);
    (first, [scale(cross(aside, upright), per_area), scale(cross(upright, along), per_area)])
}

/// Rows from the world to the frame of a model that was turned after a stretch along its axes.
fn inverse([a, b, c]: &[[f32; 4]; 3]) -> [[f32; 4]; 3] {
    [0, 1, 2].map(|axis| {
        let column = [a[axis], b[axis], c[axis]];
        let [x, y, z] = scale(column, 1.0 / dot(column, column).max(1e-12));
        [x, y, z, -dot([x, y, z], [a[3], b[3], c[3]])]
    })
}

/// World normal of a model's own. A placement is a turn after a stretch along the axes: normals
/// shrink where positions stretch. Upwards for a placement that is flat.
fn world_normal([a, b, c]: &[[f32; 4]; 3], normal: V3) -> V3 {
    let stretch = |at: usize| a[at] * a[at] + b[at] * b[at] + c[at] * c[at];
    let n = [normal[0] / stretch(0), normal[1] / stretch(1), normal[2] / stretch(2)];
    let turned = unit([a, b, c].map(|row| row[0] * n[0] + row[1] * n[1] + row[2] * n[2]));
    if turned.iter().all(|part| part.is_finite()) { turned } else { [0.0, 0.0, 1.0] }
}

/// What eight pixels show.
#[derive(Clone, Copy)]
pub(crate) struct Looks<S: Simd> {
    pub(crate) normal: V8<S>,
    pub(crate) colour: V8<S>,
    pub(crate) glow: f32x8<S>,
    pub(crate) gloss: f32x8<S>,
    pub(crate) pattern: f32x8<S>,
    pub(crate) variant: f32x8<S>,
    pub(crate) facade_m: [f32x8<S>; 2],
}

impl<S: Simd> Looks<S> {
    #[inline(always)]
    pub(crate) fn nothing(simd: S) -> Self {
        let zero = splat(simd, 0.0);
        let up = V8::splat(simd, [0.0, 0.0, 1.0]);
        Self {
            normal: up,
            colour: up,
            glow: zero,
            gloss: zero,
            pattern: zero,
            variant: zero,
            facade_m: [zero; 2],
        }
    }

    /// Of places on one surface.
    #[inline(always)]
    pub(crate) fn of_one(simd: S, surface: &Surface, place_m: V8<S>) -> Self {
        let (normal, facade_m) = surface.at(simd, place_m);
        Self {
            normal,
            colour: V8::splat(simd, surface.colour),
            glow: splat(simd, surface.glow),
            gloss: splat(simd, surface.gloss),
            pattern: splat(simd, surface.pattern),
            variant: splat(simd, surface.variant),
            facade_m,
        }
    }

    /// Of places on a surface each.
    #[inline(always)]
    pub(crate) fn of_each(simd: S, surfaces: &[&Surface; LANES], place_m: V8<S>) -> Self {
        let (normal, facade_m) = at_each(simd, surfaces, place_m);
        Self {
            normal,
            colour: each_place(simd, surfaces, |surface| surface.colour),
            glow: each(simd, surfaces, |surface| surface.glow),
            gloss: each(simd, surfaces, |surface| surface.gloss),
            pattern: each(simd, surfaces, |surface| surface.pattern),
            variant: each(simd, surfaces, |surface| surface.variant),
            facade_m,
        }
    }
}

/// One number of each of eight surfaces.
#[inline(always)]
fn each<S: Simd>(
    simd: S,
    surfaces: &[&Surface; LANES],
    part: impl Fn(&Surface) -> f32,
) -> f32x8<S> {
    let mut parts = [0.0; LANES];
    for (slot, surface) in parts.iter_mut().zip(surfaces) {
        *slot = part(surface);
    }
    f32x8::load_array(simd, parts)
}

/// Three numbers of each of eight surfaces.
#[inline(always)]
fn each_place<S: Simd>(
    simd: S,
    surfaces: &[&Surface; LANES],
    place: impl Fn(&Surface) -> V3,
) -> V8<S> {
    V8 {
        x: each(simd, surfaces, |surface| place(surface)[0]),
        y: each(simd, surfaces, |surface| place(surface)[1]),
        z: each(simd, surfaces, |surface| place(surface)[2]),
    }
}

/// As [`Surface::at`], of eight surfaces: the same numbers.
#[inline(always)]
pub(crate) fn at_each<S: Simd>(
    simd: S,
    surfaces: &[&Surface; LANES],
    place_m: V8<S>,
) -> (V8<S>, [f32x8<S>; 2]) {
    let first = each_place(simd, surfaces, |surface| surface.normals[0]);
    let has_facade = surfaces.iter().any(|surface| surface.family == Family::Facade);
    if !has_facade && surfaces.iter().all(|surface| surface.is_flat) {
        return (first, [splat(simd, 0.0); 2]);
    }
    let from_first = place_m.minus(each_place(simd, surfaces, |surface| surface.first_m));
    let toward_second = each_place(simd, surfaces, |surface| surface.toward[0]);
    let toward_third = each_place(simd, surfaces, |surface| surface.toward[1]);
    let second = clamp01(simd, from_first.dot(toward_second));
    let third = clamp01(simd, from_first.dot(toward_third));
    let mut facade_m = [splat(simd, 0.0); 2];
    if has_facade {
        for (axis, facade_m) in facade_m.iter_mut().enumerate() {
            let a = each(simd, surfaces, |surface| surface.facade_m[0][axis]);
            let b = each(simd, surfaces, |surface| surface.facade_m[1][axis]);
            let c = each(simd, surfaces, |surface| surface.facade_m[2][axis]);
            *facade_m = second * (b - a) + third * (c - a) + a;
        }
    }
    if surfaces.iter().all(|surface| surface.is_flat) {
        return (first, facade_m);
    }
    let to_second = each_place(simd, surfaces, |surface| surface.normals[1]).minus(first);
    let to_third = each_place(simd, surfaces, |surface| surface.normals[2]).minus(first);
    let bend = to_second.scaled(second).plus(to_third.scaled(third));
    let bent = first.plus(bend);
    let is_flat = each(simd, surfaces, |surface| if surface.is_flat { 1.0 } else { 0.0 });
    let is_bent = bent.dot(bent).simd_gt(splat(simd, 1e-12)) & is_flat.simd_eq(splat(simd, 0.0));
    (bent.unit(simd).or(is_bent, first), facade_m)
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    #[test]
    fn normals_shrink_where_places_stretch_and_are_numbers_on_what_is_flat() {
        let stretched = |z: f32| [[2.0, 0.0, 0.0, 5.0], [0.0, 1.0, 0.0, 6.0], [0.0, 0.0, z, 7.0]];
        let [x, y, z] = world_normal(&stretched(1.0), unit([1.0, 0.0, 1.0]));
        assert!((x - 0.2f32.sqrt()).abs() < 1e-6 && y == 0.0 && (z - 0.8f32.sqrt()).abs() < 1e-6);
        for normal in [[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0]] {
            let turned = world_normal(&stretched(0.0), normal);
            assert!(turned.iter().all(|part| part.is_finite()), "{normal:?}: {turned:?}");
        }
    }

    #[test]
    fn half_way_between_opposite_normals_is_the_first_one() {
        let surface = Surface {
            first_m: [0.0; 3],
            toward: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            normals: [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.0, 0.0, -1.0]],
            facade_m: [[0.0; 2]; 3],
            is_flat: false,
            colour: [0.5; 3],
            glow: 0.0,
            gloss: 0.0,
            pattern: 0.0,
            variant: 0.0,
            family: Family::Body,
            coat: 0,
            box_from_world: [[0.0; 4]; 3],
        };
        let up_at = |x: f32| {
            dispatch!(Level::new(), simd => {
                surface.at(simd, V8::splat(simd, [x, 0.0, 0.0])).0.z.to_array()[0]
            })
        };
        assert_eq!([0.25, 0.5, 0.75].map(up_at), [1.0, 1.0, -1.0]);
    }
}
