//! The rigid body as the wheels see it, and what they give back.

use std::ops::AddAssign;

use nalgebra::{ComplexField, Matrix3};
use schemas::{Pose, Vec3};

use super::Fit;

/// Pose and velocities of a chassis at the start of a substep, world frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chassis {
    axes: Matrix3<f32>,
    origin_m: Vec3,
    centre_of_mass_m: Vec3,
    /// Of the centre of mass.
    pub linear_mps: Vec3,
    pub angular_radps: Vec3,
}

/// Momentum given to a body: linear, and angular about its centre of mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Impulse {
    pub linear_ns: Vec3,
    pub angular_nms: Vec3,
}

/// Ahead and left of a vehicle in the plane of the ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heading {
    normal: Vec3,
    ahead: Vec3,
    beside: Vec3,
}

impl Heading {
    /// Rolling direction of a wheel that is steered, and its left.
    pub(super) fn axes(&self, steer_rad: f32) -> (Vec3, Vec3) {
        let Self { ahead, beside, .. } = self;
        // Half of all wheels never steer.
        let is_straight = steer_rad == 0.0;
        let (sine, cosine) =
            if is_straight { (steer_rad, 1.0) } else { ComplexField::sin_cos(steer_rad) };
        (ahead * cosine + beside * sine, beside * cosine - ahead * sine)
    }
}

impl AddAssign for Impulse {
    fn add_assign(&mut self, other: Self) {
        self.linear_ns += other.linear_ns;
        self.angular_nms += other.angular_nms;
    }
}

impl Chassis {
    /// - **Frame:** `centre_of_mass_m` and the velocities in the world.
    pub(crate) fn new(
        world_from_vehicle: &Pose,
        centre_of_mass_m: Vec3,
        linear_mps: Vec3,
        angular_radps: Vec3,
    ) -> Self {
        Self {
            axes: world_from_vehicle.rotation.to_rotation_matrix().into_inner(),
            origin_m: world_from_vehicle.translation.vector,
            centre_of_mass_m,
            linear_mps,
            angular_radps,
        }
    }

    pub(crate) fn forward(&self) -> Vec3 {
        self.axes.column(0).into_owned()
    }

    pub(super) fn origin_m(&self) -> Vec3 {
        self.origin_m
    }

    pub(super) fn left(&self) -> Vec3 {
        self.axes.column(1).into_owned()
    }

    pub(super) fn up(&self) -> Vec3 {
        self.axes.column(2).into_owned()
    }

    pub(super) fn world_from_point(&self, in_vehicle_m: Vec3) -> Vec3 {
        self.origin_m + self.axes * in_vehicle_m
    }

    pub(super) fn velocity_at(&self, in_world_m: Vec3) -> Vec3 {
        self.linear_mps + self.angular_radps.cross(&(in_world_m - self.centre_of_mass_m))
    }

    /// Its heading in the plane of the ground with this normal; the known one, if it is of that.
    pub(super) fn heading_on(&self, normal: Vec3, known: Option<Heading>) -> Heading {
        let bits = |normal: &Vec3| normal.map(f32::to_bits);
        if let Some(known) = known.filter(|known| bits(&known.normal) == bits(&normal)) {
            return known;
        }
        let heading = self.forward();
        let in_plane = heading - normal * heading.dot(&normal);
        // A vehicle standing on its nose has no heading in the plane; its wheels then do not roll.
        let ahead = in_plane.try_normalize(1.0e-3).unwrap_or_else(|| self.left().cross(&normal));
        Heading { normal, ahead, beside: normal.cross(&ahead) }
    }

    pub(super) fn impulse_at(&self, in_world_m: Vec3, impulse_ns: Vec3) -> Impulse {
        Impulse {
            linear_ns: impulse_ns,
            angular_nms: (in_world_m - self.centre_of_mass_m).cross(&impulse_ns),
        }
    }
}

/// Drag of the air at rest, through the centre of mass.
pub(super) fn air_drag(fit: &Fit, chassis: &Chassis, dt_secs: f32) -> Impulse {
    let drag_n_per_mps = fit.drag_n_per_mps2 * chassis.linear_mps.norm();
    Impulse {
        linear_ns: -chassis.linear_mps * (drag_n_per_mps * dt_secs),
        angular_nms: Vec3::zeros(),
    }
}
