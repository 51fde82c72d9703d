//! Cars and people of a world's own, without dynamics: the drivers and strollers of the tier of
//! rigid bodies, on their ways.
//!
//! - **Determinism:** theirs is that of the [`agents`]; numbers are drawn from one generator.

use std::sync::Arc;

use agents::{Body, Claims, Driver, Obstacle, Outlook, Scene, Senses, Stroller, VehicleView};
use nalgebra::Point3;
use roads::LaneTypes;
use roads::nav::NavMesh;
use schemas::{ActorId, Pose, SplitMix64, TrafficLightColour, Vec3};
use world::{Lights, Town};
use xxhash_rust::xxh3::Xxh3;

use crate::course::{CarStart, Course, Start, WalkerStart};
use crate::limits::TICK_SECS;

/// Lights, cars and people.
#[derive(Clone)]
pub(super) struct Crowd {
    town: Arc<Town>,
    lights: Option<Lights>,
    cars: Vec<Guest>,
    walkers: Vec<Walker>,
    random: SplitMix64,
    /// Friction of the road over that of a dry one.
    grip: f32,
    /// Of the ground under each agent.
    ground_m: Vec<f32>,
}

/// A car with its driver, or one that stands.
#[derive(Clone)]
struct Guest {
    driver: Option<Driver>,
    body: Body,
    /// Origin at the box centre on the ground.
    pose: Pose,
}

/// A person with somewhere to go.
#[derive(Clone)]
struct Walker {
    stroller: Stroller,
    body: Body,
}

impl Crowd {
    /// That of a start; `None` where nobody is there and nothing shines.
    pub(super) fn of(course: &Course, start: &Start, index: usize) -> Option<Self> {
        if !course.has_others() && !course.has_lights() {
            return None;
        }
        // Agents have the first ids.
        let mut ids = (start.agents.len() as u32 + 1..).filter_map(ActorId::new);
        let mut next = || ids.next().unwrap_or(ActorId::FIRST);
        let cars = start.cars.iter().map(|car| Guest::new(car, next())).collect();
        let walkers = start.walkers.iter().map(|walker| Walker::new(walker, next())).collect();
        let ground_m = start.agents.iter().map(|agent| agent.pose.translation.z).collect();
        Some(Self {
            town: Arc::clone(&course.town),
            lights: course.has_lights().then(|| course.town.lights()),
            cars,
            walkers,
            random: SplitMix64::new(index as u64),
            grip: start.sky.grip(),
            ground_m,
        })
    }

    /// All cars, then all people.
    pub(super) fn bodies(&self) -> impl Iterator<Item = &Body> {
        let cars = self.cars.iter().map(|car| &car.body);
        cars.chain(self.walkers.iter().map(|walker| &walker.body))
    }

    /// Height of the ground under each agent.
    pub(super) fn ground_m(&self) -> impl Iterator<Item = f32> + '_ {
        self.ground_m.iter().copied()
    }

    pub(super) fn colours(&self) -> impl Iterator<Item = TrafficLightColour> + '_ {
        self.lights.iter().flat_map(Lights::colours)
    }

    /// Moves everybody by one tick, among agents whose boxes are given seen from above, `None` for
    /// those who are gone.
    pub(super) fn advance(&mut self, agents: impl Iterator<Item = Option<Body>>) {
        let town = Arc::clone(&self.town);
        let strangers: Vec<Body> = self.placed(&town, agents);
        let everybody = strangers.iter().chain(self.bodies()).copied().collect();
        let scene = Scene::new(everybody, self.colours().collect());
        self.stroll(&town, &scene);
        self.drive(&town, &scene, &strangers);
        if let Some(lights) = &mut self.lights {
            town.advance_lights(lights, TICK_SECS);
        }
    }

    /// Agents at the height of the ground where they are.
    fn placed(&mut self, town: &Town, agents: impl Iterator<Item = Option<Body>>) -> Vec<Body> {
        let mut placed = Vec::with_capacity(self.ground_m.len());
        for (body, ground_m) in agents.zip(&mut self.ground_m) {
            let Some(mut body) = body else { continue };
            let here = Point3::from(Vec3::new(body.centre_m.x, body.centre_m.y, *ground_m));
            let map = town.roads();
            if let Some(place) = map.nearest(here.cast(), LaneTypes::DRIVING) {
                *ground_m = map.pose(&place).translation.z as f32;
            }
            body.centre_m.z += *ground_m;
            placed.push(body);
        }
        placed
    }

    fn stroll(&mut self, town: &Town, scene: &Scene) {
        let Some(mesh) = town.nav() else { return };
        let network = self.lights.as_ref().map(|_| town.network());
        let Self { walkers, random, .. } = self;
        for walker in walkers {
            let obstacles: &[Obstacle] = &[];
            let dt_secs = TICK_SECS as f32;
            let body = &walker.body;
            let outlook = Outlook { mesh, scene, network, obstacles, body, dt_secs };
            let control = walker.stroller.control(&outlook, &mut || random.next_u64());
            walker.go(mesh, control.direction, control.speed_mps);
        }
    }

    /// All look, then all decide, as in the tier of rigid bodies.
    fn drive(&mut self, town: &Town, scene: &Scene, strangers: &[Body]) {
        let (network, map) = (town.network(), town.roads());
        let mut claims = Claims::default();
        let Self { cars, random, grip, .. } = self;
        let standing = cars.iter().filter(|car| car.driver.is_none()).map(|car| &car.body);
        for stranger in strangers.iter().chain(standing) {
            claims.occupy(network, stranger);
        }
        for car in cars.iter_mut() {
            let (view, body) = (car.view(*grip), car.body);
            let senses =
                Senses { network, scene, view: &view, body: &body, dt_secs: TICK_SECS as f32 };
            if let Some(driver) = &mut car.driver {
                driver.look(&senses, map, &mut claims, &mut || random.next_u64());
            }
        }
        for car in cars {
            let (view, body) = (car.view(*grip), car.body);
            let senses =
                Senses { network, scene, view: &view, body: &body, dt_secs: TICK_SECS as f32 };
            let Some(driver) = &mut car.driver else { continue };
            match driver.glide(&senses, &mut claims) {
                Some(glide) => car.place(glide.world_from_vehicle, glide.velocity_mps),
                // Beside all lanes: it stands where it is.
                None => car.body.velocity_mps = Vec3::zeros(),
            }
        }
    }

    /// What is seen of it, and the state of its random numbers. What drivers and strollers have in
    /// mind is left out: it shows as soon as they act.
    pub(super) fn hash(&self, hasher: &mut Xxh3) {
        hasher.update(&self.random.state().to_le_bytes());
        for body in self.bodies() {
            let places = body.centre_m.iter().chain(body.forward.iter());
            for value in places.chain(body.velocity_mps.iter()) {
                // -0.0 as +0.0.
                hasher.update(&(value + 0.0).to_bits().to_le_bytes());
            }
        }
        for colour in self.colours() {
            hasher.update(&[colour as u8]);
        }
    }
}

impl Guest {
    fn new(start: &CarStart, id: ActorId) -> Self {
        let half_m = Vec3::new(start.model.length_m, start.model.width_m, start.model.height_m);
        let body = Body {
            id,
            is_walker: false,
            is_urgent: false,
            centre_m: Vec3::zeros(),
            forward: Vec3::x(),
            half_m: half_m / 2.0,
            velocity_mps: Vec3::zeros(),
        };
        let mut guest = Self { driver: start.behaviour.map(Driver::new), body, pose: start.pose };
        guest.place(start.pose, Vec3::zeros());
        guest
    }

    fn place(&mut self, pose: Pose, velocity_mps: Vec3) {
        self.pose = pose;
        self.body.forward = pose.rotation * Vec3::x();
        self.body.centre_m =
            pose.translation.vector + pose.rotation * Vec3::z() * self.body.half_m.z;
        self.body.velocity_mps = velocity_mps;
    }

    /// Whoever glides needs no wheels.
    fn view(&self, grip: f32) -> VehicleView {
        VehicleView {
            world_from_vehicle: self.pose,
            velocity_mps: self.body.velocity_mps,
            wheelbase_m: self.body.half_m.x,
            half_track_m: 0.0,
            full_lock_rad: 0.0,
            bend_per_m_max: f32::INFINITY,
            understeer_rad_per_mps2: 0.0,
            grip,
            start_mps2: f32::INFINITY,
        }
    }
}

impl Walker {
    fn new(start: &WalkerStart, id: ActorId) -> Self {
        let (radius_m, half_m) = (start.model.radius_m, start.model.height_m / 2.0);
        let body = Body {
            id,
            is_walker: true,
            is_urgent: false,
            centre_m: start.foot_m + Vec3::z() * half_m,
            forward: Vec3::x(),
            half_m: Vec3::new(radius_m, radius_m, half_m),
            velocity_mps: Vec3::zeros(),
        };
        let stroller = Stroller::new(None, Some(start.speed_mps), start.crossing_share);
        Self { stroller, body }
    }

    /// Walks for one tick, on the ground.
    fn go(&mut self, mesh: &NavMesh, direction: Vec3, speed_mps: f32) {
        let body = &mut self.body;
        body.velocity_mps = direction * speed_mps;
        if speed_mps <= 0.0 {
            return;
        }
        body.forward = direction;
        body.centre_m += body.velocity_mps * TICK_SECS as f32;
        let foot_m = body.centre_m - Vec3::z() * body.half_m.z;
        if let Some((_, ground)) = mesh.nearest(Point3::from(foot_m).cast()) {
            body.centre_m.z = ground.z as f32 + body.half_m.z;
        }
    }
}
