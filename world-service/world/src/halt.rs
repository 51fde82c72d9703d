//! Puts an actor to rest whose motion became impossible, so that its world and its neighbours go
//! on.
//!
//! What no body could do is found where it begins: an impulse before it reaches the solver, which
//! would spread it to all that touch, and a body after every substep. The actor is put back where
//! it was before that substep, its physics is switched off, and [`Frame::halted`] tells of it until
//! a client switches its physics on again or destroys it.
//!
//! [`Frame::halted`]: schemas::Frame::halted

use schemas::{ActorId, Error, ErrorCode, Halt, HaltReason, Pose, Tick, Vec3};

use crate::actor::{Actor, Outside, Vehicle};
use crate::physics::{BodyHandle, Fault, pose_fault};
use crate::vehicle::VehicleState;
use crate::walker::Walker;
use crate::world::State;

impl State {
    /// Puts those bodies to rest at fault in a substep; `before` knows where awake ones began it.
    pub(crate) fn halt_bodies(
        &mut self,
        faults: &[Fault],
        before: impl Fn(ActorId) -> Option<Pose>,
    ) {
        for &(handle, reason) in faults {
            let owner = |actor: &Actor| actor.rigid() == Some(handle);
            let Some(index) = self.actors.iter().position(owner) else { continue };
            let id = self.actors[index].id;
            let present = self.physics.state(handle).world_from_body;
            let possible = |pose: &Pose| pose_fault(pose).is_none();
            match before(id).or(Some(present)).filter(possible) {
                Some(pose) => self.halt(index, handle, &pose, reason),
                // Nobody knows where it has been.
                None => self.remove(index),
            }
        }
    }

    /// Puts actors to rest that have a body at a possible pose but whose wheels or legs are at
    /// fault, which would go on for ever and could not be restored.
    pub(crate) fn halt_states(&mut self) {
        for index in 0..self.actors.len() {
            let actor = &self.actors[index];
            let wheels_turn =
                actor.vehicle.as_deref().is_none_or(|vehicle| vehicle.values().all(f32::is_finite));
            let legs_walk =
                actor.walker.as_deref().is_none_or(|walker| walker.values().all(f32::is_finite));
            if wheels_turn && legs_walk {
                continue;
            }
            let Some(handle) = actor.rigid() else { continue };
            let pose = self.physics.state(handle).world_from_body;
            self.halt(index, handle, &pose, HaltReason::NotFinite);
        }
    }

    fn halt(&mut self, index: usize, handle: BodyHandle, pose: &Pose, reason: HaltReason) {
        let actor = &mut self.actors[index];
        actor.switches.physics = false;
        actor.outside = Outside::default();
        if let Some(vehicle) = actor.vehicle_mut() {
            vehicle.leave();
            let Vehicle { state, tuning, ackermann, .. } = vehicle;
            *state = VehicleState::rolling(tuning.fit(), 0.0);
            *ackermann = ackermann.afresh();
        }
        if let Some((_, walker)) = actor.walker_mut() {
            *walker = Walker::new(Vec3::zeros());
        }
        let (id, touches) = (actor.id, actor.switches.collisions);
        self.physics.put_to_rest(handle, pose, touches);
        self.note_halt(id, reason);
    }

    /// As when a client destroys it.
    pub(crate) fn remove(&mut self, index: usize) {
        let id = self.actors[index].id;
        self.detach_from(id);
        let actor = self.actors.remove(index);
        if let Some(body) = actor.rigid() {
            self.physics.remove_body(body);
        }
        self.contacts.forget(id);
        self.sensors.remove(id);
        self.resume(id);
        self.forget_pose(id);
    }

    pub(crate) fn note_halt(&mut self, actor: ActorId, reason: HaltReason) {
        let halt = Halt { tick: Tick(self.tick.0 + 1), actor, reason };
        match self.halted.binary_search_by_key(&actor, |halt| halt.actor) {
            Ok(known) => self.halted[known] = halt,
            Err(place) => self.halted.insert(place, halt),
        }
    }

    /// An actor moves again, or is gone.
    pub(crate) fn resume(&mut self, id: ActorId) {
        self.halted.retain(|halt| halt.actor != id);
    }

    /// Whether only actors of this world are at rest, each once.
    pub(crate) fn halts_fit(&self) -> bool {
        let known = |halt: &Halt| self.index_of(halt.actor).is_ok();
        let ordered = self.halted.windows(2).all(|pair| pair[0].actor < pair[1].actor);
        ordered && self.halted.iter().all(known)
    }

    /// # Errors
    /// `WorldQuarantined` for the first actor whose motion is impossible after all.
    pub(crate) fn check(&self) -> Result<(), Error> {
        for actor in &self.actors {
            let body = self.motion_of(actor);
            // What is carried on a long arm may be fast; its carrier is not.
            let is_carried = actor.body.attachment().is_some();
            let fault = body.fault();
            if let Some(reason) = fault.filter(|why| !is_carried || *why != HaltReason::TooFast) {
                let message = format!("{} diverged at {}: {reason}", actor.id, self.tick);
                return Err(Error::new(ErrorCode::WorldQuarantined, message)
                    .wanted("finite positions and speeds within the limits")
                    .found(format!("{:?}, {:?}", body.world_from_body, body.linear_mps)));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
