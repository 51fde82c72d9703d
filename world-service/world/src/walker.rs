//! People on their feet: they go where they want with the force that feet have, climb kerbs, are
//! stopped by walls, and fall when something knocks them over. Who has fallen is a body like any
//! other until it is put upright again.

use std::f32::consts::TAU;

use agents::{Stroller, Trajectory};
use blueprints::WalkerModel;
use nalgebra::{RealField, Vector2};
use schemas::{UnitQuaternion, Vec3, WalkerControl};
use serde::{Deserialize, Serialize};

use crate::ground::Ground;
use crate::physics::BodyState;
use crate::place::rotation_from_axes;

/// Fastest a person runs.
const SPEED_MPS_MAX: f32 = 12.0;
/// Far above it, and far from what overflows when it is squared.
const PART_MPS_MAX: f32 = 1.0e6;
/// What the friction of shoes on asphalt allows.
const ACCELERATION_MPS2: f32 = 8.0;
/// A change of speed within one substep that no balance recovers.
const KNOCK_MPS: f32 = 1.5;
/// Highest step that is climbed or walked down without a fall; a kerb has 0.15 m.
const STEP_M: f32 = 0.3;
/// Fastest climb up a step.
const CLIMB_MPS: f32 = 2.0;
/// How fast the height above ground is corrected.
const CLIMB_PER_SEC: f32 = 20.0;
/// Speed of a jump at take-off, 1.3 m high. **Source:** CARLA's `JumpZVelocity` of walkers.
const JUMP_MPS: f32 = 5.0;
/// Fastest turn on the spot.
const TURN_RADPS: f32 = 10.0;
/// Cosine of the lean (60°) beyond which nobody stands.
const UPRIGHT: f32 = 0.5;
/// Slower than this is standing.
const STANDING_MPS: f32 = 0.05;
/// Length of two steps of an adult of 1.75 m, at rest and per metre per second of speed: 1.5 m at
/// 1.4 m/s. **Source:** Bohannon, "Comfortable and maximum walking speed", 1997, with step lengths.
const STRIDE_M: f32 = 0.9;
const STRIDE_M_PER_MPS: f32 = 0.4;
const ADULT_M: f32 = 1.75;
/// Clients that lead walkers miss a tick now and then.
const UNTOLD_TICKS_MAX: u8 = 10;

/// What only walkers have.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Walker {
    pub control: WalkerControl,
    pub stance: Stance,
    /// Phase of the walk cycle, 0 to 2π.
    pub gait_rad: f32,
    /// Who steers it, if not the last command for it.
    pub errand: Option<Errand>,
    /// The velocity it gave itself; a body that has quite another one was hit.
    pub own_mps: Vec3,
    /// Ticks since a client last said how it walks while its physics is off.
    pub untold_ticks: u8,
}

/// Where a walker goes without being told each tick.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum Errand {
    Strolls(Box<Stroller>),
    Follows(Box<Trajectory>),
}

impl Errand {
    /// Whether all its numbers are numbers; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self) -> bool {
        match self {
            Self::Strolls(stroller) => stroller.is_consistent(),
            Self::Follows(trajectory) => trajectory.is_consistent(),
        }
    }
}

/// What a walker's weight rests on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Stance {
    Feet,
    Air,
    Fallen,
}

/// How a walker that is not fallen moves on.
pub(crate) struct Gait {
    /// Change of velocity it gives itself, without gravity.
    pub change_mps: Vec3,
    /// Whether the feet carry the weight.
    pub carried: bool,
    pub upright: UnitQuaternion<f32>,
    pub turn_radps: f32,
}

impl Walker {
    /// Standing, or on its way with a velocity from outside. A speed alone sends it east.
    pub(crate) fn new(linear_mps: Vec3) -> Self {
        Self {
            control: WalkerControl { direction: Vec3::x(), ..WalkerControl::default() },
            stance: Stance::Feet,
            gait_rad: 0.0,
            errand: None,
            own_mps: linear_mps,
            untold_ticks: 0,
        }
    }

    /// Numbers that decide how it goes on, in a fixed order, for the state hash.
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> + '_ {
        let stance = match self.stance {
            Stance::Feet => 0.0,
            Stance::Air => 1.0,
            Stance::Fallen => 2.0,
        };
        let flag = |on: bool| f32::from(u8::from(on));
        let head = [self.control.speed_mps, flag(self.control.jump)];
        let vectors = self.control.direction.iter().chain(self.own_mps.iter()).copied();
        let rest = [stance, self.gait_rad, f32::from(self.untold_ticks)];
        head.into_iter().chain(rest).chain(vectors)
    }

    /// Takes a new wish.
    pub(crate) fn set_control(&mut self, control: WalkerControl) {
        self.control = control;
    }

    /// Whether it wants to be elsewhere.
    pub(crate) fn is_restless(&self) -> bool {
        self.control.jump || self.wanted_mps().norm() > STANDING_MPS
    }

    /// Stands up at a new place with a velocity from outside.
    pub(crate) fn place(&mut self, linear_mps: Vec3) {
        self.stance = Stance::Feet;
        self.own_mps = linear_mps;
        self.untold_ticks = 0;
    }

    /// Moves its legs for a time at a speed.
    pub(crate) fn stride(&mut self, spec: &WalkerModel, speed_mps: f32, dt_secs: f32) {
        if speed_mps > STANDING_MPS {
            let stride_m = (STRIDE_M + STRIDE_M_PER_MPS * speed_mps) * spec.height_m / ADULT_M;
            let phase_rad = self.gait_rad + speed_mps * dt_secs / stride_m * TAU;
            self.gait_rad = phase_rad - (phase_rad / TAU).floor() * TAU;
        }
    }

    /// Whether nobody has said for long how it walks: who led it has left it standing.
    pub(crate) fn is_left(&mut self) -> bool {
        self.untold_ticks = self.untold_ticks.saturating_add(1);
        self.untold_ticks > UNTOLD_TICKS_MAX
    }

    /// One substep on the feet or in a jump; `None` for who lies.
    pub(crate) fn substep(
        &mut self,
        spec: &WalkerModel,
        body: &BodyState,
        ground: &Ground,
        gravity_mps2: f32,
        dt_secs: f32,
    ) -> Option<Gait> {
        let up = body.world_from_body.rotation * Vec3::z();
        let knocked = (body.linear_mps - self.own_mps).norm() > KNOCK_MPS;
        if knocked || up.z < UPRIGHT {
            self.stance = Stance::Fallen;
        }
        if self.stance == Stance::Fallen {
            return None;
        }
        let foot_m = body.world_from_body.translation.vector - Vec3::z() * (spec.height_m / 2.0);
        let surface = ground.below(foot_m + Vec3::z() * STEP_M);
        let gap_m = foot_m.z - surface.height_m;
        self.shift_weight(gap_m, body.linear_mps.z);
        let change_mps = match self.stance {
            Stance::Feet => self.walk(body.linear_mps, gap_m, surface.normal, dt_secs),
            _ => Vec3::zeros(),
        };
        let carried = self.stance == Stance::Feet;
        let fall_mps = if carried { 0.0 } else { gravity_mps2 * dt_secs };
        self.own_mps = body.linear_mps + change_mps - Vec3::z() * fall_mps;
        if carried {
            self.stride(spec, self.own_mps.xy().norm(), dt_secs);
        }
        let forward = body.world_from_body.rotation * Vec3::x();
        let level = Vec3::new(forward.x, forward.y, 0.0);
        let upright = rotation_from_axes(level, Vec3::z()).unwrap_or_else(UnitQuaternion::identity);
        Some(Gait { change_mps, carried, upright, turn_radps: self.turn_radps(level, dt_secs) })
    }

    /// Leaves the ground over an edge and comes back to it.
    fn shift_weight(&mut self, gap_m: f32, climb_mps: f32) {
        match self.stance {
            Stance::Feet if gap_m > STEP_M => self.stance = Stance::Air,
            Stance::Air if gap_m <= 0.0 && climb_mps <= 0.0 => self.stance = Stance::Feet,
            _ => {}
        }
    }

    /// The change of velocity that the feet make in one substep.
    fn walk(&mut self, linear_mps: Vec3, gap_m: f32, normal: Vec3, dt_secs: f32) -> Vec3 {
        let push = (self.wanted_mps() - linear_mps.xy()).cap_magnitude(ACCELERATION_MPS2 * dt_secs);
        // As in CARLA it jumps again and again until it is told not to.
        if self.control.jump {
            self.stance = Stance::Air;
            return Vec3::new(push.x, push.y, JUMP_MPS - linear_mps.z);
        }
        let next = linear_mps.xy() + push;
        let along_slope_mps = -normal.xy().dot(&next) / normal.z;
        let climb_mps = (-gap_m * CLIMB_PER_SEC).clamp(-CLIMB_MPS, CLIMB_MPS);
        Vec3::new(push.x, push.y, along_slope_mps + climb_mps - linear_mps.z)
    }

    /// The direction's length counts, as in CARLA: half as long is half as fast.
    fn wanted_mps(&self) -> Vector2<f32> {
        let WalkerControl { direction, speed_mps, .. } = self.control;
        // Each part first: the norm of large numbers is no number.
        let part_mps = |part: f32| (part * speed_mps).clamp(-PART_MPS_MAX, PART_MPS_MAX);
        direction.xy().map(part_mps).cap_magnitude(SPEED_MPS_MAX)
    }

    /// Turn towards where it goes.
    fn turn_radps(&self, level: Vec3, dt_secs: f32) -> f32 {
        let wanted = self.wanted_mps();
        if wanted.norm() <= STANDING_MPS {
            return 0.0;
        }
        let cross = level.x * wanted.y - level.y * wanted.x;
        let angle_rad = RealField::atan2(cross, level.xy().dot(&wanted));
        (angle_rad / dt_secs).clamp(-TURN_RADPS, TURN_RADPS)
    }
}

#[cfg(test)]
mod tests {
    use schemas::level_pose;

    use super::*;

    const ADULT: WalkerModel = WalkerModel {
        mass_kg: 75.0,
        height_m: 1.75,
        radius_m: 0.2,
        walk_mps: 1.7,
        run_mps: 4.0,
        age: blueprints::Age::Adult,
        gender: blueprints::Gender::Female,
    };
    const DT_SECS: f32 = 0.01;

    fn square(low: f32, high: f32, z: f32) -> [([Vec3; 3], f32); 2] {
        let at = |x: f32, y: f32| Vec3::new(x, y, z);
        [
            ([at(low, -9.0), at(high, -9.0), at(high, 9.0)], 1.0),
            ([at(low, -9.0), at(high, 9.0), at(low, 9.0)], 1.0),
        ]
    }

    /// A walker at 1.4 m/s along x from x = 0; the heights of its feet on the way.
    fn feet_along(ground: &Ground, ticks: usize) -> (Walker, Vec<f32>) {
        let mut walker = Walker::new(Vec3::zeros());
        let (direction, speed_mps) = (Vec3::x(), 1.4);
        walker.set_control(WalkerControl { direction, speed_mps, jump: false });
        let mut place_m = Vec3::new(0.0, 0.0, ADULT.height_m / 2.0);
        let mut heights_m = Vec::new();
        for _ in 0..ticks {
            let body = BodyState {
                world_from_body: level_pose(place_m, 0.0),
                linear_mps: walker.own_mps,
                angular_radps: Vec3::zeros(),
                centre_of_mass_m: place_m,
                asleep: false,
            };
            walker.substep(&ADULT, &body, ground, 9.81, DT_SECS).expect("nothing knocks it over");
            place_m += walker.own_mps * DT_SECS;
            heights_m.push(place_m.z - ADULT.height_m / 2.0);
        }
        (walker, heights_m)
    }

    #[test]
    fn a_kerb_is_climbed_and_left_without_a_fall() {
        let kerb = square(-9.0, 2.0, 0.0)
            .into_iter()
            .chain(square(2.0, 4.0, 0.15))
            .chain(square(4.0, 90.0, 0.0));
        let (walker, heights_m) = feet_along(&Ground::new(kerb), 450);
        assert_eq!(walker.stance, Stance::Feet);
        assert!(heights_m[..140].iter().all(|height_m| height_m.abs() < 1.0e-3));
        assert!((heights_m[220] - 0.15).abs() < 2.0e-3, "{}", heights_m[220]);
        assert!(heights_m[449].abs() < 2.0e-3, "{}", heights_m[449]);
    }

    #[test]
    fn over_an_edge_a_walker_falls_and_lands_on_its_feet() {
        let edge = square(-9.0, 2.0, 0.0).into_iter().chain(square(2.0, 90.0, -1.0));
        let (walker, heights_m) = feet_along(&Ground::new(edge), 400);
        assert_eq!(walker.stance, Stance::Feet);
        let fall_ticks = heights_m.iter().filter(|&&m| (-0.95..-0.05).contains(&m)).count();
        assert!((25..60).contains(&fall_ticks), "a fall of 1 m takes 0.45 s: {fall_ticks}");
        assert!((heights_m[399] + 1.0).abs() < 5.0e-3, "{}", heights_m[399]);
    }

    #[test]
    fn who_gets_a_blow_falls() {
        let ground = Ground::new(square(-9.0, 9.0, 0.0));
        for (blow_mps, falls) in [(1.0, false), (2.0, true)] {
            let mut walker = Walker::new(Vec3::zeros());
            let place_m = Vec3::z() * (ADULT.height_m / 2.0);
            let body = BodyState {
                world_from_body: level_pose(place_m, 0.0),
                linear_mps: Vec3::y() * blow_mps,
                angular_radps: Vec3::zeros(),
                centre_of_mass_m: place_m,
                asleep: false,
            };
            let gait = walker.substep(&ADULT, &body, &ground, 9.81, DT_SECS);
            assert_eq!(gait.is_none(), falls, "{blow_mps} m/s");
        }
    }
}
