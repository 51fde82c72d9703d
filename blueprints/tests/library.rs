//! Goal: a CARLA client can read the whole library, and every vehicle could stand and turn.

use blueprints::{AttributeKind, BaseType, Blueprint, Class, SensorClass, VehicleModel};

fn vehicles() -> impl Iterator<Item = (&'static Blueprint, &'static VehicleModel)> {
    blueprints::all().iter().filter_map(|blueprint| match blueprint.class {
        Class::Vehicle(model) => Some((blueprint, model)),
        _ => None,
    })
}

fn count(of: impl Fn(&Blueprint) -> bool) -> usize {
    blueprints::all().iter().filter(|blueprint| of(blueprint)).count()
}

#[test]
fn ids_are_unique_ordered_and_found() {
    assert!(blueprints::all().windows(2).all(|pair| pair[0].id < pair[1].id));
    for blueprint in blueprints::all() {
        let index = blueprints::index_of(&blueprint.id).unwrap();
        assert_eq!(blueprints::get(index).map(|found| &found.id), Some(&blueprint.id));
    }
    assert!(blueprints::find("vehicle.nonexistent").is_none());
    assert!(blueprints::get(u16::MAX).is_none());
}

#[test]
fn the_library_has_what_carla_lists() {
    assert_eq!(vehicles().count(), 42, "41 and 0.10's vehicle.lincoln.mkz");
    assert_eq!(count(|blueprint| blueprint.id.starts_with("walker.pedestrian.")), 52);
    assert_eq!(count(|blueprint| blueprint.id.starts_with("sensor.")), 19);
    assert_eq!(count(|blueprint| blueprint.id.starts_with("static.prop.")), 96);
    for id in ["controller.ai.walker", "static.trigger.friction", "static.prop.bike helmet"] {
        assert!(blueprints::find(id).is_some_and(|blueprint| blueprint.listed), "{id}");
    }
    for id in ["spectator", "traffic.traffic_light", "traffic.speed_limit.30"] {
        assert!(blueprints::find(id).is_some_and(|blueprint| !blueprint.listed), "{id}");
    }
}

#[test]
fn every_value_parses_by_its_kind() {
    for blueprint in blueprints::all() {
        for attribute in &blueprint.attributes {
            let values = attribute.recommended.iter().chain([&attribute.value]);
            for value in values {
                assert!(attribute.kind.accepts(value), "{}: {attribute:?}", blueprint.id);
            }
            assert!(attribute.accepts(&attribute.value), "{}: {attribute:?}", blueprint.id);
            assert_eq!(attribute.is_modifiable, !attribute.recommended.is_empty());
        }
    }
}

#[test]
fn attributes_fit_into_a_message_and_have_names_of_their_own() {
    for blueprint in blueprints::all() {
        assert!(blueprint.attributes.len() <= schemas::limits::ATTRIBUTES_PER_ACTOR_MAX);
        let mut ids: Vec<&str> =
            blueprint.attributes.iter().map(|attribute| attribute.id).collect();
        ids.sort_unstable();
        assert!(ids.windows(2).all(|pair| pair[0] != pair[1]), "{}: {ids:?}", blueprint.id);
        // Lights, signs and the spectator have none, as in CARLA.
        let is_of_map = blueprint.id == "spectator" || blueprint.id.starts_with("traffic.");
        assert_eq!(blueprint.attributes.is_empty(), is_of_map, "{}", blueprint.id);
        assert_eq!(blueprint.attribute("role_name").is_none(), is_of_map, "{}", blueprint.id);
    }
}

#[test]
fn a_vehicle_says_how_many_wheels_it_has() {
    for (id, wheels) in [
        ("vehicle.tesla.model3", 4),
        ("vehicle.kawasaki.ninja", 2),
        ("vehicle.carlamotors.european_hgv", 6),
    ] {
        let blueprint = blueprints::find(id).unwrap();
        let Class::Vehicle(model) = blueprint.class else { panic!("{id} is a vehicle") };
        assert_eq!(model.physics.wheels.len(), wheels);
        assert_eq!(blueprint.attribute("number_of_wheels").unwrap().value, wheels.to_string());
    }
}

#[test]
fn a_camera_and_a_lidar_have_carlas_defaults() {
    let value = |id: &str, attribute: &str| {
        blueprints::find(id).unwrap().attribute(attribute).map(|found| found.value.clone())
    };
    assert_eq!(value("sensor.camera.rgb", "image_size_x").as_deref(), Some("800"));
    assert_eq!(value("sensor.camera.depth", "fov").as_deref(), Some("90.0"));
    assert_eq!(value("sensor.camera.depth", "gamma"), None);
    assert_eq!(value("sensor.lidar.ray_cast", "dropoff_general_rate").as_deref(), Some("0.45"));
    assert_eq!(value("sensor.other.collision", "sensor_tick"), None);
    let lidar = blueprints::find("sensor.lidar.ray_cast").unwrap();
    assert!(matches!(lidar.class, Class::Sensor(SensorClass::Lidar)));
}

#[test]
fn every_vehicle_stands_on_its_wheels_and_turns_like_its_kind() {
    for (blueprint, model) in vehicles() {
        let id = &blueprint.id;
        let physics = &model.physics;
        let xs = physics.wheels.iter().map(|wheel| wheel.position_m.x);
        let (rear_m, front_m) =
            xs.fold((f32::MAX, f32::MIN), |(low, high), x_m| (low.min(x_m), high.max(x_m)));
        let centre_m = physics.centre_of_mass_m;
        assert!(rear_m < centre_m.x && centre_m.x < front_m, "{id}: {centre_m}");
        assert!(front_m - rear_m < model.length_m && model.track_m < model.width_m, "{id}");
        assert!(centre_m.z < model.height_m && model.ground_clearance_m < model.height_m, "{id}");
        let lock_rad = physics.wheels[0].steer_rad_max;
        assert!((0.4..0.8).contains(&lock_rad), "{id}: {lock_rad} rad");
    }
}

#[test]
fn curves_ascend_and_give_the_published_power() {
    for (blueprint, model) in vehicles() {
        let physics = &model.physics;
        assert!(physics.torque_curve.windows(2).all(|pair| pair[0].0 <= pair[1].0));
        assert!(physics.steering_curve.windows(2).all(|pair| pair[0].0 < pair[1].0));
        let last_rpm = physics.torque_curve.last().unwrap().0;
        assert!((last_rpm - physics.engine_rpm_max).abs() < 1.0, "{}", blueprint.id);
        let gears = &physics.forward_gears;
        assert!(gears.windows(2).all(|pair| pair[0].ratio > pair[1].ratio), "{}", blueprint.id);
    }
    let Class::Vehicle(mini) = blueprints::find("vehicle.mini.cooper_s").unwrap().class else {
        panic!("it is a vehicle")
    };
    let powers_kw = mini.physics.torque_curve.iter().map(|(rpm, nm)| rpm * nm / 9_549.3);
    let highest_kw = powers_kw.fold(0.0, f32::max);
    assert!((highest_kw - 128.0).abs() < 2.0, "{highest_kw} kW");
}

#[test]
fn colours_and_drivers_are_where_carla_has_them() {
    for (blueprint, model) in vehicles() {
        let driver = blueprint.attribute("driver_id").is_some();
        let ridden = matches!(model.base, BaseType::Motorcycle | BaseType::Bicycle);
        assert_eq!(
            driver,
            ridden || blueprint.id == "vehicle.lincoln.mkz_2020",
            "{}",
            blueprint.id
        );
        let colour = blueprint.attribute("color");
        assert!(colour.is_none_or(|colour| colour.kind == AttributeKind::Colour));
        assert_eq!(colour.is_none(), blueprint.id == "vehicle.tesla.cybertruck");
    }
}
