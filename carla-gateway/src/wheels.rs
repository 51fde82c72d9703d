//! How the wheels of a vehicle stand.

use blueprints::{Class, VehicleModel};

/// The data of a vehicle's blueprint.
pub(crate) fn model(type_id: &str) -> Option<&'static VehicleModel> {
    match blueprints::find(type_id)?.class {
        Class::Vehicle(model) => Some(model),
        _ => None,
    }
}

/// The angle of one wheel: all front wheels roll around one point (Ackermann).
pub(crate) fn wheel_rad(model: &VehicleModel, index: usize, mean_rad: f32) -> f32 {
    let wheels = &model.physics.wheels;
    let Some(wheel) = wheels.get(index).filter(|wheel| wheel.steer_rad_max > 0.0) else {
        return 0.0;
    };
    if mean_rad == 0.0 || wheel.position_m.x <= 0.0 {
        return mean_rad;
    }
    let (sine, cosine) = mean_rad.sin_cos();
    (sine * model.wheelbase_m).atan2(cosine * model.wheelbase_m - sine * wheel.position_m.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inner_wheel_is_steered_further() {
        let model = model("vehicle.lincoln.mkz_2020").unwrap();
        let [left, right] = [0, 1].map(|index| wheel_rad(model, index, 0.4));
        assert!(left > 0.4 && right < 0.4 && right > 0.3, "{left} {right}");
        assert_eq!(wheel_rad(model, 2, 0.4), 0.0);
        assert_eq!(wheel_rad(model, 9, 0.4), 0.0);
    }
}
