//! Walkers that find their own way, and those that follow one that is given.

use agents::{Obstacle, Outlook, Scene, Stroller, Trajectory};
use schemas::{ActorId, Error, ErrorCode, Proximity, Vec3, WalkerStage, limits};

use crate::check;
use crate::scenery::Reach;
use crate::town::Town;
use crate::walker::Errand;
use crate::world::{State, World};

impl World {
    pub(crate) fn set_walker_agent(
        &mut self,
        id: ActorId,
        goal_m: Option<Vec3>,
        speed_mps: Option<f32>,
        crossing_share: f32,
    ) -> Result<(), Error> {
        if let Some(goal_m) = goal_m {
            check::vector("goal", goal_m, limits::COORDINATE_M_MAX, "m")?;
        }
        if let Some(speed_mps) = speed_mps {
            check::range("speed", speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
        }
        check::range("crossing share", crossing_share, 0.0, 1.0, "")?;
        let index = self.walker_index(id)?;
        if self.town.nav().is_none() {
            return Err(Error::new(ErrorCode::Unsupported, "the map has nowhere to walk")
                .wanted("a map with sidewalks")
                .found(&self.map_ref().name));
        }
        let actor = &mut self.state.actors[index];
        if let Some((_, walker)) = actor.walker_mut() {
            let stroller = Stroller::new(goal_m, speed_mps, crossing_share);
            walker.errand = Some(Errand::Strolls(Box::new(stroller)));
        }
        Ok(())
    }
}

impl World {
    pub(crate) fn set_walker_trajectory(
        &mut self,
        id: ActorId,
        stages: &[WalkerStage],
        trigger: Option<Proximity>,
    ) -> Result<(), Error> {
        let most = limits::WALKER_STAGES_MAX;
        check::range("number of stages", stages.len() as f32, 1.0, most as f32, "")?;
        for stage in stages {
            check::vector("place", stage.to_m, limits::COORDINATE_M_MAX, "m")?;
            check::range("speed", stage.speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
            check::range("wait", stage.wait_secs, 0.0, limits::WALKER_WAIT_SECS_MAX, "s")?;
        }
        if let Some(trigger) = trigger {
            check::range("distance", trigger.within_m, 0.0, limits::COORDINATE_M_MAX, "m")?;
            self.state.index_of(trigger.actor)?;
        }
        let index = self.walker_index(id)?;
        if let Some((_, walker)) = self.state.actors[index].walker_mut() {
            let trajectory = Trajectory::new(stages.to_vec(), trigger);
            walker.errand = Some(Errand::Follows(Box::new(trajectory)));
        }
        Ok(())
    }
}

/// Fixtures within this distance of a walker count.
const OBSTACLES_M: f32 = 3.0;

impl State {
    /// Lets walkers with a trajectory walk along it during this tick.
    pub(crate) fn follow_trajectories(&mut self) {
        let dt_secs = self.dt_secs as f32;
        for index in 0..self.actors.len() {
            let errand = self.actors[index].walker.as_deref().and_then(|it| it.errand.as_ref());
            let Some(Errand::Follows(trajectory)) = errand else { continue };
            let place_m = |index: usize| {
                self.motion_of(&self.actors[index]).world_from_body.translation.vector
            };
            let near = trajectory.trigger().and_then(|it| self.index_of(it.actor).ok());
            let vehicle_m = near.map(place_m);
            let (foot_m, forward) = (place_m(index), self.forward_of(index));
            let Some((_, walker)) = self.actors[index].walker_mut() else { continue };
            let Some(Errand::Follows(trajectory)) = &mut walker.errand else { continue };
            let control = trajectory.control((foot_m, forward), vehicle_m, dt_secs);
            walker.set_control(control);
        }
    }

    fn forward_of(&self, index: usize) -> Vec3 {
        self.motion_of(&self.actors[index]).world_from_body.rotation * Vec3::x()
    }

    /// Lets walkers with somewhere to go choose how they walk during this tick.
    pub(crate) fn stroll(&mut self, town: &Town, scene: &Scene) {
        let dt_secs = self.dt_secs as f32;
        let network = self.traffic.as_ref().map(|_| town.network());
        let mut near = Vec::new();
        let mut obstacles = Vec::new();
        for index in 0..self.actors.len() {
            let walker = self.actors[index].walker.as_deref();
            let errand = walker.and_then(|walker| walker.errand.as_ref());
            if !matches!(errand, Some(Errand::Strolls(_))) {
                continue;
            }
            // Made when the first of them asks.
            let Some(mesh) = town.nav() else { return };
            let body = self.seen(&self.actors[index]);
            near.clear();
            let reach = Reach { centre_m: body.centre_m, radius_m: OBSTACLES_M };
            town.scenery.find_shown(reach, &self.hidden, &mut near);
            near.sort_unstable();
            near.dedup();
            obstacles.clear();
            obstacles.extend(near.iter().filter_map(|index| {
                let fixture = town.scenery.get(*index)?;
                let world_from_box = fixture.world_from_box;
                Some(Obstacle { world_from_box, half_m: fixture.half_m })
            }));
            let rng = &mut self.rng;
            let Some((_, walker)) = self.actors[index].walker_mut() else { continue };
            let Some(Errand::Strolls(stroller)) = &mut walker.errand else { continue };
            let obstacles = &obstacles;
            let outlook = Outlook { mesh, scene, network, obstacles, body: &body, dt_secs };
            let control = stroller.control(&outlook, &mut || rng.next_u64());
            walker.set_control(control);
        }
    }
}
