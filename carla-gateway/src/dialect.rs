//! CARLA's messages as types: each is a MessagePack array with its fields in this order. Conversion
//! to and from our units and axes happens here, through [`schemas::carla`].
//!
//! **Units:** metres, degrees, seconds; left-handed, y right.

mod actor;
mod command;
mod debug;
mod geometry;
mod physics;
mod scenery;
mod settings;
mod texture;
mod union;
mod vehicle;
mod version;
mod walker;
mod weather;

pub(crate) use actor::AttributeValue;
pub(crate) use actor::{Actor, ActorAttribute, ActorDefinition, ActorDescription, ActorRef};
pub(crate) use command::{BatchCommand, BatchResponse};
pub(crate) use debug::{DebugShape, Line, Primitive};
pub(crate) use geometry::{BoundingBox, Location, Rotation, Transform, Vector2D, Vector3D};
pub(crate) use geometry::{mirrored_spin, spin_deg, spin_from_deg, twist_from_deg};
pub(crate) use physics::counted as counted_wheels;
pub(crate) use physics::{PhysicsControl, TelemetryData, VehiclePhysicsControl};
pub(crate) use scenery::{EnvironmentObject, LabelledPoint, LightState};
pub(crate) use settings::{EpisodeSettings, MapInfo, OpendriveParameters, Token};
pub(crate) use texture::{Colour, FloatColour, Linear, Texture};
pub(crate) use union::Opt;
pub(crate) use vehicle::{AckermannControl, AckermannSettings, LightFlags, VehicleControl};
pub use version::ClientVersion;
pub(crate) use walker::WalkerControl;
pub(crate) use weather::WeatherParameters;
