//! What a triangle looks like at a pixel: from its corners, without anything interpolated before.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x8, mask32x8};

use crate::draw::{Placed, Seen};
use crate::vector::{V3, V8, affine, clamp01, cross, dot, scale, splat, sub, unit};

/// What a triangle is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// Linear reflectance.
    pub colour: [f32; 3],
    /// 0 dull to 1 mirror-like.
    pub gloss: f32,
    /// How it is drawn.
    pub family: Family,
    /// Which pattern the ground has.
    pub pattern: u8,
    /// Which of a placement's four colours multiplies its own; 4 and more: none.
    pub tint: u8,
}

/// How a material is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Patterns from the place in the world.
    Ground,
    /// Windows from the coordinates of the facade.
    Facade,
    /// Paint, glass, light.
    Body,
}

/// A triangle in the world, as shading needs it.
#[derive(Clone, Debug)]
pub(crate) struct Surface {
    first_m: V3,
    /// What changes along the surface from the first corner: 1 at the second, and at the third.
    toward: [V3; 2],
    normals: [V3; 3],
    facade_m: [[f32; 2]; 3],
    is_flat: bool,
    pub(crate) colour: V3,
    pub(crate) glow: f32,
    pub(crate) gloss: f32,
    pub(crate) pattern: f32,
    pub(crate) variant: f32,
    pub(crate) family: Family,
}

impl Surface {
    /// Of a triangle that is seen.
    pub(crate) fn of(seen: &Seen, placed: &[Placed<'_>], materials: &[Material]) -> Option<Self> {
        let placed = placed.get(seen.placed as usize)?;
        let triangle = placed.model.triangles.get(seen.triangle as usize)?;
        let corners = placed.model.corners_of(triangle)?;
        let matrix = &placed.world_from_model;
        let places = corners.map(|corner| matrix.map(|row| affine(row, corner.position)));
        let normals = corners.map(|corner| world_normal(matrix, corner.normal));
        let [first, second, third] = places;
        let (along, aside) = (sub(second, first), sub(third, first));
        let upright = cross(along, aside);
        let per_area = 1.0 / dot(upright, upright).max(1e-30);
        let toward =
            [scale(cross(aside, upright), per_area), scale(cross(upright, along), per_area)];
        let corner = corners[0];
        let material = materials.get(usize::from(corner.material))?;
        let tint = placed.tints.get(usize::from(material.tint));
        let [r, g, b, glow] =
            tint.map_or([1.0, 1.0, 1.0, 0.0], |tint| tint.map(|part| f32::from(part) / 255.0));
        let [red, green, blue] = material.colour;
        Some(Self {
            first_m: first,
            toward,
            normals,
            facade_m: corners.map(|corner| corner.facade_m),
            is_flat: corners.iter().all(|other| other.normal == corner.normal),
            colour: [red * r, green * g, blue * b],
            glow,
            gloss: material.gloss,
            pattern: f32::from(material.pattern),
            variant: f32::from(corner.variant),
            family: material.family,
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

    /// With a surface where the mask holds.
    #[inline(always)]
    pub(crate) fn with(
        &self,
        simd: S,
        mask: mask32x8<S>,
        surface: &Surface,
        place_m: V8<S>,
    ) -> Self {
        let (normal, facade_m) = surface.at(simd, place_m);
        Self {
            normal: normal.or(mask, self.normal),
            colour: V8::splat(simd, surface.colour).or(mask, self.colour),
            glow: mask.select(splat(simd, surface.glow), self.glow),
            gloss: mask.select(splat(simd, surface.gloss), self.gloss),
            pattern: mask.select(splat(simd, surface.pattern), self.pattern),
            variant: mask.select(splat(simd, surface.variant), self.variant),
            facade_m: [
                mask.select(facade_m[0], self.facade_m[0]),
                mask.select(facade_m[1], self.facade_m[1]),
            ],
        }
    }
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
        };
        let up_at = |x: f32| {
            dispatch!(Level::new(), simd => {
                surface.at(simd, V8::splat(simd, [x, 0.0, 0.0])).0.z.to_array()[0]
            })
        };
        assert_eq!([0.25, 0.5, 0.75].map(up_at), [1.0, 1.0, -1.0]);
    }
}
