//! What a step of Rapier needs besides the state: buffers, and sets that stay empty.
//!
//! One per thread and not one per world: a thread that ticks a thousand worlds in turn then keeps
//! it in its cache, and a world is half as large. Nothing in it decides anything.

use std::cell::Cell;

use rapier3d::prelude::{
    CCDSolver, ImpulseJointSet, MultibodyJointSet, PhysicsPipeline, SoftBodySet,
};

#[derive(Default)]
pub(super) struct Workspace {
    pub(super) pipeline: PhysicsPipeline,
    pub(super) ccd: CCDSolver,
    pub(super) impulse_joints: ImpulseJointSet,
    pub(super) multibody_joints: MultibodyJointSet,
    pub(super) soft_bodies: SoftBodySet,
}

thread_local! {
    static OWN: Cell<Option<Box<Workspace>>> = const { Cell::new(None) };
}

/// Works with that of this thread. One in which a step panicked is never used again.
pub(super) fn with<T>(work: impl FnOnce(&mut Workspace) -> T) -> T {
    let mut own = OWN.take().unwrap_or_default();
    let result = work(&mut own);
    OWN.set(Some(own));
    result
}
