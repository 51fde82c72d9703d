//! What one actor's body is given in a substep: by wheels, legs, air, ground and clients.

use schemas::{Pose, Vec3, limits};

use crate::actor::{Actor, Outside, Vehicle};
use crate::blueprint::BodySpec;
use crate::check;
use crate::fallen;
use crate::ground::Ground;
use crate::physics::{BodyHandle, BodyState, Fault, Physics};
use crate::vehicle::{Chassis, GRAVITY_MPS2, Impulse};

/// Speed at which the air carries the weight of a falling person.
const TERMINAL_MPS: f32 = 55.0;

/// What surrounds all actors of a world alike.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub ground: &'a Ground,
    /// Friction of the whole road over that of a dry one.
    pub grip: f32,
    pub dt_secs: f32,
}

impl Surroundings<'_> {
    /// Pushes one awake actor, unless no body could take the push.
    pub(crate) fn push(
        &self,
        actor: &mut Actor,
        handle: BodyHandle,
        physics: &mut Physics,
    ) -> Option<Fault> {
        hold(actor, handle, physics);
        let body = &physics.state(handle);
        let gravity_mps2 = if actor.switches.gravity { GRAVITY_MPS2 } else { 0.0 };
        if self.ground.buries(body.centre_of_mass_m) {
            return self.rest(handle, gravity_mps2, physics);
        }
        let mut total = self.by_client(actor, body);
        let mut carried = false;
        if let Some(Vehicle { state, tuning, .. }) = actor.vehicle_mut() {
            let chassis = Chassis::new(
                &body.world_from_body,
                body.centre_of_mass_m,
                body.linear_mps,
                body.angular_radps,
            );
            let (fit, dt_secs) = (tuning.fit(), self.dt_secs);
            total += state.substep(fit, &chassis, self.ground, self.grip, dt_secs);
            let up = body.world_from_body.rotation * Vec3::z();
            carried = state.rides_on_wheels(fit, up.z);
        } else if let Some((spec, walker)) = actor.walker_mut() {
            match walker.substep(spec, body, self.ground, gravity_mps2, self.dt_secs) {
                Some(gait) => {
                    physics.hold_upright(handle, gait.upright, gait.turn_radps);
                    let weight_mps = if gait.carried { gravity_mps2 * self.dt_secs } else { 0.0 };
                    let change_mps = gait.change_mps + Vec3::z() * weight_mps;
                    total += Impulse { linear_ns: change_mps * spec.mass_kg, ..Impulse::default() };
                    carried = true;
                }
                None => physics.lay_down(handle),
            }
        }
        if !carried {
            self.by_ground(actor, handle, physics, gravity_mps2, &mut total);
        }
        let total = within_hold(actor, &body.world_from_body, total);
        physics.push(handle, &total, self.dt_secs)
    }

    /// Keeps a body where it is.
    fn rest(&self, handle: BodyHandle, gravity_mps2: f32, physics: &mut Physics) -> Option<Fault> {
        let weight_mps = Vec3::z() * (gravity_mps2 * self.dt_secs);
        let linear_ns = weight_mps / physics.response(handle).inverse_mass_per_kg;
        physics.set_velocity(handle, Vec3::zeros(), Vec3::zeros());
        physics.push(handle, &Impulse { linear_ns, ..Impulse::default() }, self.dt_secs)
    }

    /// Forces and torques of clients; a body that moves or turns as fast as they may make it is not
    /// pushed or turned further.
    fn by_client(&self, actor: &Actor, body: &BodyState) -> Impulse {
        let share = |size: f32, most: f32| if size < most { self.dt_secs } else { 0.0 };
        let moved = share(body.linear_mps.norm(), limits::SPEED_MPS_MAX);
        let turned = moved.min(share(body.angular_radps.norm(), check::SPIN_RADPS_MAX));
        let Outside { force_n, torque_nm, .. } = actor.outside;
        Impulse { linear_ns: force_n * moved, angular_nms: torque_nm * turned }
    }

    /// Keeps a body out of the ground, and lets the air slow what has no drag of its own.
    fn by_ground(
        &self,
        actor: &Actor,
        handle: BodyHandle,
        physics: &Physics,
        gravity_mps2: f32,
        total: &mut Impulse,
    ) {
        let body = physics.state(handle);
        let response = physics.response(handle);
        if actor.vehicle.is_none() {
            let drag_per_sec =
                GRAVITY_MPS2 * body.linear_mps.norm() / (TERMINAL_MPS * TERMINAL_MPS);
            let slowed_mps = body.linear_mps * (drag_per_sec * self.dt_secs).min(1.0);
            total.linear_ns -= slowed_mps / response.inverse_mass_per_kg;
        }
        let pushed = response.pushed(&body, total);
        let shape = ground_box(actor);
        let (ground, dt_secs) = (self.ground, self.dt_secs);
        *total += fallen::ground_impulse(&pushed, &response, shape, ground, gravity_mps2, dt_secs);
    }
}

/// Gives a body the velocity at which a client holds it: along and across always, upwards only when
/// asked, so that wheels and feet keep following the ground.
fn hold(actor: &mut Actor, handle: BodyHandle, physics: &mut Physics) {
    let Some(held_mps) = actor.outside.held_mps else { return };
    let body = physics.state(handle);
    let rotation = body.world_from_body.rotation;
    let mut in_actor_mps = rotation.inverse() * body.linear_mps;
    in_actor_mps.x = held_mps.x;
    in_actor_mps.y = held_mps.y;
    if held_mps.z != 0.0 {
        in_actor_mps.z = held_mps.z;
    }
    let linear_mps = rotation * in_actor_mps;
    physics.set_velocity(handle, linear_mps, body.angular_radps);
    if let Some((_, walker)) = actor.walker_mut() {
        walker.own_mps = linear_mps;
    }
}

/// The part of an impulse that does not work against a held velocity.
fn within_hold(actor: &Actor, world_from_actor: &Pose, total: Impulse) -> Impulse {
    let Some(held_mps) = actor.outside.held_mps else { return total };
    let in_actor_ns = world_from_actor.rotation.inverse() * total.linear_ns;
    let upwards_ns = if held_mps.z == 0.0 { in_actor_ns.z } else { 0.0 };
    let linear_ns = world_from_actor.rotation * Vec3::new(0.0, 0.0, upwards_ns);
    Impulse { linear_ns, ..total }
}

/// The box that keeps an actor out of the ground: centre and half size in its frame.
fn ground_box(actor: &Actor) -> (Vec3, Vec3) {
    let blueprint = actor.blueprint();
    let (mut centre_m, mut half_m) = (blueprint.box_centre_m(), blueprint.box_half_extent_m());
    if let BodySpec::Vehicle(spec) = blueprint.body {
        centre_m.z += spec.ground_clearance_m / 2.0;
        half_m.z -= spec.ground_clearance_m / 2.0;
    }
    (centre_m, half_m)
}
