//! The tier of kinematic cars: a bicycle that rolls without slip, boxes, and where a task has them
//! others who move along their ways.
//!
//! - **Determinism:** of agents: additions, multiplications, divisions and square roots in single
//!   precision alone, in a fixed order: the same bits on every machine.
//! - **Source:** the kinematic bicycle of Rajamani, "Vehicle Dynamics and Control", 2012, section
//!   2.2, about the rear axle; understeer and the limits of tyres as [`Plant`] measures them.
//!
//! A car that has run into something stands still.

mod boxes;
mod crowd;
mod obstacles;
mod plant;

use std::sync::{Arc, OnceLock};

use agents::Body;
use schemas::{ActorId, Error, Frame, TrafficLightColour, Vec3};
use xxhash_rust::xxh3::Xxh3;

use crate::action::Action;
use crate::course::{AgentStart, Course};
use crate::limits::TICK_SECS;
use crate::motion::{Contacts, Motion, Shape};
use crate::scene::Neighbour;
use crate::tier::{Fault, Tier};
use boxes::Outline;
use crowd::Crowd;
use obstacles::Obstacles;
use plant::Plant;

/// Parts of a tick in which poses are advanced.
const SUBSTEPS: usize = 2;
/// How fast acceleration follows the pedals, and the path the wheels, in seconds.
const PEDAL_SECS: f32 = 0.1;
const PATH_SECS: f32 = 0.06;

/// A world with a car for each agent.
#[derive(Clone)]
pub(crate) struct KinematicWorld {
    cars: Vec<Car>,
    /// `None` in a world with nobody but agents.
    crowd: Option<Box<Crowd>>,
    /// Its cars among those of the kit: as its road is wet.
    plant: usize,
    kit: Arc<Shared>,
}

/// What all worlds share.
pub(crate) struct KinematicKit {
    shared: Arc<Shared>,
    starts: Vec<OnceLock<KinematicWorld>>,
}

struct Shared {
    /// One for each grip of a road.
    plants: Vec<Plant>,
    obstacles: Obstacles,
}

/// One car. Its place is that of the rear axle's middle.
#[derive(Clone, Copy, Debug, Default)]
struct Car {
    x_m: f32,
    y_m: f32,
    cos: f32,
    sin: f32,
    speed_mps: f32,
    along_mps2: f32,
    road_wheel_rad: f32,
    /// Of the path, positive to the left.
    curvature_per_m: f32,
    action: Action,
    contacts: Contacts,
    /// Something, in this tick and in the one before.
    touches: bool,
    touched: bool,
    gone: bool,
}

impl Tier for KinematicWorld {
    type Kit = KinematicKit;
    // Measured: 27 kB with 220 others.
    const WORLD_BYTES: usize = 1024;
    const BODY_BYTES: usize = 128;

    fn kit(course: &Course) -> Result<KinematicKit, Error> {
        let mut plants: Vec<Plant> = Vec::new();
        for sky in course.skies() {
            if plants.iter().all(|plant| plant.grip != sky.grip()) {
                plants.push(Plant::measured(&sky.weather)?);
            }
        }
        let shared = Shared { plants, obstacles: Obstacles::of(&course.map) };
        let starts = std::iter::repeat_with(OnceLock::new).take(course.start_count()).collect();
        Ok(KinematicKit { shared: Arc::new(shared), starts })
    }

    fn begin(course: &Course, kit: &KinematicKit, start: usize) -> Result<Self, Error> {
        let made = kit.starts[start].get_or_init(|| {
            let prepared = course.start(start);
            let grip = prepared.sky.grip();
            let plants = kit.shared.plants.iter();
            let plant = plants.clone().position(|plant| plant.grip == grip).unwrap_or(0);
            let shape = kit.shared.plants[plant].shape;
            let cars = prepared.agents.iter().map(|agent| Car::new(agent, shape)).collect();
            let crowd = Crowd::of(course, prepared, start).map(Box::new);
            Self { cars, crowd, plant, kit: Arc::clone(&kit.shared) }
        });
        Ok(made.clone())
    }

    fn drive(&mut self, agent: usize, action: Action) {
        self.cars[agent].action = action;
    }

    fn tick(&mut self) -> Result<(), Fault> {
        let Self { cars, crowd, plant, kit } = self;
        let Shared { plants, obstacles } = &**kit;
        let plant = &plants[*plant];
        if let Some(crowd) = crowd {
            crowd.advance(cars.iter().zip(1..).map(|(car, id)| car.body(plant.shape, id)));
        }
        for car in cars.iter_mut() {
            car.touched = std::mem::take(&mut car.touches);
            if !car.gone {
                car.advance(plant);
            }
        }
        meet(cars, plant.shape);
        if let Some(crowd) = crowd {
            meet_others(cars, crowd, plant.shape);
        }
        for car in cars.iter_mut().filter(|car| !car.gone) {
            if obstacles.touch(&car.outline(plant.shape)) {
                car.hit(|contacts| contacts.things += 1);
            }
        }
        Ok(())
    }

    fn motion(&self, agent: usize) -> Motion {
        let (car, shape) = (&self.cars[agent], self.plant().shape);
        let yaw_radps = car.speed_mps * car.curvature_per_m;
        Motion {
            x_m: car.x_m + car.cos * shape.rear_m,
            y_m: car.y_m + car.sin * shape.rear_m,
            cos: car.cos,
            sin: car.sin,
            speed_mps: car.speed_mps,
            along_mps2: car.along_mps2,
            left_mps2: car.speed_mps * yaw_radps,
            yaw_radps,
            road_wheel_rad: car.road_wheel_rad,
            overturned: false,
        }
    }

    fn shape(&self, _: usize) -> Shape {
        self.plant().shape
    }

    fn take_contacts(&mut self, agent: usize) -> Contacts {
        std::mem::take(&mut self.cars[agent].contacts)
    }

    fn others(&self, everybody: &mut Vec<Neighbour>) {
        let bodies = self.crowd.iter().flat_map(|crowd| crowd.bodies());
        everybody.extend(bodies.map(Neighbour::of));
    }

    fn lights(&self, colours: &mut Vec<TrafficLightColour>) {
        colours.extend(self.crowd.iter().flat_map(|crowd| crowd.colours()));
    }

    fn remove(&mut self, agent: usize) {
        self.cars[agent].gone = true;
    }

    fn frame(&self) -> Option<(Frame, Vec<ActorId>)> {
        None
    }

    fn hash(&self) -> u64 {
        let mut hasher = Xxh3::new();
        for car in &self.cars {
            for value in car.values() {
                // -0.0 as +0.0.
                hasher.update(&(value + 0.0).to_bits().to_le_bytes());
            }
            hasher.update(&[u8::from(car.touches), u8::from(car.gone)]);
        }
        if let Some(crowd) = &self.crowd {
            crowd.hash(&mut hasher);
        }
        // A dry road adds nothing.
        if self.plant().grip < Plant::DRY {
            hasher.update(&self.plant().grip.to_bits().to_le_bytes());
        }
        hasher.digest()
    }
}

impl KinematicWorld {
    fn plant(&self) -> &Plant {
        &self.kit.plants[self.plant]
    }
}

/// Lets cars run into each other.
fn meet(cars: &mut [Car], shape: Shape) {
    // Centres farther apart than this cannot touch.
    let reach_m2 = shape.length_m * shape.length_m + shape.width_m * shape.width_m;
    for later in 1..cars.len() {
        let (before, rest) = cars.split_at_mut(later);
        let Some(other) = rest.first_mut().filter(|car| !car.gone) else { continue };
        for one in before.iter_mut().filter(|car| !car.gone) {
            let (x_m, y_m) = (one.x_m - other.x_m, one.y_m - other.y_m);
            // Rear axles may be farther apart than centres, by their distance from these.
            let near = x_m * x_m + y_m * y_m < 4.0 * reach_m2;
            if near && one.outline(shape).touches(&other.outline(shape)) {
                one.hit(|contacts| contacts.vehicles += 1);
                other.hit(|contacts| contacts.vehicles += 1);
            }
        }
    }
}

/// Lets cars of agents run into the world's own cars and people.
fn meet_others(cars: &mut [Car], crowd: &Crowd, shape: Shape) {
    /// Who is so much higher or lower is on another storey.
    const STOREY_M: f32 = 3.0;
    let own_m = 0.5 * (shape.length_m + shape.width_m);
    for (car, ground_m) in cars.iter_mut().zip(crowd.ground_m()).filter(|(car, _)| !car.gone) {
        let outline = car.outline(shape);
        for body in crowd.bodies() {
            if (body.centre_m.z - body.half_m.z - ground_m).abs() > STOREY_M {
                continue;
            }
            let (x_m, y_m) = (body.centre_m.x - outline.x_m, body.centre_m.y - outline.y_m);
            let reach_m = own_m + body.half_m.x + body.half_m.y;
            let near = x_m * x_m + y_m * y_m < reach_m * reach_m;
            if near && outline.touches(&Outline::of(body)) {
                car.hit(|contacts| match body.is_walker {
                    true => contacts.walkers += 1,
                    false => contacts.vehicles += 1,
                });
            }
        }
    }
}

impl Car {
    fn new(start: &AgentStart, shape: Shape) -> Self {
        let forward = start.pose.rotation * Vec3::x();
        let position_m = start.pose.translation.vector - forward * shape.rear_m;
        Self {
            x_m: position_m.x,
            y_m: position_m.y,
            cos: forward.x,
            sin: forward.y,
            speed_mps: start.speed_mps,
            ..Self::default()
        }
    }

    /// Moves by one tick.
    fn advance(&mut self, plant: &Plant) {
        let dt = TICK_SECS as f32;
        let wanted_mps2 = plant.acceleration_mps2(self.action.pedal, self.speed_mps);
        let before_mps = self.speed_mps;
        self.along_mps2 += (wanted_mps2 - self.along_mps2) * (dt / (PEDAL_SECS + dt));
        let wanted_rad = self.action.steer * plant.full_lock_rad(self.speed_mps);
        let step_rad = plant.steer_radps * dt;
        self.road_wheel_rad += (wanted_rad - self.road_wheel_rad).clamp(-step_rad, step_rad);
        let step = dt / SUBSTEPS as f32;
        for _ in 0..SUBSTEPS {
            let speed_mps = (self.speed_mps + self.along_mps2 * step).max(0.0);
            let wanted = plant.curvature_per_m(self.road_wheel_rad, speed_mps);
            self.curvature_per_m += (wanted - self.curvature_per_m) * (step / (PATH_SECS + step));
            let way_m = 0.5 * (self.speed_mps + speed_mps) * step;
            self.roll(way_m, way_m * self.curvature_per_m);
            self.speed_mps = speed_mps;
        }
        // What it did, where it came to stand within the tick.
        self.along_mps2 = (self.speed_mps - before_mps) / dt;
    }

    /// Along an arc: half of the turn, the way, the other half.
    fn roll(&mut self, way_m: f32, turn_rad: f32) {
        self.turn(0.5 * turn_rad);
        self.x_m += way_m * self.cos;
        self.y_m += way_m * self.sin;
        self.turn(0.5 * turn_rad);
    }

    /// By a small angle: series of sine and cosine, then back to length 1.
    fn turn(&mut self, rad: f32) {
        let square = rad * rad;
        let sin = rad * (1.0 - square * (1.0 / 6.0));
        let cos = 1.0 - square * (0.5 - square * (1.0 / 24.0));
        let (x, y) = (self.cos * cos - self.sin * sin, self.sin * cos + self.cos * sin);
        let scale = 1.5 - 0.5 * (x * x + y * y);
        (self.cos, self.sin) = (x * scale, y * scale);
    }

    fn outline(&self, shape: Shape) -> Outline {
        Outline {
            x_m: self.x_m + self.cos * shape.rear_m,
            y_m: self.y_m + self.sin * shape.rear_m,
            cos: self.cos,
            sin: self.sin,
            half_length_m: 0.5 * shape.length_m,
            half_width_m: 0.5 * shape.width_m,
        }
    }

    /// As the world's own drivers see it; on the ground at height 0. `None` when it is gone.
    fn body(&self, shape: Shape, id: u32) -> Option<Body> {
        /// Half the height of a car.
        const HALF_HEIGHT_M: f32 = 0.75;
        let id = ActorId::new(id).filter(|_| !self.gone)?;
        let outline = self.outline(shape);
        let forward = Vec3::new(self.cos, self.sin, 0.0);
        Some(Body {
            id,
            is_walker: false,
            is_urgent: false,
            centre_m: Vec3::new(outline.x_m, outline.y_m, HALF_HEIGHT_M),
            forward,
            half_m: Vec3::new(outline.half_length_m, outline.half_width_m, HALF_HEIGHT_M),
            velocity_mps: forward * self.speed_mps,
        })
    }

    /// Stops it; counts unless it was touching something before.
    fn hit(&mut self, count: impl FnOnce(&mut Contacts)) {
        if !self.touched && !self.touches {
            count(&mut self.contacts);
        }
        self.touches = true;
        (self.speed_mps, self.along_mps2) = (0.0, 0.0);
    }

    /// Numbers that decide how it goes on, in a fixed order.
    fn values(&self) -> [f32; 8] {
        [
            self.x_m,
            self.y_m,
            self.cos,
            self.sin,
            self.speed_mps,
            self.along_mps2,
            self.road_wheel_rad,
            self.curvature_per_m,
        ]
    }
}

#[cfg(test)]
mod tests;
