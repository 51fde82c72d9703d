"""Driving through CARLA's own client: what each field of a control does, and what vehicles tell."""

import math

import carla
import pytest

from carla_site import spawn_car, ticks


class Track:
    """A car that can be set back to its start."""

    def __init__(self, world: carla.World):
        self.world, self.car = world, spawn_car(world)
        ticks(world, 20)
        self.start = self.car.get_transform()

    def speed(self) -> float:
        return self.car.get_velocity().dot(self.car.get_transform().get_forward_vector())

    def set_back(self, speed: float = 0.0) -> None:
        self.car.apply_control(carla.VehicleControl(brake=0.0 if speed else 1.0))
        self.car.set_transform(self.start)
        self.car.set_target_velocity(speed * self.start.get_forward_vector())
        self.car.set_target_angular_velocity(carla.Vector3D())
        ticks(self.world, 2 if speed else 10)

    def speed_after(self, count: int, **control) -> float:
        """From standstill."""
        self.set_back()
        self.car.apply_control(carla.VehicleControl(**control))
        ticks(self.world, count)
        return self.speed()

    def acceleration(self) -> float:
        """In the second half of a second, in first gear."""
        before = self.speed_after(10, throttle=1.0)
        ticks(self.world, 10)
        return self.speed() - before

    def braking_distance(self) -> float:
        self.set_back(15.0)
        start = self.car.get_location()
        self.car.apply_control(carla.VehicleControl(brake=1.0))
        for _ in range(300):
            if self.speed() < 0.1:
                break
            self.world.tick()
        return start.distance(self.car.get_location())

    def front_angles(self) -> tuple[float, float]:
        """Of the wheels at full lock to the right, left and right."""
        self.set_back()
        self.car.apply_control(carla.VehicleControl(steer=1.0, hand_brake=True))
        ticks(self.world, 40)
        wheel = carla.VehicleWheelLocation
        return tuple(self.car.get_wheel_steer_angle(at) for at in (wheel.FL_Wheel, wheel.FR_Wheel))

    def change(self, **values) -> None:
        physics = self.car.get_physics_control()
        for name, value in values.items():
            setattr(physics, name, value)
        self.car.apply_physics_control(physics)
        self.world.tick()

    def change_wheels(self, **values) -> None:
        wheels = self.car.get_physics_control().wheels
        for wheel in wheels:
            for name, value in values.items():
                setattr(wheel, name, value)
        self.change(wheels=wheels)


@pytest.fixture
def track(world):
    return Track(world)


def test_each_field_of_a_control_has_its_effect(track):
    full = track.speed_after(40, throttle=1.0)
    assert 1.0 < track.speed_after(40, throttle=0.5) < full < 12.0
    assert track.speed_after(40, throttle=1.0, reverse=True) < -2.0
    assert track.car.get_control().gear == -1
    assert track.speed_after(40, throttle=0.5, hand_brake=True) < 0.1
    # It brakes the rear wheels, and the engine drives all.
    assert track.speed_after(40, throttle=1.0, hand_brake=True) < 0.5 * full
    track.speed_after(40, throttle=0.5, steer=-0.5)
    assert track.car.get_transform().rotation.yaw < track.start.rotation.yaw - 5.0
    rolled, braked = [], []
    for stop, results in (({}, rolled), ({"brake": 0.5}, braked), ({"hand_brake": True}, braked)):
        track.set_back(10.0)
        track.car.apply_control(carla.VehicleControl(**stop))
        ticks(track.world, 20)
        results.append(track.speed())
    # The engine brakes, too.
    assert rolled[0] > 5.0 and max(braked) < 4.0


def test_a_manual_gear_is_kept(track):
    assert track.speed_after(40, throttle=1.0, manual_gear_shift=True, gear=-1) < -2.0
    assert track.speed_after(40, throttle=1.0, manual_gear_shift=True, gear=0) == pytest.approx(
        0.0, abs=0.05
    )
    in_first = track.speed_after(40, throttle=1.0, manual_gear_shift=True, gear=1)
    in_fourth = track.speed_after(40, throttle=1.0, manual_gear_shift=True, gear=4)
    assert track.car.get_control().gear == track.car.get_telemetry_data().gear == 4
    assert in_fourth < in_first / 2
    ticks(track.world, 1)
    assert track.speed_after(100, throttle=1.0, manual_gear_shift=True, gear=1) < 18.0
    assert track.car.get_control().gear == 1
    track.speed_after(100, throttle=1.0)
    assert track.car.get_control().gear >= 2, "the gearbox shifts by itself"


def test_a_control_is_read_back_with_the_next_frame_and_within_its_limits(world):
    car = spawn_car(world)
    world.tick()
    wild = carla.VehicleControl(throttle=3.0, steer=-7.0, brake=-2.0)
    given = carla.VehicleControl(0.3, 0.2, 0.1, True, True, True, 2)
    for wanted, told in ((given, given), (wild, carla.VehicleControl(throttle=1.0, steer=-1.0))):
        car.apply_control(wanted)
        world.tick()
        found = car.get_control()
        for name in ("throttle", "steer", "brake"):
            assert getattr(found, name) == pytest.approx(getattr(told, name), abs=1e-6)
        for name in ("hand_brake", "reverse", "manual_gear_shift"):
            assert getattr(found, name) == getattr(told, name)
    car.apply_control(given)
    world.tick()
    assert car.get_control().gear == 2


def test_reverse_brakes_a_car_that_rolls_forward_and_then_drives_it_back(track):
    track.set_back(6.0)
    track.car.apply_control(carla.VehicleControl(throttle=0.6, reverse=True))
    ticks(track.world, 10)
    assert track.car.get_control().gear == -1
    assert track.speed() < 5.5
    ticks(track.world, 90)
    assert track.speed() < -1.0


def test_ackermann_takes_angles_and_speeds_that_no_car_has(track):
    track.set_back()
    track.car.apply_ackermann_control(carla.VehicleAckermannControl(speed=1e9))
    ticks(track.world, 40)
    assert track.speed() > 1.0
    track.car.apply_ackermann_control(carla.VehicleAckermannControl(speed=2.0, steer=10.0))
    ticks(track.world, 20)
    assert track.car.get_wheel_steer_angle(carla.VehicleWheelLocation.FR_Wheel) > 30.0


def test_ackermann_reaches_its_speed_and_its_angle(track):
    car, wheel = track.car, carla.VehicleWheelLocation
    car.apply_ackermann_control(carla.VehicleAckermannControl(speed=5.0, acceleration=2.0))
    ticks(track.world, 160)
    assert track.speed() == pytest.approx(5.0, abs=0.3)
    steer = math.radians(10.0)
    car.apply_ackermann_control(carla.VehicleAckermannControl(speed=5.0, steer=steer))
    ticks(track.world, 30)
    front = [car.get_wheel_steer_angle(at) for at in (wheel.FL_Wheel, wheel.FR_Wheel)]
    assert sum(front) / 2 == pytest.approx(10.0, abs=1.0)
    slow = carla.VehicleAckermannControl(speed=5.0, steer=-steer, steer_speed=0.1)
    car.apply_ackermann_control(slow)
    ticks(track.world, 20)
    front = [car.get_wheel_steer_angle(at) for at in (wheel.FL_Wheel, wheel.FR_Wheel)]
    assert sum(front) / 2 == pytest.approx(10.0 - math.degrees(0.1), abs=1.0)
    car.apply_ackermann_control(carla.VehicleAckermannControl(speed=-3.0))
    ticks(track.world, 160)
    assert track.speed() == pytest.approx(-3.0, abs=0.3)


def test_ackermann_stops_before_it_goes_the_other_way(track):
    track.set_back(6.0)
    track.car.apply_ackermann_control(carla.VehicleAckermannControl(speed=6.0))
    ticks(track.world, 20)
    for speed, way in ((-3.0, 1.0), (6.0, -1.0)):
        track.car.apply_ackermann_control(carla.VehicleAckermannControl(speed=speed))
        ticks(track.world, 1)
        for _ in range(80):
            if way * track.speed() < 0.3:
                break
            assert track.car.get_control().reverse == (way < 0.0)
            track.world.tick()
        assert way * track.speed() < 0.3
        ticks(track.world, 160)
        assert track.speed() == pytest.approx(speed, abs=0.4)


def test_gains_of_ackermann_are_kept_and_change_the_start(track):
    car = track.car
    settings = car.get_ackermann_controller_settings()
    names = ("speed_kp", "speed_ki", "speed_kd", "accel_kp", "accel_ki", "accel_kd")
    told = [getattr(settings, name) for name in names]
    assert told == pytest.approx([0.15, 0.0, 0.25, 0.01, 0.0, 0.01])

    def start() -> float:
        track.set_back()
        car.apply_ackermann_control(carla.VehicleAckermannControl(speed=8.0, acceleration=3.0))
        ticks(track.world, 30)
        return track.speed()

    own = start()
    settings.accel_kp, settings.accel_ki, settings.speed_kp = 0.05, 0.002, 0.3
    car.apply_ackermann_controller_settings(settings)
    track.world.tick()
    found = car.get_ackermann_controller_settings()
    wanted = [getattr(settings, name) for name in names]
    assert [getattr(found, name) for name in names] == pytest.approx(wanted)
    assert start() > 1.2 * own


def test_mass_drag_and_drivetrain_change_the_acceleration(track):
    own = track.car.get_physics_control()
    base = track.acceleration()
    weaker = [carla.Vector2D(point.x, point.y / 2) for point in own.torque_curve]
    # In first gear the engine's inertia weighs as much as the car.
    for change, low, high in (
        ({"mass": 2 * own.mass}, 0.5, 0.75),
        ({"torque_curve": weaker}, 0.25, 0.5),
        ({"drag_coefficient": 100.0}, 0.5, 0.96),
        ({"final_ratio": 0.5 * own.final_ratio}, 0.5, 0.75),
    ):
        track.change(**change)
        assert low < track.acceleration() / base < high, change
        track.car.apply_physics_control(own)
    assert track.acceleration() == pytest.approx(base, rel=0.05)


def test_wheels_change_braking_and_steering(track):
    own = track.car.get_physics_control()
    base = track.braking_distance()
    assert base == pytest.approx(8.69, rel=0.05)
    # With weak brakes the engine, too, slows the car down, as its box changes down.
    for change, times in (({"tire_friction": 0.1}, 5.0), ({"max_brake_torque": 300.0}, 2.3)):
        track.change_wheels(**change)
        assert track.braking_distance() > times * base, change
        track.car.apply_physics_control(own)
    left, right = track.front_angles()
    assert 0.0 < left < right
    track.change(steering_curve=[carla.Vector2D(0.0, 0.5), carla.Vector2D(100.0, 0.5)])
    # Of the inner wheel, as in CARLA.
    assert max(track.front_angles()) == pytest.approx(right / 2, rel=0.05)
    track.car.apply_physics_control(own)
    wheels = own.wheels
    for wheel in wheels[:2]:
        wheel.max_steer_angle = 20.0
    track.change(wheels=wheels)
    assert max(track.front_angles()) == pytest.approx(20.0, abs=0.5)


def test_a_control_lasts_one_tick_unless_it_is_sticky(world):
    keeps, forgets = spawn_car(world, 0), spawn_car(world, 5, sticky_control="false")
    ticks(world, 20)
    for car in (keeps, forgets):
        car.apply_control(carla.VehicleControl(throttle=1.0))
    world.tick()
    assert keeps.get_control().throttle == forgets.get_control().throttle == 1.0
    ticks(world, 30)
    assert (keeps.get_control().throttle, forgets.get_control().throttle) == (1.0, 0.0)
    assert keeps.get_velocity().length() > 2.0 > 0.5 > forgets.get_velocity().length()
