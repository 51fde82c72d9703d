//! Roads: OpenDRIVE text in, a lane graph, meshes and spawn points out; and towns of our own.
//!
//! [`Map`] reads a map the way CARLA's client library does, so that server and client agree on
//! every waypoint. [`town::build`] writes OpenDRIVE text for a generated town, which is read back
//! through the same parser. [`mesh`] makes the triangles that wheels stand on and cameras see;
//! [`nav`] makes the polygons that walkers find their way on.
//!
//! Frame everywhere: right-handed metres, x east, y north, z up; headings counter-clockwise in
//! radians. CARLA's mirrored frame does not occur here.
//!
//! ```
//! let text = roads::town::build("Town10HD_Opt").unwrap();
//! let map = roads::Map::parse("Town10HD_Opt", &text).unwrap();
//! let start = map.spawn_points()[0];
//! let place = map.nearest(start.translation.vector.into(), roads::LaneTypes::DRIVING).unwrap();
//! assert!(!map.next(&place, 5.0).is_empty());
//! ```
//!
//! The crate does no input or output, starts no threads and reads no clock.

mod arc;
mod check;
mod chords;
mod crosswalks;
mod environment;
mod error;
mod far_side;
mod geo;
mod geometry;
mod index;
mod kinds;
mod labels;
mod landmarks;
mod lanes;
mod level;
mod levelling;
mod lights;
pub mod limits;
mod links;
mod map;
pub mod mesh;
mod model;
pub mod nav;
mod neighbours;
pub mod picture;
mod place;
mod post;
mod posts;
mod scenery;
mod shapes;
mod signals;
mod signs;
mod size;
mod spawn;
mod speed_limits;
mod surroundings;
mod topology;
pub mod town;
mod trigger;
mod walk;
mod xml;

pub use environment::EnvironmentObject;
pub use error::{Diagnostic, MapError, Report, Severity, TooManyWaypoints};
pub use geo::GeoPlace;
pub use kinds::{LaneChange, LaneType, LaneTypes, MarkColor, MarkType};
pub use labels::{MapLayer, SceneryKind};
pub use landmarks::{LIGHT_HEAD_HALF_M, Landmark, LandmarkAhead};
pub use lanes::LanePose;
pub use lights::{LightController, LightGroup, TrafficLight, TrafficLights};
pub use map::Map;
pub use place::{LaneInfo, LaneMark, Waypoint};
pub use post::{Carried, Post};
pub use scenery::SceneryBox;
pub use signals::{Orientation, SignalPose};
pub use signs::{SignKind, TrafficSign};
pub use trigger::TriggerBox;
