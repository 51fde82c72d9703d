//! Rigid bodies and contacts between them: Rapier behind a narrow face.
//!
//! What is inside: one body per actor and the few scenery boxes near a moving actor. What is not:
//! the ground (wheels and fallen bodies ask [`Ground`](crate::ground::Ground)) and far scenery. So
//! a snapshot holds all of Rapier's state, including contact warm starts, islands and the broad
//! phase, in a few kilobytes, and a restored world continues bit for bit; poses and velocities
//! alone would not do, as warm starts and sleep timers differ from the first step on.

mod contact;
mod fault;
mod near_pairs;
mod put;
mod shapes;
mod sweep;
mod switch;
mod touch;
mod workspace;

use blueprints::{PropModel, WalkerModel};
use nalgebra::Matrix3;
use rapier3d::prelude::{
    BroadPhaseBvh, ColliderBuilder, ColliderHandle, ColliderSet, IntegrationParameters,
    InteractionGroups, IslandManager, MassProperties, NarrowPhase, RigidBody, RigidBodyBuilder,
    RigidBodyHandle, RigidBodySet, SharedShape,
};
use schemas::{ActorId, HaltReason, Pose, Vec3};
use serde::{Deserialize, Serialize};

use crate::blueprint::{prop_inertia_kgm2, walker_inertia_kgm2};
use crate::convert::{from_rapier, pose_from_rapier, pose_to_rapier, to_rapier};
use crate::vehicle::{Fit, GRAVITY_MPS2, Impulse};

pub(crate) use contact::Contact;
pub(crate) use fault::pose_fault;
use shapes::box_shape;

/// Names a body; never reused within a world.
pub(crate) type BodyHandle = RigidBodyHandle;
/// Names a scenery box inside the physics.
pub(crate) type SceneryHandle = ColliderHandle;

/// A body slower than this at its farthest point falls asleep...
const SLEEP_MPS: f32 = 0.02;
/// ...people who lie on the ground if slower than this...
const LYING_SLEEP_MPS: f32 = 0.1;
/// ...after this time.
const SLEEP_SECS: f32 = 1.0;
/// Passes of the contact solver over one physics step, each with its share of the step.
const SOLVER_ITERATIONS: usize = 2;
/// Friction of car bodies, walls and clothes against each other.
const BODY_FRICTION: f32 = 0.4;
/// Sheet metal gives way: little comes back.
const BODY_RESTITUTION: f32 = 0.1;
/// Height of a car's waist over its clearance, as a share of what is above the clearance.
const WAIST_SHARE: f32 = 0.5;
/// Length of the cabin over the length of the car.
const CABIN_SHARE: f32 = 0.55;

/// All bodies of a world.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Physics {
    bodies: RigidBodySet,
    colliders: ColliderSet,
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    narrow_phase: NarrowPhase,
}

/// A body whose motion became impossible, and what of it.
pub(crate) type Fault = (BodyHandle, HaltReason);

/// A body at one moment, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyState {
    pub world_from_body: Pose,
    /// Of the centre of mass.
    pub linear_mps: Vec3,
    pub angular_radps: Vec3,
    pub centre_of_mass_m: Vec3,
    pub asleep: bool,
}

/// How a body answers an impulse, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Response {
    pub inverse_mass_per_kg: f32,
    pub inverse_inertia: Matrix3<f32>,
}

impl BodyState {
    /// Speed of the centre of mass along the body's x axis.
    pub(crate) fn forward_mps(&self) -> f32 {
        self.linear_mps.dot(&(self.world_from_body.rotation * Vec3::x()))
    }
}

impl Response {
    /// The body with the velocities it has after an impulse.
    pub(crate) fn pushed(&self, body: &BodyState, impulse: &Impulse) -> BodyState {
        BodyState {
            linear_mps: body.linear_mps + impulse.linear_ns * self.inverse_mass_per_kg,
            angular_radps: body.angular_radps + self.inverse_inertia * impulse.angular_nms,
            ..*body
        }
    }
}

impl Physics {
    pub(crate) fn new() -> Self {
        Self {
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            islands: IslandManager::new(),
            broad_phase: near_pairs::of_few(),
            narrow_phase: NarrowPhase::new(),
        }
    }

    /// A car: a lower body over its whole length and a cabin on top.
    pub(crate) fn insert_vehicle(
        &mut self,
        fit: &Fit,
        world_from_vehicle: &Pose,
        linear_mps: Vec3,
        id: ActorId,
    ) -> BodyHandle {
        let model = fit.model;
        let body = RigidBodyBuilder::dynamic()
            .pose(pose_to_rapier(world_from_vehicle))
            .linvel(to_rapier(linear_mps))
            .additional_mass_properties(vehicle_mass(fit))
            .ccd_enabled(true)
            .build();
        let clearance_m = model.ground_clearance_m;
        let waist_m = clearance_m + WAIST_SHARE * (model.height_m - clearance_m);
        let lower = (model.length_m, clearance_m, waist_m);
        let cabin = (model.length_m * CABIN_SHARE, waist_m, model.height_m);
        let boxes = [lower, cabin].map(|(length_m, from_m, to_m)| {
            let half_m = Vec3::new(length_m, model.width_m, to_m - from_m) / 2.0;
            (box_shape(half_m), Pose::translation(0.0, 0.0, f32::midpoint(from_m, to_m)))
        });
        self.insert_body(body, boxes, touch::VEHICLE, id)
    }

    /// A pedestrian that stands still, asleep, unless it starts with a speed.
    pub(crate) fn insert_walker(
        &mut self,
        model: &WalkerModel,
        world_from_walker: &Pose,
        linear_mps: Vec3,
        standing: bool,
        id: ActorId,
    ) -> BodyHandle {
        let half_segment_m = model.height_m / 2.0 - model.radius_m;
        let inertia_kgm2 = walker_inertia_kgm2(model);
        let mass =
            MassProperties::new(to_rapier(Vec3::zeros()), model.mass_kg, inertia_kgm2.into());
        let body = RigidBodyBuilder::dynamic()
            .pose(pose_to_rapier(world_from_walker))
            .linvel(to_rapier(linear_mps))
            .additional_mass_properties(mass)
            .ccd_enabled(true)
            .angular_damping(0.5)
            .sleeping(standing)
            .build();
        let capsule = SharedShape::capsule_z(half_segment_m, model.radius_m);
        self.insert_body(body, [(capsule, Pose::identity())], touch::ANYTHING, id)
    }

    /// A box that stands on its origin; immovable until its physics is switched on.
    pub(crate) fn insert_prop(
        &mut self,
        model: &PropModel,
        world_from_prop: &Pose,
        id: ActorId,
    ) -> BodyHandle {
        let half_m = model.size_m / 2.0;
        let centre_m = Vec3::new(0.0, 0.0, half_m.z);
        let inertia_kgm2 = prop_inertia_kgm2(model);
        let mass = MassProperties::new(to_rapier(centre_m), model.mass_kg, inertia_kgm2.into());
        let body = RigidBodyBuilder::fixed()
            .pose(pose_to_rapier(world_from_prop))
            .additional_mass_properties(mass)
            .ccd_enabled(true)
            .build();
        let shape = (box_shape(half_m), Pose::translation(0.0, 0.0, half_m.z));
        self.insert_body(body, [shape], touch::prop(model), id)
    }

    /// Gives a vehicle another mass; it wakes up.
    pub(crate) fn set_vehicle_mass(&mut self, handle: BodyHandle, fit: &Fit) {
        let body = &mut self.bodies[handle];
        body.set_additional_mass_properties(vehicle_mass(fit), true);
        body.recompute_mass_properties_from_colliders(&self.colliders);
    }

    fn insert_body(
        &mut self,
        mut body: RigidBody,
        shapes: impl AsRef<[(SharedShape, Pose)]>,
        groups: InteractionGroups,
        id: ActorId,
    ) -> BodyHandle {
        let shapes = shapes.as_ref();
        sweep::note_width(&mut body, shapes);
        let activation = body.activation_mut();
        activation.normalized_linear_threshold = SLEEP_MPS;
        activation.time_until_sleep = SLEEP_SECS;
        let handle = self.bodies.insert(body);
        for (shape, body_from_shape) in shapes {
            let collider = ColliderBuilder::new(shape.clone())
                .position(pose_to_rapier(body_from_shape))
                .density(0.0)
                .friction(BODY_FRICTION)
                .restitution(BODY_RESTITUTION)
                .collision_groups(groups)
                .user_data(id.get().into());
            self.colliders.insert_with_parent(collider, handle, &mut self.bodies);
        }
        // The first substep applies impulses before Rapier's own step computes these.
        self.bodies[handle].recompute_mass_properties_from_colliders(&self.colliders);
        self.outgrow_tree();
        handle
    }

    pub(crate) fn insert_scenery(&mut self, world_from_box: &Pose, half_m: Vec3) -> SceneryHandle {
        let collider = ColliderBuilder::new(box_shape(half_m))
            .position(pose_to_rapier(world_from_box))
            .friction(BODY_FRICTION)
            .restitution(BODY_RESTITUTION);
        self.colliders.insert(collider)
    }

    pub(crate) fn remove_scenery(&mut self, handle: SceneryHandle) {
        let Self { colliders, islands, bodies, .. } = self;
        workspace::with(|own| {
            colliders.remove(handle, islands, bodies, &mut own.soft_bodies, true);
        });
    }

    pub(crate) fn remove_body(&mut self, handle: BodyHandle) {
        let Self { colliders, islands, bodies, .. } = self;
        workspace::with(|own| {
            bodies.remove(
                handle,
                islands,
                colliders,
                &mut own.impulse_joints,
                &mut own.multibody_joints,
                &mut own.soft_bodies,
                true,
            );
        });
    }

    /// Whether the handle names a body.
    pub(crate) fn contains(&self, handle: BodyHandle) -> bool {
        self.bodies.contains(handle)
    }

    /// Whether the handle names a scenery box.
    pub(crate) fn contains_scenery(&self, handle: SceneryHandle) -> bool {
        self.colliders.get(handle).is_some_and(|collider| collider.parent().is_none())
    }

    /// Whether a body touches a scenery box.
    pub(crate) fn is_touched(&self, handle: SceneryHandle) -> bool {
        self.narrow_phase.contact_pairs_with(handle).any(|pair| pair.has_any_active_contact())
    }

    pub(crate) fn body_count(&self) -> usize {
        self.bodies.len()
    }

    pub(crate) fn state(&self, handle: BodyHandle) -> BodyState {
        let body = &self.bodies[handle];
        BodyState {
            world_from_body: pose_from_rapier(body.position()),
            linear_mps: from_rapier(body.linvel()),
            angular_radps: from_rapier(body.angvel()),
            centre_of_mass_m: from_rapier(body.center_of_mass()),
            asleep: rests(body),
        }
    }

    /// Cheaper than the whole [`state`](Self::state), for the many that only stand; a body whose
    /// physics is off always does.
    pub(crate) fn is_asleep(&self, handle: BodyHandle) -> bool {
        rests(&self.bodies[handle])
    }

    /// The body's z axis in the world.
    pub(crate) fn up(&self, handle: BodyHandle) -> Vec3 {
        pose_from_rapier(self.bodies[handle].position()).rotation * Vec3::z()
    }

    /// Velocity of the centre of mass, world frame.
    pub(crate) fn linear_mps(&self, handle: BodyHandle) -> Vec3 {
        from_rapier(self.bodies[handle].linvel())
    }

    pub(crate) fn response(&self, handle: BodyHandle) -> Response {
        let properties = self.bodies[handle].mass_properties();
        let column =
            |axis: Vec3| from_rapier(properties.effective_world_inv_inertia * to_rapier(axis));
        Response {
            inverse_mass_per_kg: properties.effective_inv_mass.x,
            inverse_inertia: Matrix3::from_columns(&[
                column(Vec3::x()),
                column(Vec3::y()),
                column(Vec3::z()),
            ]),
        }
    }

    /// Spreads an impulse on an awake body over the next step; one that no body can take is a fault
    /// of the body, which then is left as it is.
    ///
    /// As a force and not at once: Rapier integrates gravity in parts of the step, and a car whose
    /// weight is carried at once would report to fall while it stands.
    pub(crate) fn push(
        &mut self,
        handle: BodyHandle,
        impulse: &Impulse,
        dt_secs: f32,
    ) -> Option<Fault> {
        let body = &mut self.bodies[handle];
        body.reset_forces(false);
        body.reset_torques(false);
        let properties = body.mass_properties();
        let turn = properties.effective_world_inv_inertia * to_rapier(impulse.angular_nms);
        let change = to_rapier(impulse.linear_ns) * properties.effective_inv_mass;
        let fault = fault::velocity_fault(
            &from_rapier(body.linvel() + change),
            &from_rapier(body.angvel() + turn),
        );
        if let Some(reason) = fault {
            return Some((handle, reason));
        }
        body.add_force(to_rapier(impulse.linear_ns / dt_secs), false);
        body.add_torque(to_rapier(impulse.angular_nms / dt_secs), false);
        None
    }

    /// Whether nothing moves by itself: every body sleeps or is held, and further steps do nothing.
    pub(crate) fn is_at_rest(&self) -> bool {
        self.islands.active_bodies().next().is_none()
    }

    pub(crate) fn wake(&mut self, handle: BodyHandle) {
        self.bodies[handle].wake_up(true);
    }

    /// Advances all bodies under gravity and contacts; those whose motion became impossible, among
    /// them what Rapier itself took out, must then be [put to rest](Self::put_to_rest).
    pub(crate) fn step(&mut self, dt_secs: f32) -> Vec<Fault> {
        let parameters = IntegrationParameters {
            dt: dt_secs,
            max_ccd_substeps: self.sweeps(dt_secs),
            num_solver_iterations: SOLVER_ITERATIONS,
            ..IntegrationParameters::default()
        };
        let gravity_mps2 = to_rapier(-Vec3::z() * GRAVITY_MPS2);
        workspace::with(|own| {
            own.pipeline.step(
                gravity_mps2,
                &parameters,
                &mut self.islands,
                &mut self.broad_phase,
                &mut self.narrow_phase,
                &mut self.bodies,
                &mut self.colliders,
                &mut own.impulse_joints,
                &mut own.multibody_joints,
                &mut own.soft_bodies,
                &mut own.ccd,
                &(),
                &(),
            );
            self.faults(own.pipeline.quarantine())
        })
    }
}

/// Whether a body is left alone by everything but a touch.
fn rests(body: &RigidBody) -> bool {
    body.is_sleeping() || !body.is_dynamic()
}

fn vehicle_mass(fit: &Fit) -> MassProperties {
    let centre_m = to_rapier(fit.physics.centre_of_mass_m);
    MassProperties::new(centre_m, fit.physics.mass_kg, fit.inertia_kgm2().into())
}
