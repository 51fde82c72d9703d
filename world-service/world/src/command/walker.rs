//! Commands for walkers.

use schemas::{
    ActorId, BonesChange, Error, ErrorCode, Pose, Vec3, WalkerCommand, WalkerControl, WalkerPose,
    limits,
};

use crate::bones;
use crate::check;
use crate::place;
use crate::world::World;

impl World {
    pub(super) fn change_walker(&mut self, command: &WalkerCommand) -> Result<(), Error> {
        match command {
            WalkerCommand::Control { actor, control } => self.set_walker_control(*actor, *control),
            WalkerCommand::Agent { actor, goal_m, speed_mps, crossing_share } => {
                self.set_walker_agent(*actor, *goal_m, *speed_mps, *crossing_share)
            }
            WalkerCommand::Trajectory { actor, stages, trigger } => {
                self.set_walker_trajectory(*actor, stages, *trigger)
            }
            WalkerCommand::State { actor, world_from_actor, speed_mps } => {
                self.set_walker_state(*actor, world_from_actor, *speed_mps)
            }
            WalkerCommand::Bones { actor, change } => self.set_walker_bones(*actor, change),
        }
    }

    fn set_walker_control(&mut self, id: ActorId, control: WalkerControl) -> Result<(), Error> {
        check::range("speed", control.speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
        check::vector("direction", control.direction, f32::MAX, "")?;
        let index = self.walker_index(id)?;
        let actor = &mut self.state.actors[index];
        actor.outside.told_mps = Vec3::zeros();
        let body = actor.rigid();
        if let Some((_, walker)) = actor.walker_mut() {
            walker.errand = None;
            let changed = walker.control != control;
            walker.set_control(control);
            if let Some(body) = body.filter(|_| changed) {
                self.state.physics.wake(body);
            }
        }
        Ok(())
    }

    /// Puts a walker with its feet onto the ground under or above the place, facing and, unless its
    /// physics is off, walking along the pose's x axis.
    fn set_walker_state(
        &mut self,
        id: ActorId,
        world_from_actor: &Pose,
        speed_mps: f32,
    ) -> Result<(), Error> {
        check::pose(world_from_actor)?;
        check::range("speed", speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
        let index = self.walker_index(id)?;
        let actor = &mut self.state.actors[index];
        let placed = place::on_ground(actor.blueprint(), world_from_actor, &self.town.ground);
        let direction = placed.world_from_actor.rotation * Vec3::x();
        let velocity_mps = direction * speed_mps;
        actor.outside.told_mps = velocity_mps;
        let body = actor.rigid();
        if let Some((_, walker)) = actor.walker_mut() {
            walker.errand = None;
            walker.set_control(WalkerControl { direction, speed_mps, jump: false });
            walker.place(velocity_mps);
        }
        if let Some(body) = body {
            self.state.physics.set_pose(body, &placed.world_from_actor);
            self.state.physics.set_velocity(body, velocity_mps, Vec3::zeros());
        }
        Ok(())
    }

    fn set_walker_bones(&mut self, id: ActorId, change: &BonesChange) -> Result<(), Error> {
        bones::check_bones(&change.bones)?;
        change.share.map_or(Ok(()), bones::check_share)?;
        self.walker_index(id)?;
        let mut pose = self.state.walker_pose(id).cloned().unwrap_or_else(|| WalkerPose::none(id));
        pose.change(change);
        self.state.keep_pose(pose)
    }

    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor without legs.
    pub(crate) fn walker_index(&self, id: ActorId) -> Result<usize, Error> {
        let index = self.state.index_of(id)?;
        let actor = &self.state.actors[index];
        if actor.walker.is_some() {
            return Ok(index);
        }
        Err(Error::new(ErrorCode::InvalidArgument, "the actor cannot walk")
            .wanted("a walker")
            .found(format!("{id}, a {:?}", actor.blueprint().kind())))
    }
}
