//! People who walk to places on the navigation mesh.

mod detour;

use nalgebra::Point3;
use roads::nav::{Area, NavMesh};
use schemas::{TrafficLightColour, Vec3, WalkerControl};
use serde::{Deserialize, Serialize};

use crate::network::Network;
use crate::scene::{Body, Scene};
pub use detour::Obstacle;
use detour::{Side, detour};

/// A corner of the way counts as passed from here.
const CORNER_M: f32 = 0.6;
/// How far beside a corner one may pass it.
const PAST_M: f32 = 1.5;
/// How far ahead the ground counts: nobody steps off a kerb without a look.
const LOOK_M: f32 = 1.2;
/// Whoever is nearer to a sidewalk than this has not left it.
const KERB_M: f32 = 0.8;
/// Vehicles farther away than this do not count.
const VEHICLES_M: f32 = 45.0;
/// A vehicle that would be nearer than this at the walker's way...
const CLEAR_M: f32 = 2.5;
/// ...within this time is let through.
const GAP_SECS: f32 = 5.0;
/// Places on the way across whose lanes' lights count.
const ACROSS_STEP_M: f32 = 2.0;
const ACROSS_STEPS_MAX: u32 = 15;
/// A crossing lies no farther beyond the line of the light that holds vehicles before it.
const LINE_M: f32 = 12.0;
/// A slower vehicle counts as standing.
const STANDING_MPS: f32 = 0.3;
/// Middles of vehicles that may be in a walker's way are nearer than this.
const VEHICLE_BESIDE_M: f32 = 8.0;
/// People make room for those ahead within this distance, and for the width of two.
const PEOPLE_M: f32 = 2.5;
const PERSON_M: f32 = 0.8;
/// Nobody waits longer than this before the choice of another way.
const PATIENCE_SECS: f32 = 40.0;
/// Ordinary walking speed.
const WALK_MPS: f32 = 1.4;
/// Most corners of a way.
const CORNERS_MAX: usize = 512;

/// A person with somewhere to go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stroller {
    /// `None`: any place, and then another.
    goal_m: Option<Vec3>,
    speed_mps: f32,
    /// Share of ways that may lead over roads beside crossings.
    crossing_share: f32,
    /// Corners still to pass.
    corners: Vec<Vec3>,
    waited_secs: f32,
    arrived: bool,
    side: Side,
}

/// What a walker knows of the world around it.
#[derive(Clone, Copy, Debug)]
pub struct Outlook<'a> {
    /// Where people walk.
    pub mesh: &'a NavMesh,
    /// Everybody else.
    pub scene: &'a Scene,
    /// Lanes with the lines of their lights; `None` in a world without lights.
    pub network: Option<&'a Network>,
    /// What stands near.
    pub obstacles: &'a [Obstacle],
    /// The walker's own body.
    pub body: &'a Body,
    /// How long the tick lasts.
    pub dt_secs: f32,
}

impl Stroller {
    /// Someone who walks to a place, or without one from place to place for ever.
    ///
    /// - **Domain:** a `crossing_share` from 0 to 1; a speed that is not negative, 1.4 m/s if none.
    #[must_use]
    pub fn new(goal_m: Option<Vec3>, speed_mps: Option<f32>, crossing_share: f32) -> Self {
        Self {
            goal_m,
            speed_mps: speed_mps.unwrap_or(WALK_MPS),
            crossing_share,
            corners: Vec::new(),
            waited_secs: 0.0,
            arrived: false,
            side: Side::None,
        }
    }

    /// Whether all its numbers are numbers; what a snapshot may get wrong.
    #[must_use]
    pub fn is_consistent(&self) -> bool {
        let places = self.goal_m.iter().chain(&self.corners).flat_map(|place_m| place_m.iter());
        let numbers = [self.speed_mps, self.crossing_share, self.waited_secs];
        places.chain(&numbers).all(|value| value.is_finite())
    }

    /// How it walks during the next tick. `draw` gives numbers for the choice of places.
    pub fn control(
        &mut self,
        outlook: &Outlook<'_>,
        draw: &mut dyn FnMut() -> u64,
    ) -> WalkerControl {
        let Outlook { mesh, scene, body, dt_secs, .. } = *outlook;
        let foot_m = body.centre_m - Vec3::z() * body.half_m.z;
        self.pass_corners(&foot_m);
        if self.corners.is_empty() && !self.arrived {
            self.choose(mesh, &foot_m, draw);
        }
        let Some(corner_m) = self.corners.first() else { return WalkerControl::default() };
        let way = corner_m - foot_m;
        let Some(direction) = Vec3::new(way.x, way.y, 0.0).try_normalize(1.0e-3) else {
            return WalkerControl::default();
        };
        let must_wait =
            || is_coming(scene, &foot_m, &direction) || is_released(outlook, &foot_m, &direction);
        if leaves_the_sidewalk(mesh, &foot_m, &direction) && must_wait() {
            self.waited_secs += dt_secs;
            if self.waited_secs > PATIENCE_SECS && self.goal_m.is_none() {
                self.corners.clear();
                self.waited_secs = 0.0;
            }
            return WalkerControl { direction, speed_mps: 0.0, jump: false };
        }
        self.waited_secs = 0.0;
        let (direction, share) = around(scene, body, &direction);
        let mut in_the_way: Vec<Obstacle> = outlook
            .obstacles
            .iter()
            .copied()
            .filter(|obstacle| obstacle.is_in_the_way(foot_m.z))
            .collect();
        scene.near(&body.centre_m, VEHICLE_BESIDE_M, |other| {
            let obstacle = Obstacle::of(other);
            if stands(other) && obstacle.is_in_the_way(foot_m.z) {
                in_the_way.push(obstacle);
            }
        });
        let way = direction * way.xy().norm();
        let (direction, side) = detour(mesh, &in_the_way, &foot_m, &way, self.side);
        self.side = side;
        WalkerControl { direction, speed_mps: self.speed_mps * share, jump: false }
    }

    fn pass_corners(&mut self, foot_m: &Vec3) {
        while let Some(corner_m) = self.corners.first() {
            let beyond = (foot_m - corner_m).xy();
            // Whoever was pushed past a corner does not turn back for it.
            let past = self.corners.get(1).is_some_and(|next_m| {
                beyond.norm() < PAST_M && beyond.dot(&(next_m - corner_m).xy()) > 0.0
            });
            if beyond.norm() >= CORNER_M && !past {
                break;
            }
            self.corners.remove(0);
            self.arrived = self.corners.is_empty() && self.goal_m.is_some();
        }
    }

    fn choose(&mut self, mesh: &NavMesh, foot_m: &Vec3, draw: &mut dyn FnMut() -> u64) {
        let from: Point3<f64> = nalgebra::convert(Point3::from(*foot_m));
        let goal = match self.goal_m {
            Some(goal_m) => Some(nalgebra::convert(Point3::from(goal_m))),
            None => mesh.random_point(draw()),
        };
        let Some(goal) = goal else { return };
        let share = (draw() % 1_000) as f32 / 1_000.0;
        let corners = mesh.path(from, goal, share < self.crossing_share);
        let corners = corners.into_iter().skip(1).take(CORNERS_MAX);
        self.corners = corners.map(|corner| nalgebra::convert(corner.coords)).collect();
        if self.corners.is_empty() {
            // Nobody tries again every tick for a goal that no way leads to.
            self.arrived = self.goal_m.is_some();
        }
    }
}

/// Whether a light lets vehicles over the way across: those of the road, not those that turn into
/// it, which are seen when they come.
fn is_released(outlook: &Outlook<'_>, foot_m: &Vec3, direction: &Vec3) -> bool {
    let Outlook { mesh, scene, .. } = *outlook;
    let Some(network) = outlook.network else { return false };
    for step in 1..=ACROSS_STEPS_MAX {
        let at_m = foot_m + direction * (step as f32 * ACROSS_STEP_M);
        if step > 1 && area(mesh, at_m) == Some(Area::Sidewalk) {
            return false;
        }
        let lanes = network.near(&at_m, ACROSS_STEP_M / 2.0);
        let drives = |light: u32| {
            matches!(scene.light(light), TrafficLightColour::Green | TrafficLightColour::Yellow)
        };
        if lanes.iter().any(|near| network.lights_before(near.place, LINE_M).any(drives)) {
            return true;
        }
    }
    false
}

fn area(mesh: &NavMesh, point_m: Vec3) -> Option<Area> {
    let point: Point3<f64> = nalgebra::convert(Point3::from(point_m));
    let (polygon, _) = mesh.nearest(point)?;
    Some(mesh.polygons().get(polygon as usize)?.area)
}

/// Whether the next steps lead from a sidewalk, or from beside one, to where vehicles drive.
fn leaves_the_sidewalk(mesh: &NavMesh, foot_m: &Vec3, direction: &Vec3) -> bool {
    let is_road = |ahead_m: f32| area(mesh, foot_m + direction * ahead_m) != Some(Area::Sidewalk);
    // Where a sidewalk bends a way may graze the road.
    if !is_road(LOOK_M) || !is_road(2.0 * LOOK_M) {
        return false;
    }
    let foot: Point3<f64> = nalgebra::convert(Point3::from(*foot_m));
    mesh.nearest_in(foot, Area::Sidewalk)
        .is_some_and(|(_, near)| (near - foot).norm() < f64::from(KERB_M))
}

/// Whether a vehicle would come near the way across within the time it takes.
fn is_coming(scene: &Scene, foot_m: &Vec3, direction: &Vec3) -> bool {
    let mut coming = false;
    let across_m = foot_m + direction * 4.0;
    scene.near(&across_m, VEHICLES_M, |body| {
        let speed_mps = body.velocity_mps.xy().norm();
        if body.is_walker || speed_mps < STANDING_MPS || (body.centre_m.z - foot_m.z).abs() > 4.0 {
            return;
        }
        // Closest approach of the vehicle to the middle of the way across.
        let away = (across_m - body.centre_m).xy();
        let velocity = body.velocity_mps.xy();
        let secs = (away.dot(&velocity) / (speed_mps * speed_mps)).clamp(0.0, GAP_SECS);
        let nearest_m = (away - velocity * secs).norm();
        if nearest_m < CLEAR_M + body.half_m.x + 2.0 {
            coming = true;
        }
    });
    coming
}

/// Whether it is a vehicle at rest, which is gone around as what stands on a sidewalk is.
fn stands(body: &Body) -> bool {
    !body.is_walker && body.velocity_mps.norm() < STANDING_MPS
}

/// The direction and share of speed that keep clear of people and bodies ahead.
fn around(scene: &Scene, own: &Body, direction: &Vec3) -> (Vec3, f32) {
    let left = Vec3::new(-direction.y, direction.x, 0.0);
    let (mut aside, mut share) = (0.0f32, 1.0f32);
    scene.near(&own.centre_m, PEOPLE_M + 4.0, |body| {
        let away = body.centre_m - own.centre_m;
        let size_m = if body.is_walker { PERSON_M } else { body.half_m.x.min(2.5) + 0.5 };
        let (ahead_m, beside_m) = (away.dot(direction), away.dot(&left));
        let reach_m = PEOPLE_M + size_m - PERSON_M;
        if body.id == own.id
            || stands(body)
            || !(0.0..reach_m).contains(&ahead_m)
            || beside_m.abs() > size_m
        {
            return;
        }
        // To the right of whoever comes straight on, else away from them.
        let side = if beside_m >= -0.05 { -1.0 } else { 1.0 };
        aside += side * (1.0 - ahead_m / reach_m);
        if ahead_m < size_m {
            share = share.min(0.3);
        }
    });
    let bent = direction + left * aside.clamp(-1.0, 1.0);
    (bent.try_normalize(1.0e-3).unwrap_or(*direction), share)
}
