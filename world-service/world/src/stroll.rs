//! Walkers that find their own way.

use agents::{Obstacle, Outlook, Scene, Stroller};
use schemas::{ActorId, Error, ErrorCode, Vec3, limits};

use crate::check;
use crate::scenery::Reach;
use crate::town::Town;
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
            walker.stroller = Some(Box::new(stroller));
        }
        Ok(())
    }
}

/// Fixtures within this distance of a walker count.
const OBSTACLES_M: f32 = 3.0;

impl State {
    /// Lets walkers with somewhere to go choose how they walk during this tick.
    pub(crate) fn stroll(&mut self, town: &Town, scene: &Scene) {
        let Some(mesh) = town.nav() else { return };
        let dt_secs = self.dt_secs as f32;
        let network = self.traffic.as_ref().map(|_| town.network());
        let mut near = Vec::new();
        let mut obstacles = Vec::new();
        for index in 0..self.actors.len() {
            let walker = self.actors[index].walker.as_deref();
            if walker.is_none_or(|walker| walker.stroller.is_none()) {
                continue;
            }
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
            let Some(stroller) = &mut walker.stroller else { continue };
            let obstacles = &obstacles;
            let outlook = Outlook { mesh, scene, network, obstacles, body: &body, dt_secs };
            let control = stroller.control(&outlook, &mut || rng.next_u64());
            walker.set_control(control);
        }
    }
}
