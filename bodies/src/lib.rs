//! What actors look like: shapes made of triangles, and where each of an actor's shapes is.
//!
//! Pictures and rays both take it from here, so that a lidar meets what a camera shows: bodies,
//! wheels that steer, doors that are open, limbs that swing or are posed, riders, lit lamps.
//! Everything follows from an [`ActorState`](schemas::ActorState), the type's name, the time and
//! the limbs that somebody posed; nothing is kept.
//!
//! - **Units:** metres, radians; x ahead, y left, z up.
//! - **Determinism:** equal states give equal places and triangles, bit for bit, on every machine:
//!   sines are those of `libm`. Colours are not needed for that and use the platform's powers.

pub mod lettering;
mod material;
mod mesh;
mod place;
mod shape;

pub use material::Material;
pub use mesh::{Mesh, Vertex, pack, quantised};
pub use place::{
    Instance, Placed, Placer, Shine, Source, bounds, glowing, is_shown, linear, opaque, place,
};
pub use shape::Shape;
