//! Heights of a ground mesh, found quickly.

use std::collections::BTreeMap;

use roads::mesh::{GroundMesh, Material};

/// Side of the squares into which triangles are sorted, in metres.
const CELL_M: f64 = 8.0;

/// A ground mesh with its triangles by place.
pub(crate) struct Surface {
    triangles: Vec<([[f64; 3]; 3], Material)>,
    cells: BTreeMap<[i32; 2], Vec<usize>>,
}

#[allow(clippy::cast_possible_truncation, reason = "maps are some kilometres wide")]
fn cell(value: f64) -> i32 {
    (value / CELL_M).floor() as i32
}

impl Surface {
    pub(crate) fn new(mesh: &GroundMesh) -> Self {
        let corner = |index: u32| mesh.positions_m[index as usize].map(f64::from);
        let corners = mesh.indices.iter().map(|triangle| triangle.map(corner));
        let triangles: Vec<_> = corners.zip(mesh.materials.iter().copied()).collect();
        let mut cells: BTreeMap<[i32; 2], Vec<usize>> = BTreeMap::new();
        for (index, (corners, material)) in triangles.iter().enumerate() {
            let range = |axis: usize| {
                let values = corners.map(|corner| corner[axis]);
                let low = values.into_iter().fold(f64::INFINITY, f64::min);
                let high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
                cell(low)..=cell(high)
            };
            // Land on the flat is asked for by nobody and lies in very large triangles.
            let is_large = [range(0), range(1)].iter().all(|cells| cells.clone().count() > 7);
            if *material == Material::Grass && is_large {
                continue;
            }
            for x in range(0) {
                for y in range(1) {
                    cells.entry([x, y]).or_default().push(index);
                }
            }
        }
        Self { triangles, cells }
    }

    /// Heights of all paved faces above or below a place.
    pub(crate) fn heights(&self, x: f64, y: f64) -> impl Iterator<Item = f64> {
        let near = self.cells.get(&[cell(x), cell(y)]).map_or(&[][..], Vec::as_slice);
        near.iter().filter_map(move |index| height(&self.triangles[*index].0, x, y))
    }
}

/// Height of a triangle at a place, if it lies there; a micrometre beyond its edges counts.
fn height([a, b, c]: &[[f64; 3]; 3], x: f64, y: f64) -> Option<f64> {
    let cross =
        |p: &[f64; 3], q: &[f64; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
    let [w, u, v] = [cross(a, b), cross(b, c), cross(c, a)];
    let area2 = w + u + v;
    let edge = |p: &[f64; 3], q: &[f64; 3]| (q[0] - p[0]).hypot(q[1] - p[1]) * 1e-5;
    let inside = |area: f64, slack: f64| area * area2.signum() >= -slack;
    let lies_there = inside(w, edge(a, b))
        && inside(u, edge(b, c))
        && inside(v, edge(c, a))
        && area2.abs() > 1e-9;
    lies_there.then(|| (u * a[2] + v * b[2] + w * c[2]) / area2)
}
