//! CARLA's recordings: what a log of CARLA 0.9.16 says, written, read, asked and replayed.
//!
//! - [`Writer`] turns the packets of each frame into a log; a log is whole up to its last frame,
//!   whatever happens to the one who writes it.
//! - [`Reader`] gives the frames of a log one after the other, also of logs that older servers and
//!   that of UE5 wrote; memory is bounded by one frame.
//! - [`check`] tells where a log is damaged.
//! - [`query`] answers what CARLA's clients ask about a log, in CARLA's words.
//! - [`Player`] replays a log: time goes in, what is to be done with actors comes out. [`Index`]
//!   lets it begin anywhere.
//!
//! Everything is as in the file: centimetres, degrees, left-handed (x forward, y right, z up).
//! Nothing here opens files or asks for the time.
//!
//! **Source:** the recorder of CARLA 0.9.16 and genuine logs of 0.9.13.

mod bytes;
mod check;
mod cut;
mod dialect;
mod header;
mod index;
mod journal;
mod packet;
mod physics;
mod player;
pub mod query;
mod reader;
mod record;
mod writer;

pub use bytes::{Long, Malformed};
pub use check::check;
pub use cut::cut;
pub use header::{Header, NotARecording};
pub use index::{Event, Index, Span};
pub use journal::{JournalLink, WorldState};
pub use packet::{Kind, Packet};
pub use physics::{Gear, PhysicsControl, PhysicsWheel};
pub use player::{FACTOR_WITHOUT_INTERPOLATION, Player, Step};
pub use reader::{Cut, FRAME_BYTES_MAX, Frame, RawPacket, Reader};
pub use record::{
    Add, Attribute, Biker, Bone, Bones, Box3, Class, Collision, Destroy, Door, FrameStart,
    Kinematics, LightState, LightTimes, Parent, Position, Rotation, SceneLight, Vector,
    VehicleControl, VehicleLights, WalkerSpeed, Weather, WheelPose, Wheels, attribute, light,
};
pub use writer::{Additional, FrameContent, UNKNOWN_DURATION, Writer};
