//! Where actors are and how they move, with and without a rigid body.
//!
//! Everything that asks for a pose or a velocity goes through [`State::motion_of`]; only what
//! pushes bodies asks an actor for its [rigid](Body::rigid) one.

use schemas::{ActorId, Attachment, AttachmentKind, Pose, Vec3};

use crate::actor::Actor;
use crate::body::{Attached, Body};
use crate::physics::{BodyState, pose_fault};
use crate::spring_arm;
use crate::world::State;

/// Actors hanging on actors hanging on actors, at most.
const CHAIN_MAX: usize = 8;

impl BodyState {
    /// Something at rest, carried by nothing.
    fn still(world_from_body: Pose) -> Self {
        Self {
            world_from_body,
            linear_mps: Vec3::zeros(),
            angular_radps: Vec3::zeros(),
            centre_of_mass_m: world_from_body.translation.vector,
            asleep: true,
        }
    }

    /// Something that this body carries, at a pose in the world.
    fn carrying(&self, world_from_actor: Pose) -> Self {
        let place_m = world_from_actor.translation.vector;
        let arm_m = place_m - self.centre_of_mass_m;
        Self {
            world_from_body: world_from_actor,
            linear_mps: self.linear_mps + self.angular_radps.cross(&arm_m),
            angular_radps: self.angular_radps,
            centre_of_mass_m: place_m,
            asleep: self.asleep,
        }
    }
}

impl State {
    /// Pose and velocities of an actor, world frame.
    pub(crate) fn motion_of(&self, actor: &Actor) -> BodyState {
        match &actor.body {
            Body::Rigid(handle) if actor.switches.physics => self.physics.state(*handle),
            Body::Rigid(handle) => {
                BodyState { linear_mps: actor.outside.told_mps, ..self.physics.state(*handle) }
            }
            Body::Fixed(pose) => BodyState::still(*pose),
            Body::Attached(attached) => self.motion_of_attached(attached),
        }
    }

    /// Where an actor is, world frame.
    pub(crate) fn pose_of(&self, actor: &Actor) -> Pose {
        self.motion_of(actor).world_from_body
    }

    /// How an actor moves, metres per second, world frame.
    pub(crate) fn velocity_of(&self, actor: &Actor) -> Vec3 {
        match &actor.body {
            Body::Rigid(handle) if actor.switches.physics => self.physics.linear_mps(*handle),
            _ => self.motion_of(actor).linear_mps,
        }
    }

    /// An actor by its id.
    pub(crate) fn actor(&self, id: ActorId) -> Option<&Actor> {
        self.index_of(id).ok().and_then(|index| self.actors.get(index))
    }

    /// Whether one more actor may hang on this one.
    pub(crate) fn can_carry(&self, parent: &Actor) -> bool {
        self.chain_of(parent).take(CHAIN_MAX).count() < CHAIN_MAX
    }

    /// Whether what an actor hangs on is older than itself and not too long a chain.
    pub(crate) fn hangs_well(&self, actor: &Actor) -> bool {
        let older = actor.body.attachment().is_none_or(|to| to.parent < actor.id);
        older && self.chain_of(actor).take(CHAIN_MAX + 1).count() <= CHAIN_MAX
    }

    /// An actor, its parent, its parent's parent, and so on.
    fn chain_of<'a>(&'a self, actor: &'a Actor) -> impl Iterator<Item = &'a Actor> {
        std::iter::successors(Some(actor), |child| self.actor(child.body.attachment()?.parent))
    }

    fn motion_of_attached(&self, attached: &Attached) -> BodyState {
        let Some(parent) = self.actor(attached.to.parent) else {
            return BodyState::still(attached.world_from_actor);
        };
        let carrier = self.motion_of(parent);
        match attached.to.kind {
            AttachmentKind::Rigid => {
                carrier.carrying(carrier.world_from_body * attached.parent_from_actor)
            }
            AttachmentKind::SpringArm | AttachmentKind::SpringArmGhost => {
                carrier.carrying(attached.world_from_actor)
            }
        }
    }

    /// Lets spring arms follow their parents, and keeps where everything attached is. What would be
    /// carried out of the world stays where it was.
    pub(crate) fn carry_attached(&mut self, dt_secs: f32) {
        for index in 0..self.actors.len() {
            let Body::Attached(attached) = &self.actors[index].body else { continue };
            let Some(parent) = self.actor(attached.to.parent) else { continue };
            let world_from_parent = self.pose_of(parent);
            let world_from_actor = match attached.to.kind {
                AttachmentKind::Rigid => world_from_parent * attached.parent_from_actor,
                AttachmentKind::SpringArm | AttachmentKind::SpringArmGhost => {
                    spring_arm::follow(attached, &world_from_parent, dt_secs)
                }
            };
            if let Some(reason) = pose_fault(&world_from_actor) {
                let (id, last) = (self.actors[index].id, attached.world_from_actor);
                self.actors[index].body = Body::Fixed(last);
                self.note_halt(id, reason);
                continue;
            }
            if let Body::Attached(attached) = &mut self.actors[index].body {
                attached.world_from_actor = world_from_actor;
            }
        }
    }

    /// Leaves everything that hangs on an actor where it is, as CARLA does when a parent goes.
    pub(crate) fn detach_from(&mut self, parent: ActorId) {
        for index in 0..self.actors.len() {
            let hangs = |to: Attachment| to.parent == parent;
            if self.actors[index].body.attachment().is_some_and(hangs) {
                let pose = self.pose_of(&self.actors[index]);
                self.actors[index].body = Body::Fixed(pose);
            }
        }
    }
}
