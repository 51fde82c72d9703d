//! What a vehicle's model and parameters come to: one table per wheel, worked out once.

use std::sync::{Arc, LazyLock};

use blueprints::{Class, Driven, VehicleModel};
use nalgebra::{ComplexField, Matrix3};
use schemas::{Handling, Vec3, VehiclePhysics, WheelPhysics};
use serde::{Deserialize, Serialize};

use super::steering::interpolate;
use super::suspension::Spring;

/// Standard gravity, metres per second squared.
pub(crate) const GRAVITY_MPS2: f32 = 9.81;
/// Wheels of one vehicle, at most.
pub(super) const WHEELS_MAX: usize = 6;

/// Air at sea level and 15 °C.
const AIR_KG_PER_M3: f32 = 1.225;
/// Smallest load of a wheel over the mean one, so that a strange centre of mass divides by nothing.
const LOAD_SHARE_MIN: f32 = 0.05;
/// How much more easily a push at the ground may move a body there than its centre, with full
/// damping.
const LEVER_MAX: f32 = 2.0;
/// Sideways acceleration up to which a rider leans, over gravity and the tyres' friction.
const RIDER_SHARE: f32 = 0.8;

/// A model, the parameters in force and what follows from both.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub model: &'static VehicleModel,
    pub physics: VehiclePhysics,
    pub wheels: Vec<WheelFit>,
    /// Between the front axle and the middle of the rear ones.
    pub wheelbase_m: f32,
    /// Angle of the steered wheels at full lock, theirs in the mean or the inner one's; see
    /// [`Handling`](schemas::Handling).
    pub steer_rad_max: f32,
    /// Half the distance between the front wheels.
    pub half_track_m: f32,
    /// Extra angle of the steered wheels per sideways acceleration, in steady cornering.
    pub understeer_rad_per_mps2: f32,
    /// Damping of a standing tyre over that of a car's: a tall body swings on its tyres faster.
    pub tyre_damping_share: f32,
    /// Drag of the air over the square of the speed.
    pub drag_n_per_mps2: f32,
    /// What its driven wheels push it with at full throttle, over its mass.
    pub start_mps2: f32,
    /// The tightest bend that its middle can follow; endless for who leans.
    pub bend_per_m_max: f32,
}

/// One wheel at rest on level ground.
#[derive(Clone, Debug)]
pub(crate) struct WheelFit {
    pub physics: WheelPhysics,
    pub is_front: bool,
    /// Where it touches the ground, in the vehicle's frame.
    pub foot_m: Vec3,
    pub inertia_kgm2: f32,
    pub load_n: f32,
    pub spring: Spring,
    /// The wheel at the other end of an anti-roll bar.
    pub partner: Option<usize>,
    /// Share of the engine's torque.
    pub drive_share: f32,
    /// Its angle over the mean one of the steered wheels, before Ackermann's correction.
    pub steer_share: f32,
}

impl Fit {
    /// - **Domain:** parameters that [`check`](super::check::physics) admits for this model.
    pub(crate) fn new(model: &'static VehicleModel, physics: VehiclePhysics) -> Self {
        let (front_x_m, rear_x_m) = axles_x_m(&physics.wheels);
        let middle_m = f32::midpoint(front_x_m, rear_x_m);
        let loads_n = static_loads_n(&physics);
        let is_front = |wheel: &WheelPhysics| wheel.position_m.x > middle_m;
        let steered: Vec<f32> = physics
            .wheels
            .iter()
            .map(|wheel| wheel.steer_rad_max)
            .filter(|&rad| rad > 0.0)
            .collect();
        let steer_rad_max = mean(steered.into_iter()).unwrap_or(0.0);
        let of_front = physics.wheels.iter().filter(|wheel| is_front(wheel));
        let half_track_m = of_front.map(|wheel| wheel.position_m.y.abs()).fold(0.0, f32::max);
        let stiffness_of = |front: bool| {
            let chosen = physics.wheels.iter().filter(|wheel| is_front(wheel) == front);
            mean(chosen.map(|wheel| wheel.lateral_stiffness)).unwrap_or(1.0)
        };
        let softness = 1.0 / stiffness_of(true) - 1.0 / stiffness_of(false);
        let drag_area_m2 = physics.drag_coefficient * model.frontal_area_m2;
        let drive_shares = drive_shares(model, &physics, is_front);
        let wheels =
            physics.wheels.iter().zip(loads_n).enumerate().map(|(index, (wheel, load_n))| {
                let (front, radius_m) = (is_front(wheel), wheel.radius_m);
                let rim = radius_m / model.wheel_radius_m;
                WheelFit {
                    physics: *wheel,
                    is_front: front,
                    foot_m: wheel.position_m - Vec3::z() * radius_m,
                    inertia_kgm2: model.wheel_inertia_kgm2 * rim * rim,
                    load_n,
                    spring: Spring::new(model, load_n, front),
                    partner: partner(&physics.wheels, index),
                    drive_share: drive_shares[usize::from(front)],
                    steer_share: if steer_rad_max > 0.0 {
                        wheel.steer_rad_max / steer_rad_max
                    } else {
                        0.0
                    },
                }
            });
        let mut fit = Self {
            model,
            wheels: wheels.collect(),
            tyre_damping_share: 1.0,
            wheelbase_m: front_x_m - rear_x_m,
            steer_rad_max,
            half_track_m,
            understeer_rad_per_mps2: softness / GRAVITY_MPS2,
            drag_n_per_mps2: 0.5 * AIR_KG_PER_M3 * drag_area_m2,
            start_mps2: 0.0,
            bend_per_m_max: f32::INFINITY,
            physics,
        };
        fit.tyre_damping_share = fit.tyre_damping_share();
        fit.start_mps2 = fit.start_mps2();
        fit.bend_per_m_max = fit.bend_per_m_max();
        fit
    }

    fn bend_per_m_max(&self) -> f32 {
        if self.model.is_two_wheeler() {
            return f32::INFINITY;
        }
        let lock_rad = super::steering::wanted_rad(self, 1.0, 0.0);
        let rear_m = self.wheelbase_m / ComplexField::tan(lock_rad).max(1.0e-3);
        let half_m = self.wheelbase_m / 2.0;
        1.0 / (rear_m * rear_m + half_m * half_m).sqrt().max(0.1)
    }

    /// Keeps the damping within what a substep can follow.
    fn tyre_damping_share(&self) -> f32 {
        let height_m = self.physics.centre_of_mass_m.z;
        let [roll_kgm2, pitch_kgm2, _] = self.inertia_kgm2();
        let lever = self.physics.mass_kg * height_m * height_m / roll_kgm2.min(pitch_kgm2);
        (LEVER_MAX / (1.0 + lever)).min(1.0)
    }

    /// Angle that full control reaches at a speed: of the steered wheels in the mean, or of the
    /// inner one, as for `steer_rad_max`.
    pub(crate) fn full_lock_rad(&self, speed_mps: f32) -> f32 {
        let lock_rad = self.steer_rad_max * interpolate(&self.physics.steering_curve, speed_mps);
        if !self.model.is_two_wheeler() {
            return lock_rad;
        }
        // Nobody steers a two-wheeler further than it can lean.
        let friction = self.wheels.first().map_or(1.0, |wheel| wheel.physics.tyre_friction);
        let sideways_mps2 = RIDER_SHARE * friction.min(1.0) * GRAVITY_MPS2;
        let curve_rad = self.wheelbase_m * sideways_mps2 / (speed_mps * speed_mps).max(1.0e-3);
        lock_rad.min(ComplexField::atan(curve_rad) + self.understeer_rad_per_mps2 * sideways_mps2)
    }

    /// Principal moments of inertia about x, y, z through the centre of mass.
    ///
    /// - **Source:** radii of gyration of passenger cars as shares of the box, about 0.36 of half
    ///   the width and height diagonal in roll, 0.25 of the length in pitch and 0.26 in yaw; in
    ///   roll of a bicycle with rider, 0.4 of the height of the centre of mass (Meijaard et al.,
    ///   "Linearized dynamics equations for the balance and steer of a bicycle", 2007).
    pub(crate) fn inertia_kgm2(&self) -> [f32; 3] {
        let roll_m = if self.model.is_two_wheeler() {
            0.4 * self.physics.centre_of_mass_m.z
        } else {
            0.36 * self.model.width_m
        };
        let pitch_m = 0.25 * self.model.length_m;
        let yaw_m = 0.26 * self.model.length_m;
        [roll_m, pitch_m, yaw_m].map(|radius_m| self.physics.mass_kg * radius_m * radius_m)
    }
}

/// Which parameters a vehicle drives with: those of its model, shared by all, or its own.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(try_from = "TuningData", into = "TuningData")]
pub(crate) enum Tuning {
    Standard(u16),
    Own(u16, Arc<Fit>),
}

#[derive(Serialize, Deserialize)]
struct TuningData {
    blueprint: u16,
    physics: Option<VehiclePhysics>,
}

impl Tuning {
    /// Those of the model of a vehicle's blueprint; `None` for blueprints without wheels.
    pub(crate) fn standard(blueprint: u16) -> Option<Self> {
        standard_fit(blueprint).map(|_| Self::Standard(blueprint))
    }

    pub(crate) fn fit(&self) -> &Fit {
        match self {
            Self::Own(_, fit) => fit,
            Self::Standard(blueprint) => {
                standard_fit(*blueprint).expect("only made for blueprints that have one")
            }
        }
    }

    pub(crate) fn blueprint(&self) -> u16 {
        let (Self::Standard(blueprint) | Self::Own(blueprint, _)) = self;
        *blueprint
    }

    /// The same vehicle with other parameters.
    pub(crate) fn with(&self, physics: VehiclePhysics) -> Self {
        let fit = self.fit();
        let standard = standard_fit(self.blueprint());
        if standard.is_some_and(|standard| standard.physics == physics) {
            return Self::Standard(self.blueprint());
        }
        Self::Own(self.blueprint(), Arc::new(Fit::new(fit.model, physics)))
    }
}

impl From<Tuning> for TuningData {
    fn from(tuning: Tuning) -> Self {
        match tuning {
            Tuning::Standard(blueprint) => Self { blueprint, physics: None },
            Tuning::Own(blueprint, fit) => Self { blueprint, physics: Some(fit.physics.clone()) },
        }
    }
}

impl TryFrom<TuningData> for Tuning {
    type Error = String;

    fn try_from(data: TuningData) -> Result<Self, String> {
        let standard = Self::standard(data.blueprint).ok_or("wheels of a thing without wheels")?;
        let Some(physics) = data.physics else { return Ok(standard) };
        super::check::physics(&physics, standard.fit()).map_err(|error| error.to_string())?;
        Ok(standard.with(physics))
    }
}

fn standard_fit(blueprint: u16) -> Option<&'static Fit> {
    static FITS: LazyLock<Vec<Option<Fit>>> = LazyLock::new(|| {
        let of = |blueprint: &'static blueprints::Blueprint| match blueprint.class {
            Class::Vehicle(model) => Some(Fit::new(model, model.physics.clone())),
            _ => None,
        };
        blueprints::all().iter().map(of).collect()
    });
    FITS.get(usize::from(blueprint))?.as_ref()
}

/// Shares of the engine's torque that a rear and a front wheel get.
fn drive_shares(
    model: &VehicleModel,
    physics: &VehiclePhysics,
    is_front: impl Fn(&WheelPhysics) -> bool,
) -> [f32; 2] {
    let driven = match physics.handling {
        Handling::Real => model.driven,
        Handling::Carla => Driven::All,
    };
    let count = physics.wheels.iter().filter(|wheel| is_driven(driven, is_front(wheel))).count();
    [false, true].map(|front| if is_driven(driven, front) { 1.0 / count as f32 } else { 0.0 })
}

fn is_driven(driven: Driven, front: bool) -> bool {
    match driven {
        Driven::Front => front,
        Driven::Rear => !front,
        Driven::All => true,
    }
}

/// Where the front axle and the middle of the rear ones are.
fn axles_x_m(wheels: &[WheelPhysics]) -> (f32, f32) {
    let xs = || wheels.iter().map(|wheel| wheel.position_m.x);
    let front_m = xs().fold(f32::MIN, f32::max);
    let middle_m = f32::midpoint(front_m, xs().fold(f32::MAX, f32::min));
    (front_m, mean(xs().filter(|&x_m| x_m <= middle_m)).unwrap_or(front_m))
}

/// Loads that carry the weight without moment, spread as by equal springs under a rigid body.
fn static_loads_n(physics: &VehiclePhysics) -> Vec<f32> {
    let weight_n = physics.mass_kg * GRAVITY_MPS2;
    let arms = || {
        physics.wheels.iter().map(|wheel| Vec3::new(1.0, wheel.position_m.x, wheel.position_m.y))
    };
    let mut spread = arms().fold(Matrix3::zeros(), |sum, arm| sum + arm * arm.transpose());
    if spread[(2, 2)] < 1.0e-3 {
        // Wheels in one line carry nothing sideways.
        spread[(2, 2)] = 1.0;
    }
    let centre_m = physics.centre_of_mass_m;
    let wanted = Vec3::new(weight_n, weight_n * centre_m.x, weight_n * centre_m.y);
    let plane = spread.try_inverse().map_or_else(Vec3::zeros, |inverse| inverse * wanted);
    let least_n = LOAD_SHARE_MIN * weight_n / physics.wheels.len() as f32;
    arms().map(|arm| plane.dot(&arm).max(least_n)).collect()
}

/// The wheel on the other side of the same axle.
fn partner(wheels: &[WheelPhysics], index: usize) -> Option<usize> {
    let own_m = wheels[index].position_m;
    wheels.iter().position(|other| {
        let other_m = other.position_m;
        (other_m.x - own_m.x).abs() < 0.1 && other_m.y * own_m.y < 0.0
    })
}

fn mean(values: impl Iterator<Item = f32>) -> Option<f32> {
    let (sum, count) = values.fold((0.0, 0u16), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f32::from(count))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(id: &str) -> Fit {
        let index = blueprints::index_of(id).unwrap();
        Tuning::standard(index).unwrap().fit().clone()
    }

    #[test]
    fn the_wheels_carry_the_weight_at_the_centre_of_mass() {
        for blueprint in blueprints::all() {
            let Class::Vehicle(model) = blueprint.class else { continue };
            let fit = Fit::new(model, model.physics.clone());
            let weight_n = fit.physics.mass_kg * GRAVITY_MPS2;
            let total_n: f32 = fit.wheels.iter().map(|wheel| wheel.load_n).sum();
            let moment_nm: f32 = fit.wheels.iter().map(|wheel| wheel.load_n * wheel.foot_m.x).sum();
            let arm_m = moment_nm / weight_n - fit.physics.centre_of_mass_m.x;
            assert!((total_n / weight_n - 1.0).abs() < 1.0e-4, "{}: {total_n} N", blueprint.id);
            assert!(arm_m.abs() < 1.0e-3, "{}: {arm_m} m", blueprint.id);
            assert!(fit.wheels.len() <= WHEELS_MAX, "{}", blueprint.id);
            let driven: f32 = fit.wheels.iter().map(|wheel| wheel.drive_share).sum();
            assert!((driven - 1.0).abs() < 1.0e-6, "{}", blueprint.id);
        }
    }

    #[test]
    fn a_lorry_with_three_axles_has_an_anti_roll_bar_on_each() {
        let partners: Vec<Option<usize>> = fit("vehicle.carlamotors.european_hgv")
            .wheels
            .iter()
            .map(|wheel| wheel.partner)
            .collect();
        assert_eq!(partners, [1, 0, 3, 2, 5, 4].map(Some));
        assert!(fit("vehicle.kawasaki.ninja").wheels.iter().all(|wheel| wheel.partner.is_none()));
    }

    #[test]
    fn parameters_equal_to_the_model_are_shared() {
        let index = blueprints::index_of("vehicle.audi.tt").unwrap();
        let standard = Tuning::standard(index).unwrap();
        let physics = standard.fit().physics.clone();
        let heavy = standard.with(VehiclePhysics { mass_kg: 2_000.0, ..physics.clone() });
        assert!(matches!(heavy, Tuning::Own(..)));
        assert_eq!(heavy.fit().physics.mass_kg, 2_000.0);
        assert!(matches!(heavy.with(physics), Tuning::Standard(_)));
    }
}
