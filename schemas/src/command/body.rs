//! Changes of anything with a body.

use crate::{ActorId, Pose, Vec3};

/// One change of a body.
#[derive(Clone, Debug, PartialEq)]
pub enum BodyCommand {
    /// Overrides velocities; `None` stays.
    SetVelocity {
        /// Which actor.
        actor: ActorId,
        /// Metres per second, world frame.
        linear_mps: Option<Vec3>,
        /// Radians per second, world frame.
        angular_radps: Option<Vec3>,
    },
    /// Holds a velocity against all forces; `None` lets go.
    SetConstantVelocity {
        /// Which actor.
        actor: ActorId,
        /// Metres per second, actor frame.
        velocity_mps: Option<Vec3>,
    },
    /// Pushes a body.
    Push {
        /// Which actor.
        actor: ActorId,
        /// How.
        kind: PushKind,
        /// How much and where to, world frame; the unit follows the kind.
        amount: Vec3,
    },
    /// Moves an actor at once, keeping its velocity.
    SetPose {
        /// Which actor.
        actor: ActorId,
        /// Where: in the parent when attached, else in the world.
        reference_from_actor: Pose,
    },
    /// Turns a property of a body on or off.
    SetSwitch {
        /// Which actor.
        actor: ActorId,
        /// What.
        switch: BodySwitch,
        /// On or off.
        on: bool,
    },
}

/// What a push is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PushKind {
    /// Newton seconds.
    Impulse,
    /// Newtons, during the next tick.
    Force,
    /// Newton metre seconds.
    AngularImpulse,
    /// Newton metres, during the next tick.
    Torque,
}

/// What of a body can be turned off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BodySwitch {
    /// Off: it stays where it is put.
    Physics,
    /// Off: it does not fall.
    Gravity,
    /// Off: nothing touches it.
    Collisions,
}
