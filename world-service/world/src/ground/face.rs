//! Triangles seen from above: which points they cover, and how high they are there.

use nalgebra::Vector2;
use schemas::Vec3;

/// Tolerance at triangle edges, so that no point falls between two triangles.
pub(super) const EDGE_M: f32 = 1.0e-3;

/// One triangle as a plane z = corner + slope · (xy − corner) with its outline: no more than what
/// tells whether a point is above it, as many are looked at for one that is.
#[derive(Clone, Debug)]
pub(super) struct Face {
    pub corner: Vec3,
    /// Of the three edges of the outline, then the slope: all x, all y, so that one instruction
    /// serves four.
    pub across: [[f32; 4]; 2],
    /// Inside all edges is in the triangle; the slope keeps nothing out.
    pub outside: [f32; 4],
}

/// Unit normal, upwards, and friction of a face.
pub(super) type Skin = (Vec3, f32);

/// Lowest and highest corner along each axis.
pub(super) type Bounds = (Vec3, Vec3);

/// A straight border seen from above; inside is where across · (xy − corner) ≥ outside.
#[derive(Clone, Copy, Debug)]
struct Edge {
    across: Vector2<f32>,
    outside: f32,
}

impl Face {
    fn new(corner: Vec3, edges: [Edge; 3], slope: Vector2<f32>) -> Self {
        let [a, b, c] = edges.map(|edge| edge.across);
        let [d, e, f] = edges.map(|edge| edge.outside);
        let across = [[a.x, b.x, c.x, slope.x], [a.y, b.y, c.y, slope.y]];
        Self { corner, across, outside: [d, e, f, f32::NEG_INFINITY] }
    }

    /// From the corner to a place, along the normals of the edges and up the slope.
    pub(super) fn along(&self, from_corner: Vector2<f32>) -> [f32; 4] {
        let [x, y] = self.across;
        std::array::from_fn(|at| x[at] * from_corner.x + y[at] * from_corner.y)
    }

    /// The height of its plane at a point, if the outline seen from above, widened by [`EDGE_M`],
    /// holds that.
    #[inline]
    pub(super) fn height_at_m(&self, point: Vec3) -> Option<f32> {
        let along = self.along(point.xy() - self.corner.xy());
        // All in any case: which of them fails cannot be foretold.
        let beyond = along.iter().zip(&self.outside).map(|(along, outside)| along >= outside);
        beyond.fold(true, |all, inside| all & inside).then_some(self.corner.z + along[3])
    }

    /// Whether it covers a point between these ones, or beside them by little.
    pub(super) fn may_cover(&self, corners_m: &[Vector2<f32>; 4]) -> bool {
        /// More than what rounding makes of a coordinate.
        const ROUNDING: f32 = 1.0e-5;
        let from_corner = corners_m.map(|xy_m| xy_m - self.corner.xy());
        let places = corners_m.iter().chain(&from_corner);
        let reach_m = places.map(|place| place.abs().sum()).fold(0.0, f32::max);
        let beside_m = 2.0 * EDGE_M + ROUNDING * reach_m;
        let along = from_corner.map(|place| self.along(place));
        let [x, y] = self.across;
        (0..3).all(|edge| {
            let least = self.outside[edge] - beside_m * (x[edge].abs() + y[edge].abs());
            along.iter().any(|along| along[edge] >= least)
        })
    }

    pub(super) fn height_m(&self, point: Vec3) -> f32 {
        self.corner.z + self.along(point.xy() - self.corner.xy())[3]
    }
}

impl Edge {
    /// Between two corners, counter-clockwise.
    fn new(corner: Vec3, from: Vec3, to: Vec3) -> Self {
        let along = (to - from).xy();
        let across = Vector2::new(-along.y, along.x);
        let tolerance = EDGE_M * (along.x.abs() + along.y.abs());
        Self { across, outside: across.dot(&(from - corner).xy()) - tolerance }
    }
}

/// A face with upward normal and counter-clockwise corners; `None` for walls and slivers.
pub(super) fn face((corners, friction): ([Vec3; 3], f32)) -> Option<(Face, Skin, Bounds)> {
    let [a, mut b, mut c] = corners;
    let cross = (b - a).cross(&(c - a));
    let mut normal = cross.try_normalize(1.0e-9)?;
    // Steeper than 70° is a wall: nothing drives or lies on it.
    if normal.z.abs() < 0.34 {
        return None;
    }
    if normal.z < 0.0 {
        (b, c, normal) = (c, b, -normal);
    }
    let edges = [(a, b), (b, c), (c, a)].map(|(from, to)| Edge::new(a, from, to));
    let face = Face::new(a, edges, -normal.xy() / normal.z);
    Some((face, (normal, friction), (a.inf(&b).inf(&c), a.sup(&b).sup(&c))))
}
