"""Inertial and satellite sensors through CARLA's own client: units, signs, faults asked for."""

import math

import carla
import numpy as np
import pytest

from carla_site import STEP_SECS, attach, spawn_car, synchronous, ticks

WAIT_SECS = 30.0
MIDDLE = carla.Transform()


def last(measured, count: int = 1):
    return [measured.get(timeout=WAIT_SECS) for _ in range(count)][-1]


def test_a_right_turn_is_felt_to_the_right_and_as_yaw(world):
    """Right is +y, and a turn to the right is a growing yaw."""
    car = spawn_car(world)
    ticks(world, 20)
    imu, measured = attach(world, car, "sensor.other.imu", MIDDLE)
    car.set_target_velocity(car.get_transform().get_forward_vector() * 4.5)
    car.apply_control(carla.VehicleControl(throttle=0.4, steer=0.3))
    ticks(world, 8)
    speeds = []
    for _ in range(8):
        world.tick()
        speeds.append(car.get_velocity().length())
    felt = [measured.get(timeout=WAIT_SECS) for _ in range(16)][-8:]
    yaw_rate = math.radians(car.get_angular_velocity().z)
    assert yaw_rate > 0.1
    assert felt[-1].gyroscope.z == pytest.approx(yaw_rate, rel=0.01)
    sideways = np.mean([one.accelerometer.y for one in felt])
    spin = np.mean([one.gyroscope.z for one in felt])
    assert sideways == pytest.approx(np.mean(speeds) * spin, rel=0.15)
    imu.destroy()


def test_speeding_up_is_felt_forwards_and_braking_backwards(world):
    car = spawn_car(world)
    ticks(world, 30)
    car.set_target_velocity(car.get_transform().get_forward_vector() * 8.0)
    imu, measured = attach(world, car, "sensor.other.imu", MIDDLE)
    forward = car.get_transform().get_forward_vector()
    for control, sign in (
        (carla.VehicleControl(throttle=0.8), 1.0),
        (carla.VehicleControl(brake=0.6), -1.0),
    ):
        car.apply_control(control)
        ticks(world, 5)
        last(measured, 5)
        before = car.get_velocity().dot(forward)
        ticks(world, 10)
        felt = [measured.get(timeout=WAIT_SECS).accelerometer.x for _ in range(10)]
        change_mps2 = (car.get_velocity().dot(forward) - before) / (10 * STEP_SECS)
        assert np.mean(felt) == pytest.approx(change_mps2, abs=0.3) and sign * change_mps2 > 1.0
    imu.destroy()


@pytest.mark.parametrize(
    ("yaw_deg", "compass_deg"), [(-90.0, 0.0), (0.0, 90.0), (90.0, 180.0), (180.0, 270.0)]
)
def test_the_compass_counts_clockwise_from_north_which_is_minus_y(world, yaw_deg, compass_deg):
    place = carla.Transform(carla.Location(z=30.0), carla.Rotation(yaw=yaw_deg))
    imu, measured = attach(world, None, "sensor.other.imu", place)
    world.tick()
    found_deg = math.degrees(last(measured).compass)
    assert (found_deg - compass_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.01)
    imu.destroy()


def test_a_tilted_imu_feels_gravity_along_its_own_axes(world):
    place = carla.Transform(carla.Location(z=30.0), carla.Rotation(pitch=30.0))
    imu, measured = attach(world, None, "sensor.other.imu", place)
    ticks(world, 3)
    felt = last(measured, 3).accelerometer
    assert [felt.x, felt.y, felt.z] == pytest.approx(
        [9.81 * math.sin(math.radians(30)), 0.0, 9.81 * math.cos(math.radians(30))], abs=1e-3
    )
    imu.destroy()


def test_noise_and_bias_of_an_imu_are_those_asked_for(world):
    place = carla.Transform(carla.Location(z=30.0))
    faults = {"noise_accel_stddev_x": "0.5", "noise_gyro_bias_z": "0.2"}
    faults |= {"noise_gyro_stddev_y": "0.1"}
    imu, measured = attach(world, None, "sensor.other.imu", place, **faults)
    ticks(world, 200)
    felt = [measured.get(timeout=WAIT_SECS) for _ in range(200)]
    axes = [
        [one.accelerometer.x, one.accelerometer.y, one.gyroscope.y, one.gyroscope.z] for one in felt
    ]
    assert np.std(axes, axis=0) == pytest.approx([0.5, 0.0, 0.1, 0.0], rel=0.2, abs=1e-3)
    assert np.mean([one.gyroscope.z for one in felt]) == pytest.approx(0.2, abs=1e-3)
    imu.destroy()


def test_noise_and_bias_of_a_gnss_are_those_asked_for(world):
    place = carla.Transform(carla.Location(x=100.0, y=-200.0, z=30.0))
    faults = {"noise_lat_bias": "0.001", "noise_lon_stddev": "0.0002", "noise_alt_bias": "-5"}
    gnss, measured = attach(world, None, "sensor.other.gnss", place, **faults)
    ticks(world, 200)
    found = [measured.get(timeout=WAIT_SECS) for _ in range(200)]
    true = world.get_map().transform_to_geolocation(place.location)
    assert found[0].latitude == pytest.approx(true.latitude + 0.001, abs=1e-7)
    assert found[0].altitude == pytest.approx(25.0, abs=1e-3)
    longitudes = [one.longitude for one in found]
    assert np.std(longitudes) == pytest.approx(0.0002, rel=0.2)
    assert np.mean(longitudes) == pytest.approx(true.longitude, abs=5e-5)
    gnss.destroy()


def test_equal_seeds_of_noise_give_equal_noise_in_equal_worlds(client):
    """Two runs of one script."""

    def run(seed: str) -> list[float]:
        with synchronous(client.reload_world()) as world:
            place = carla.Transform(carla.Location(z=30.0))
            faults = {"noise_accel_stddev_x": "1.0", "noise_seed": seed}
            imu, measured = attach(world, None, "sensor.other.imu", place, **faults)
            ticks(world, 5)
            felt = [measured.get(timeout=WAIT_SECS).accelerometer.x for _ in range(5)]
            imu.destroy()
            return felt

    first = run("7")
    assert run("7") == first != run("8")
