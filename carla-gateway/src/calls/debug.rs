//! Shapes that clients draw into the world. They last in simulated time.

use std::sync::Arc;

use schemas::Vec3;

use crate::dialect::{DebugShape, Line, Primitive, Transform};
use crate::endpoint::Endpoint;
use crate::pictures::{Figure, Shape};
use crate::rpc::Refusal;

/// Shapes of one endpoint; the oldest go first.
const SHAPES_MAX: usize = 16_384;

pub(super) fn draw(endpoint: &mut Endpoint, shape: DebugShape) -> Result<(), Refusal> {
    // Others stay until they are cleared, as in CARLA.
    let life_secs = Some(f64::from(shape.life_secs)).filter(|secs| *secs > 0.0);
    let Some(figure) = figure(&shape.primitive)? else { return Ok(()) };
    let now_secs = endpoint.episode()?.frame.sim_secs;
    let (red, green, blue) = shape.colour;
    let until_secs = life_secs.map(|secs| now_secs + secs);
    let shapes = Arc::make_mut(&mut endpoint.shapes);
    if shapes.len() >= SHAPES_MAX {
        shapes.remove(0);
    }
    shapes.push(Shape { figure, rgb: [red, green, blue], until_secs });
    Ok(())
}

/// Takes out everything but text.
pub(super) fn clear(endpoint: &mut Endpoint) -> Result<(), Refusal> {
    Arc::make_mut(&mut endpoint.shapes).retain(is_text);
    Ok(())
}

pub(super) fn clear_text(endpoint: &mut Endpoint) -> Result<(), Refusal> {
    Arc::make_mut(&mut endpoint.shapes).retain(|shape| !is_text(shape));
    Ok(())
}

fn is_text(shape: &Shape) -> bool {
    matches!(shape.figure, Figure::Text(..))
}

/// What cameras see of a shape; `None` for what only the screen of a server shows.
///
/// # Errors
/// Sizes that overflow.
fn figure(primitive: &Primitive) -> Result<Option<Figure>, Refusal> {
    let ends = |line: &Line| (line.begin.ours(), line.end.ours());
    let figure = match primitive {
        Primitive::Point(at, size) => Figure::Point(at.ours(), *size),
        Primitive::Line(line) => {
            let (begin, end) = ends(line);
            Figure::line(begin, end, line.thickness)
        }
        Primitive::Arrow(line, tip) => {
            let (begin, end) = ends(line);
            Figure::arrow(begin, end, *tip, line.thickness)
        }
        Primitive::Box(bounds, rotation, thickness) => {
            let placed = Transform { location: bounds.location, rotation: *rotation };
            let extent = bounds.extent;
            let half_m = Vec3::new(extent.x, extent.y, extent.z);
            Figure::cuboid(&placed.ours(), half_m, *thickness)
        }
        Primitive::Text(at, text, has_shadow) => Figure::text(at.ours(), text, *has_shadow),
        Primitive::Overlay => return Ok(None),
    };
    if figure.is_finite() {
        Ok(Some(figure))
    } else {
        Err(Refusal("the shape is too large to be drawn".to_owned()))
    }
}
