//! Navigation agents of vehicles, and what drivers inside the tick see.

use std::sync::Arc;

use agents::{Agent, Body, Scene};
use schemas::{
    ActorId, ActorKind, AgentOptions, AgentState, Error, ErrorCode, TrafficLightColour, Vec3,
    limits,
};

use crate::actor::{Actor, Vehicle};
use crate::check;
use crate::step;
use crate::town::Town;
use crate::traffic::Lights;
use crate::walker::Errand;
use crate::wheel::AtTheWheel;
use crate::world::{State, World};

/// Farthest that a light or vehicle may be told to count from, in metres.
const DISTANCE_M_MAX: f32 = 200.0;
/// CARLA's `VehicleLightState.Special1`.
const BLUE_LIGHTS: u32 = 0x200;
/// Doors of each side, and how far an open one stands out.
const DOORS_LEFT: u8 = 0b0101;
const DOORS_RIGHT: u8 = 0b1010;
const DOOR_M: f32 = 0.9;

impl World {
    pub(crate) fn set_agent(
        &mut self,
        id: ActorId,
        options: AgentOptions,
        keep_route: bool,
    ) -> Result<(), Error> {
        if let Some(speed_mps) = options.target_speed_mps {
            check::range("target speed", speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
        }
        for distance_m in [options.light_distance_m, options.vehicle_distance_m].iter().flatten() {
            check::range("distance", *distance_m, 0.0, DISTANCE_M_MAX, "m")?;
        }
        let (vehicle, _) = self.vehicle_mut(id)?;
        let kept = vehicle.agent.take().filter(|_| keep_route);
        if kept.is_none() && vehicle.wheel.is_agent() {
            vehicle.leave();
        }
        let agent = kept.map_or_else(|| Agent::new(options), |agent| agent.with(options));
        vehicle.agent = Some(Box::new(agent));
        Ok(())
    }

    pub(crate) fn set_agent_route(&mut self, id: ActorId, places_m: &[Vec3]) -> Result<(), Error> {
        if places_m.len() > limits::ROUTE_PLACES_MAX {
            return Err(Error::new(ErrorCode::InvalidArgument, "too many places in a route")
                .wanted(format!("at most {}", limits::ROUTE_PLACES_MAX))
                .found(places_m.len()));
        }
        for place_m in places_m {
            check::vector("place", *place_m, limits::COORDINATE_M_MAX, "m")?;
        }
        self.agent_mut(id)?;
        let town = Arc::clone(&self.town);
        let index = self.state.index_of(id)?;
        let body = self.state.motion_of(&self.state.actors[index]);
        let grip = self.state.grip();
        let Some(vehicle) = self.state.actors[index].vehicle_mut() else { return Ok(()) };
        let view = step::view(vehicle.tuning.fit(), &body, grip);
        let Some(agent) = &mut vehicle.agent else { return Ok(()) };
        agent.set_route(town.network(), &town.roads, &view, places_m).map_err(|unreachable| {
            Error::new(ErrorCode::InvalidArgument, unreachable.to_string())
                .wanted("a place that lanes lead to from the vehicle and the places before")
                .found(places_m.get(unreachable.index).map_or_else(
                    || "no driving lanes".to_owned(),
                    |place_m| format!("{:.1}, {:.1}, {:.1}", place_m.x, place_m.y, place_m.z),
                ))
        })
    }

    pub(crate) fn drive_agent(&mut self, id: ActorId, on: bool) -> Result<(), Error> {
        self.agent_mut(id)?;
        let (vehicle, body) = self.vehicle_mut(id)?;
        if !on && vehicle.wheel.is_agent() {
            vehicle.leave();
        }
        if on {
            let index = self.state.index_of(id)?;
            self.state.seat(index, AtTheWheel::Agent);
        }
        self.state.physics.wake(body);
        Ok(())
    }

    /// The way that the driver of a vehicle takes, from there on: a place every two metres, at most
    /// so many; none where nobody drives who plans one.
    pub fn way_m(&self, id: ActorId, most: usize) -> Vec<Vec3> {
        let driven = self.state.index_of(id).ok();
        let driven = driven.and_then(|index| self.state.actors[index].vehicle.as_deref());
        let Some(vehicle) = driven else { return Vec::new() };
        let network = self.town.network();
        if let Some(traffic) = vehicle.wheel.traffic() {
            return traffic.driver.way_m(network, most);
        }
        let agent = vehicle.agent.as_deref().filter(|_| vehicle.wheel.is_agent());
        agent.map_or_else(Vec::new, |agent| agent.way_m(network, most))
    }

    /// All vehicles, walkers and things that can be run into, as drivers see them; ordered by id.
    pub fn bodies(&self) -> impl Iterator<Item = Body> + '_ {
        let solid = self.state.actors.iter().filter(|actor| actor.is_solid());
        solid.map(|actor| self.state.seen(actor))
    }

    /// What its lights show, in the order of the map's, `Unknown` for those that were destroyed;
    /// none in a world without them.
    pub fn light_colours(&self) -> impl Iterator<Item = TrafficLightColour> + '_ {
        self.state.traffic.iter().flat_map(Lights::colours)
    }

    fn agent_mut(&mut self, id: ActorId) -> Result<&mut Agent, Error> {
        let (vehicle, _) = self.vehicle_mut(id)?;
        vehicle.agent.as_deref_mut().ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the vehicle has no navigation agent")
                .wanted("a vehicle that SetAgent gave one to")
                .found(id)
        })
    }
}

impl State {
    /// What frames tell of agents.
    pub(crate) fn agents(&self) -> Vec<AgentState> {
        let agent_of = |actor: &Actor| {
            let vehicle = actor.vehicle.as_deref()?;
            let agent = vehicle.agent.as_deref()?;
            Some(AgentState {
                actor: actor.id,
                status: agent.status(),
                driving: vehicle.wheel.is_agent(),
                distance_left_m: agent.distance_left_m(),
                target_m: agent.target_m(),
            })
        };
        self.actors.iter().filter_map(agent_of).collect()
    }

    /// Whether all drivers are on lanes of the town; what a snapshot may get wrong.
    pub(crate) fn drivers_fit(&self, town: &Town) -> bool {
        let mut errands =
            self.actors.iter().filter_map(|actor| actor.walker.as_deref()?.errand.as_ref());
        if !errands.all(Errand::is_consistent) {
            return false;
        }
        self.actors.iter().filter_map(|actor| actor.vehicle.as_deref()).all(|vehicle| {
            let agent = vehicle.agent.as_deref();
            let traffic = vehicle.wheel.traffic();
            agent.is_none_or(|agent| agent.is_consistent(town.network()))
                && traffic.is_none_or(|traffic| traffic.driver.is_consistent(town.network()))
        })
    }

    /// Whether somebody drives or walks who looks around.
    fn has_lookers(&self) -> bool {
        let strolls = |actor: &Actor| {
            let errand = actor.walker.as_deref().and_then(|walker| walker.errand.as_ref());
            matches!(errand, Some(Errand::Strolls(_)))
        };
        self.has_drivers() || self.actors.iter().any(strolls)
    }

    /// Whether an agent or a driver of traffic is at some wheel.
    fn has_drivers(&self) -> bool {
        let drives =
            |vehicle: &Vehicle| matches!(vehicle.wheel, AtTheWheel::Agent | AtTheWheel::Traffic(_));
        self.actors.iter().any(|actor| actor.vehicle.as_deref().is_some_and(drives))
    }

    /// Everybody on the road and every light, as drivers see them.
    pub(crate) fn scene(&self) -> Scene {
        let solid = self.actors.iter().filter(|actor| actor.is_solid());
        let bodies = solid.map(|actor| self.seen(actor));
        let lights = self.traffic.iter().flat_map(Lights::colours);
        Scene::new(bodies.collect(), lights.collect())
    }

    pub(crate) fn seen(&self, actor: &Actor) -> Body {
        let (blueprint, motion) = (actor.blueprint(), self.motion_of(actor));
        let mut centre_m = motion.world_from_body.transform_point(&blueprint.box_centre_m().into());
        let mut half_m = blueprint.box_half_extent_m();
        for (doors, side) in [(DOORS_LEFT, 1.0), (DOORS_RIGHT, -1.0)] {
            if actor.doors & doors != 0 {
                let aside_m = Vec3::new(0.0, side * DOOR_M / 2.0, 0.0);
                centre_m += motion.world_from_body.rotation * aside_m;
                half_m.y += DOOR_M / 2.0;
            }
        }
        Body {
            id: actor.id,
            is_walker: blueprint.kind() == ActorKind::Walker,
            is_urgent: actor.lights & BLUE_LIGHTS != 0,
            centre_m: centre_m.coords,
            forward: motion.world_from_body.rotation * Vec3::x(),
            half_m,
            velocity_mps: motion.linear_mps,
        }
    }

    /// Lets agents and drivers of traffic choose this tick's controls.
    pub(crate) fn navigate(&mut self, town: &Town) {
        if !self.has_lookers() {
            if self.has_people_to_let_over(town) {
                let scene = self.scene();
                self.judge_people(town, &scene);
            }
            return;
        }
        let scene = self.scene();
        self.stroll(town, &scene);
        let mut claims = self.look_around(town, &scene);
        self.flow(town, &scene, &mut claims);
        self.renew_ended(town);
        for index in 0..self.actors.len() {
            let control = self.with_agent(index, town, &scene, |agent, senses, _| {
                agent.control(senses, &mut claims)
            });
            if let Some(control) = control {
                self.set_control(index, control);
            }
        }
    }
}
