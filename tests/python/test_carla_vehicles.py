"""What vehicles keep and tell through CARLA's own client: physics, telemetry, lights, failures."""

import carla
import pytest

from carla_site import spawn_car, ticks

LIGHT = carla.VehicleLightState
NUMBERS = (
    *("max_rpm", "moi", "damping_rate_full_throttle", "gear_switch_time", "clutch_strength"),
    *("damping_rate_zero_throttle_clutch_engaged", "damping_rate_zero_throttle_clutch_disengaged"),
    *("final_ratio", "mass", "drag_coefficient", "use_gear_autobox", "use_sweep_wheel_collision"),
)
OF_WHEELS = (
    *("tire_friction", "damping_rate", "max_steer_angle", "radius", "max_brake_torque"),
    *("max_handbrake_torque", "lat_stiff_max_load", "lat_stiff_value", "long_stiff_value"),
)


def numbers(physics: carla.VehiclePhysicsControl) -> list[float]:
    """All that a client can set."""
    centre = physics.center_of_mass
    points = [*physics.torque_curve, *physics.steering_curve]
    return [
        *(float(getattr(physics, name)) for name in NUMBERS),
        *(centre.x, centre.y, centre.z),
        *(number for point in points for number in (point.x, point.y)),
        *(
            getattr(gear, name)
            for gear in physics.forward_gears
            for name in ("ratio", "down_ratio", "up_ratio")
        ),
        *(getattr(wheel, name) for wheel in physics.wheels for name in OF_WHEELS),
    ]


def test_physics_that_is_applied_as_it_was_told_stays_the_same(world):
    library, places = world.get_blueprint_library(), world.get_map().get_spawn_points()
    for index, id in enumerate(("tesla.model3", "kawasaki.ninja", "carlamotors.european_hgv")):
        vehicle = world.spawn_actor(library.find(f"vehicle.{id}"), places[4 * index])
        told = numbers(vehicle.get_physics_control())
        vehicle.apply_physics_control(vehicle.get_physics_control())
        world.tick()
        assert numbers(vehicle.get_physics_control()) == pytest.approx(told, rel=1e-5), id


def test_every_parameter_of_physics_is_kept(world):
    car = spawn_car(world)
    world.tick()
    physics = car.get_physics_control()
    physics.torque_curve = [carla.Vector2D(0.0, 300.0), carla.Vector2D(5_000.0, 250.0)]
    physics.max_rpm, physics.moi, physics.final_ratio = 5_000.0, 2.0, 5.0
    physics.damping_rate_full_throttle = 0.2
    physics.damping_rate_zero_throttle_clutch_engaged = 1.5
    physics.damping_rate_zero_throttle_clutch_disengaged = 0.4
    physics.use_gear_autobox, physics.gear_switch_time = False, 0.1
    physics.clutch_strength, physics.use_sweep_wheel_collision = 20.0, True
    physics.forward_gears = [
        carla.GearPhysicsControl(3.0, 0.4, 0.8),
        carla.GearPhysicsControl(1.0, 0.5, 0.9),
    ]
    physics.mass, physics.drag_coefficient = 2_500.0, 0.5
    physics.center_of_mass = carla.Vector3D(0.2, 0.05, 0.4)
    physics.steering_curve = [carla.Vector2D(0.0, 1.0), carla.Vector2D(100.0, 0.5)]
    wheels = physics.wheels
    for number, wheel in enumerate(wheels):
        wheel.tire_friction, wheel.damping_rate, wheel.radius = 2.0 + number / 10, 0.5, 40.0
        wheel.max_steer_angle = 33.0 if number < 2 else 0.0
        wheel.max_brake_torque, wheel.max_handbrake_torque = 900.0, 800.0
        wheel.lat_stiff_max_load, wheel.lat_stiff_value, wheel.long_stiff_value = 3.0, 12.0, 2_000.0
    physics.wheels = wheels
    car.apply_physics_control(physics)
    world.tick()
    found = car.get_physics_control()
    assert numbers(found) == pytest.approx(numbers(physics), rel=1e-5)


def test_wheels_are_told_in_centimetres_of_the_world(world):
    car = spawn_car(world)
    ticks(world, 20)
    wheels, here = car.get_physics_control().wheels, car.get_transform()
    extent = car.bounding_box.extent
    for wheel, (forward, right) in zip(wheels, ((1, -1), (1, 1), (-1, -1), (-1, 1)), strict=True):
        place = carla.Location(*(number / 100 for number in (wheel.position.x, wheel.position.y)))
        place.z = wheel.position.z / 100
        own = here.inverse_transform(place)
        assert 0.4 * extent.x < forward * own.x < extent.x
        assert 0.6 * extent.y < right * own.y < extent.y
        assert own.z == pytest.approx(wheel.radius / 100, abs=0.05)
        assert 25.0 < wheel.radius < 45.0


def test_wheels_carry_the_car_and_pull_it(world):
    car = spawn_car(world)
    ticks(world, 40)
    weight = car.get_physics_control().mass * 9.81
    still = car.get_telemetry_data()
    still_rear = sum(wheel.tire_load for wheel in still.wheels[2:])
    assert sum(wheel.tire_load for wheel in still.wheels) == pytest.approx(weight, rel=0.02)
    assert still.speed == pytest.approx(0.0, abs=0.05) and still.engine_rpm < 100.0
    car.apply_control(carla.VehicleControl(throttle=0.8, steer=0.1))
    revolutions = set()
    for _ in range(40):
        world.tick()
        told = car.get_telemetry_data()
        revolutions.add(round(told.engine_rpm))
    assert len(revolutions) > 8 and told.gear == 1
    assert (told.throttle, told.steer, told.brake) == pytest.approx((0.8, 0.1, 0.0))
    forward = car.get_velocity().dot(car.get_transform().get_forward_vector())
    assert told.speed == pytest.approx(forward, rel=0.02) and told.drag > 0.0
    radius = car.get_physics_control().wheels[0].radius / 100
    assert sum(wheel.long_force for wheel in told.wheels) > 0.0
    assert sum(wheel.lat_force for wheel in told.wheels) > 100.0, "to the right"
    rear = told.wheels[2:]
    assert all(wheel.omega * radius == pytest.approx(told.speed, rel=0.2) for wheel in told.wheels)
    # CARLA's engines drive all wheels; the rear ones bear more when a car speeds up.
    assert all(wheel.torque > 0.0 and wheel.long_slip > 0.0 for wheel in told.wheels)
    assert sum(wheel.tire_load for wheel in rear) > still_rear
    for wheel in told.wheels:
        assert 0.5 < wheel.normalized_tire_load < 1.5 and wheel.tire_friction > 0.5
        assert abs(wheel.normalized_long_force) < 1.1 * wheel.tire_friction


def test_lights_are_kept_bit_by_bit_and_told_of_all_vehicles(world):
    first, second = spawn_car(world, 0), spawn_car(world, 5)
    world.tick()
    assert first.get_light_state() == LIGHT.NONE
    some = LIGHT(LIGHT.Position | LIGHT.LowBeam | LIGHT.LeftBlinker)
    for lights in (some, LIGHT.All, LIGHT(LIGHT.Special1 | LIGHT.Special2), LIGHT.NONE, some):
        first.set_light_state(lights)
        assert first.get_light_state() == lights
        world.tick()
        assert first.get_light_state() == lights
    assert world.get_vehicles_light_states() == {first.id: some, second.id: LIGHT.NONE}
    assert (int(LIGHT.Position), int(LIGHT.Brake), int(LIGHT.Special2)) == (1, 8, 1024)


def test_a_car_on_its_roof_has_failed_until_it_is_put_back(world):
    car = spawn_car(world)
    ticks(world, 10)
    place = car.get_transform()
    assert car.get_failure_state() == carla.VehicleFailureState.NONE
    above = place.location + carla.Location(z=1.5)
    car.set_transform(carla.Transform(above, carla.Rotation(roll=180.0)))
    ticks(world, 100)
    assert abs(car.get_transform().rotation.roll) > 170.0
    assert car.get_failure_state() == carla.VehicleFailureState.Rollover
    car.set_transform(place)
    ticks(world, 10)
    assert car.get_failure_state() == carla.VehicleFailureState.NONE


def test_calls_without_effect_leave_a_car_as_it_is(world):
    car = spawn_car(world)
    ticks(world, 20)
    car.open_door(carla.VehicleDoor.All)
    car.close_door(carla.VehicleDoor.FL)
    car.enable_carsim("")
    car.use_carsim_road(True)
    car.enable_chrono_physics(10, 0.01, "vehicle", "powertrain", "tires", "folder")
    car.restore_physx_physics()
    car.show_debug_telemetry(True)
    car.apply_control(carla.VehicleControl(throttle=0.6))
    ticks(world, 40)
    assert 1.5 < car.get_velocity().length() < 8.0


def test_a_sensor_on_a_socket_is_where_the_socket_is(world):
    car = spawn_car(world)
    ticks(world, 20)
    imu = world.get_blueprint_library().find("sensor.other.imu")
    sockets = dict(zip(car.get_socket_names(), car.get_socket_relative_transforms(), strict=True))
    on, rigid = carla.Transform(carla.Location(z=0.5)), carla.AttachmentType.Rigid
    for socket, offset in (("Wheel_Rear_Left", sockets["Wheel_Rear_Left"].location), ("no", None)):
        sensor = world.spawn_actor(imu, on, car, rigid, socket)
        world.tick()
        wanted = (offset or carla.Location()) + carla.Location(z=0.5)
        found = car.get_transform().inverse_transform(sensor.get_location())
        assert found.distance(wanted) < 0.01, socket


def test_a_car_knows_the_light_it_waits_for_and_the_limit_of_its_road(world):
    car = spawn_car(world)
    world.tick()
    assert not car.is_at_traffic_light() and car.get_traffic_light() is None
    assert car.get_traffic_light_state() == carla.TrafficLightState.Green
    lights = world.get_actors().filter("traffic.traffic_light")
    light = next(light for light in lights if light.get_stop_waypoints())
    light.freeze(True)
    stop = light.get_stop_waypoints()[0].transform
    stop.location.z += 0.2
    car.set_transform(stop)
    for state in (carla.TrafficLightState.Red, carla.TrafficLightState.Green):
        light.set_state(state)
        ticks(world, 3)
        assert car.is_at_traffic_light()
        assert car.get_traffic_light().id == light.id
        assert car.get_traffic_light_state() == state
    assert car.get_speed_limit() in (20.0, 30.0, 40.0, 50.0, 60.0, 90.0)
    light.freeze(False)
