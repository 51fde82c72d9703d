//! The records that packets are made of.

mod event;
mod motion;
mod scene;
mod vehicle;
mod walker;

pub use event::{Add, Attribute, Class, Collision, Destroy, FrameStart, Parent, attribute};
pub use motion::{Box3, Kinematics, Position, Rotation, Vector};
pub use scene::{LightState, LightTimes, SceneLight, Weather};
pub use vehicle::{Biker, Door, VehicleControl, VehicleLights, WheelPose, Wheels, light};
pub use walker::{Bone, Bones, WalkerSpeed};
