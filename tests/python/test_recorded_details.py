"""What a recording says beside places, and what a replay makes of it."""

import math

import carla
import pytest

import carla_log
from carla_log import PHYSICS, POSITION, SCENE_LIGHT, STATE, WHEELS
from carla_site import STEP_SECS, connect, spawn_car, ticks
from recorded_drive import finished

FRAMES = 40
BICYCLE = "vehicle.bh.crossbike"
FRONT_WHEELS = (carla.VehicleWheelLocation.FL_Wheel, carla.VehicleWheelLocation.FR_Wheel)
WHEEL_DEG = 0.01


def wheel_angles(car: carla.Vehicle) -> list[tuple[float, float]]:
    """How the front wheels are steered and turned, as the client tells it."""
    return [
        (car.get_wheel_steer_angle(wheel), car.get_wheel_pitch_angle(wheel))
        for wheel in FRONT_WHEELS
    ]


def turn_deg(one: float, other: float) -> float:
    return (other - one + 180.0) % 360.0 - 180.0


def test_wheels_of_a_steered_car_and_a_bicycle_are_recorded_and_replayed(client, world, tmp_path):
    path = tmp_path / "wheels.log"
    client.start_recorder(str(path))
    car = spawn_car(world, 0)
    place = world.get_map().get_spawn_points()[1]
    bicycle = world.spawn_actor(world.get_blueprint_library().find(BICYCLE), place)
    control = carla.VehicleControl(throttle=0.6, steer=0.5)
    car.apply_control(control)
    bicycle.apply_control(carla.VehicleControl(throttle=0.4))
    steered, speeds, ridden = [], [], []
    for _ in range(FRAMES):
        world.tick()
        steered.append([angle for angle, _ in wheel_angles(car)])
        ahead = car.get_transform().get_forward_vector()
        speeds.append(car.get_velocity().dot(ahead))
        ridden.append(bicycle.get_velocity().dot(bicycle.get_transform().get_forward_vector()))
    radius_m = car.get_physics_control().wheels[0].radius / 100.0
    log = finished(client, path)
    wheels = [frame.by_actor(WHEELS)[car.id][0] for frame in log.frames]
    for recorded, seen in zip(wheels, steered, strict=True):
        assert [number for number, *_ in recorded] == [0, 1, 2, 3]
        assert [angle for _, angle, _ in recorded[:2]] == pytest.approx(seen, abs=WHEEL_DEG)
        assert [angle for _, angle, _ in recorded[2:]] == [0.0, 0.0]
    # To the right, the inner wheel further; and they roll as far as the car drives, negative ahead.
    (_, outer, _), (_, inner, _) = wheels[-1][:2]
    assert 5.0 < outer < inner
    for before, now, speed in zip(wheels[:-1], wheels[1:], speeds[1:], strict=True):
        rolled = math.degrees(speed * STEP_SECS / radius_m)
        left, right = (turn_deg(before[wheel][2], now[wheel][2]) for wheel in (2, 3))
        assert (left + right) / 2.0 == pytest.approx(-rolled, abs=0.1)
    assert speeds[-1] > 2.0 and left < right < 0.0
    for frame, speed in zip(log.frames, ridden, strict=True):
        assert [number for number, *_ in frame.by_actor(WHEELS)[bicycle.id][0]] == [0, 1]
        told, engine = frame.by_actor(carla_log.BIKER)[bicycle.id]
        assert told == pytest.approx(100.0 * speed, abs=0.1)
        assert engine == pytest.approx(0.4)
        assert car.id not in frame.by_actor(carla_log.BIKER)

    car.destroy()
    bicycle.destroy()
    world.tick()
    client.replay_file(str(path), 0.0, 0.0, 0)
    for frame in log.frames[1 : FRAMES - 1]:
        world.tick()
        again = world.get_actor(car.id)
        wanted = [(steer, turned) for _, steer, turned in frame.by_actor(WHEELS)[car.id][0][:2]]
        for angles, recorded in zip(wheel_angles(again), wanted, strict=True):
            assert angles == pytest.approx(recorded, abs=WHEEL_DEG), frame.number


def test_lights_of_a_replay_have_their_recorded_times_and_do_not_seem_frozen(
    client, world, tmp_path
):
    path = tmp_path / "lights.log"
    client.start_recorder(str(path))
    lights = world.get_actors().filter("traffic.traffic_light")
    ticks(world, 10)
    lights[0].set_state(carla.TrafficLightState.Yellow)
    ticks(world, 10)
    lights[0].freeze(True)
    ticks(world, 10)
    lights[0].freeze(False)
    ticks(world, 5)
    log = finished(client, path)
    frozen = [{flag for flag, _, _ in frame.by_actor(STATE).values()} for frame in log.frames]
    assert frozen[5] == {0} and frozen[25] == {1} and frozen[33] == {0}
    client.replay_file(str(path), 0.0, 0.0, 0)
    for frame in log.frames[1:34]:
        world.tick()
        recorded = frame.by_actor(STATE)
        for light in lights:
            flag, elapsed, _ = recorded[light.id]
            assert light.get_elapsed_time() == pytest.approx(elapsed, abs=1e-4), frame.number
            assert light.is_frozen() == bool(flag), frame.number
    client.stop_replayer(False)
    # The lights go on by themselves.
    ticks(world, 2)
    before = lights[1].get_elapsed_time()
    ticks(world, 2)
    after = lights[1].get_elapsed_time()
    assert after - before == pytest.approx(2 * STEP_SECS, abs=1e-3) or after < before
    assert not lights[1].is_frozen()


def test_physics_that_is_changed_is_told_again(client, world, tmp_path):
    path = tmp_path / "physics.log"
    car = spawn_car(world)
    world.tick()
    client.start_recorder(str(path), True)
    ticks(world, 3)
    physics = car.get_physics_control()
    physics.mass = 1234.0
    car.apply_physics_control(physics)
    ticks(world, 3)
    log = finished(client, path)
    told = [frame.by_actor(PHYSICS).get(car.id) for frame in log.frames]
    assert [numbers is not None for numbers in told] == [True, False, False, True, False, False]
    masses = [numbers[0][8] for numbers in told if numbers is not None]
    assert masses[0] != 1234.0 and masses[1] == 1234.0


def test_the_first_frame_has_every_lamp_of_the_map(client, world, site, tmp_path):
    path = tmp_path / "lamps.log"
    # A client keeps the lamps of maps that it had before.
    newcomer = connect(site.carla_port).get_world()
    lamps = {lamp.id for lamp in newcomer.get_lightmanager().get_all_lights()}
    client.start_recorder(str(path))
    ticks(world, 5)
    log = finished(client, path)
    told = [{record[0] for record in frame.records[SCENE_LIGHT]} for frame in log.frames]
    assert len(lamps) > 10
    assert told == [lamps, set(), set(), set(), set()]


def test_another_map_ends_a_recording_whole(client, world, tmp_path):
    path = tmp_path / "left.log"
    client.start_recorder(str(path))
    car = spawn_car(world)
    ticks(world, 10)
    other = client.load_world("Town02", False)
    ticks(other, 5)
    text = client.show_recorder_file_info(str(path), False)
    assert "\nFrames: 10\n" in text
    log = carla_log.read(path)
    assert log.map == "Town10HD_Opt" and len(log.frames) == 10
    assert log.frames[-1].duration == -1.0
    assert car.id in log.frames[-1].by_actor(POSITION)
