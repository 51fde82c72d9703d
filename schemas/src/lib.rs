//! What crosses a process border: messages, ids, units, keys, limits. No bus, no I/O.
//!
//! Messages are plain Rust types here and FlatBuffers on the wire; [`wire`] converts, checks sizes
//! and verifies. The `.fbs` files in `fbs/` are the contract for every other language.
//!
//! - [`Frame`] is what one tick of a world produced.
//! - [`Request`] and [`Reply`] are the conversation with a world service.
//! - [`RenderJob`] is a frame and the cameras that look at it.
//!
//! **Units and frames:** SI, radians, right-handed, x forward/east, y left/north, z up. CARLA's
//! left-handed degrees exist only in [`carla`].

mod alive;
mod camera;
mod command;
mod description;
mod error;
mod frame;
#[allow(
    warnings,
    unsafe_code,
    clippy::all,
    clippy::pedantic,
    reason = "flatc writes this code; `cargo run -p codegen -- --check` keeps it as written"
)]
#[rustfmt::skip]
mod generated;
mod geometry;
mod halt;
mod hidden;
mod ids;
mod random;
mod request;
mod semantics;
mod sensor;
mod shared_frame;
mod staging;
mod texture;
mod v2x;
mod vehicle;
mod walker_pose;
mod weather;

pub mod carla;
pub mod gait;
pub mod keys;
pub mod limits;
pub mod skeleton;
pub mod wire;

pub use alive::{Alive, Load, ServiceKind};
pub use camera::{Camera, DEPTH_MAX_M, Image, ImageEncoding, ImageKind, PictureQuality, RenderJob};
pub use command::{
    AgentBehaviour, AgentCommand, AgentOptions, Attachment, AttachmentKind, Attribute, BodyCommand,
    BodySwitch, Command, PilotMode, Proximity, PushKind, SceneryCommand, SensorCommand,
    TrafficCommand, TrafficLightCommand, VehicleCommand, WalkerCommand, WalkerStage,
};
pub use description::{ActorDescription, RayHit, VehicleReport};
pub use error::{Error, ErrorCode};
pub use frame::{
    ActorKind, ActorState, AgentState, AgentStatus, Collision, Frame, MapRef, RulesBroken,
    TrafficLightColour, TrafficLightState, VehicleControl, VehicleFailure, WalkerControl, Weather,
};
pub use geometry::{Pose, Translation3, UnitQuaternion, Vec3, level_pose, yaw_rad};
pub use halt::{Halt, HaltReason};
pub use hidden::HiddenScenery;
pub use ids::{ActorId, InvalidName, RESERVED, ServiceId, Tenant, Tick, WorldId};
pub use random::SplitMix64;
pub use request::{
    CommandReply, EncodedFrame, Images, Lease, Reply, Request, TickItem, TickOutcome, TickResult,
    WorldInfo,
};
pub use semantics::{SemanticTag, TagId};
pub use sensor::{LidarPoint, Measurement, RadarDetection, Scan, SemanticLidarPoint, SensorDatum};
pub use shared_frame::{FrameBytes, SharedFrame};
pub use skeleton::{Limb, PosedLimb};
pub use staging::{Exposure, Staging, StreetLight};
pub use texture::{Coat, MaterialParameter, Paint, Texture};
pub use v2x::{AwarenessMessage, CustomMessage, Received, StationKind, StationMotion};
pub use vehicle::{
    AckermannControl, AckermannGains, Gear, Handling, VehiclePhysics, VehicleTelemetry,
    WheelPhysics, WheelTelemetry,
};
pub use walker_pose::{BonePose, BonesChange, WalkerPose};

/// The schema of [`Frame`] in FlatBuffers' binary form, for files that carry frames.
pub const FRAME_SCHEMA: &[u8] = include_bytes!("../bfbs/frame.bfbs");
