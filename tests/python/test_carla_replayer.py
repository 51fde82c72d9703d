"""CARLA's replayer, through CARLA's own client."""

import math
import queue
import time

import carla
import pytest

import carla_log
from carla_log import ADD, KINEMATICS, POSITION
from carla_site import STEP_SECS, attach, spawn_car, ticks
from recorded_drive import NEAR_M, WAIT_SECS, drive, finished, is_near, seen
from running_site import two_free_ports


@pytest.fixture
def recorded(client, world, tmp_path):
    """A log of 100 frames of two driving cars, which are gone, and their ids."""
    path = tmp_path / "drive.log"
    client.start_recorder(str(path), True)
    cars = drive(world)
    ticks(world, 100)
    ids = [car.id for car in cars]
    log = finished(client, path)
    for car in cars:
        car.destroy()
    world.tick()
    return path, log, ids


def lincolns(world: carla.World) -> list[carla.Actor]:
    """In the order of their ids, which is that of the recording."""
    found = world.get_actors().filter("vehicle.lincoln.mkz_2020")
    return sorted(found, key=lambda car: car.id)


def test_replayed_poses_are_the_recorded_ones(client, world, recorded):
    path, log, ids = recorded
    text = client.replay_file(str(path), 0.0, 0.0, 0)
    total = f"{log.frames[-1].elapsed:.6g}"
    assert text == (
        f"Replaying File: {path}\nTotal time recorded: {total}\n"
        f"Replaying from 0 s - {total} s ({total} s) at 1.0x\nIgnoring Spectator camera\n"
    )
    world.tick()
    cars = lincolns(world)
    assert len(cars) == 2
    for frame in log.frames[2:99]:
        now = seen(world, world.tick())
        positions = frame.by_actor(POSITION)
        for car, id_ in zip(cars, ids, strict=True):
            assert is_near(positions[id_], now[car.id]), frame.number
    speed = cars[0].get_velocity().length()
    kinematics = log.frames[98].by_actor(KINEMATICS)[ids[0]]
    assert speed == pytest.approx(math.dist(kinematics[:3], (0, 0, 0)), abs=0.5)


def test_at_the_end_vehicles_stand_and_drive_again_when_they_are_told_to(client, world, recorded):
    path, *_ = recorded
    client.replay_file(str(path), -1.0, 0.0, 0)
    ticks(world, 25)
    car = lincolns(world)[0]
    ticks(world, 20)
    assert car.get_velocity().length() < 0.3
    # Where the recorded drive ended there may be a wall ahead.
    car.set_transform(world.get_map().get_spawn_points()[5])
    world.tick()
    place = car.get_location()
    car.apply_control(carla.VehicleControl(throttle=0.8))
    ticks(world, 40)
    assert car.get_location().distance(place) > 2.0


def test_a_part_of_a_log_is_replayed(client, world, recorded):
    path, log, ids = recorded
    text = client.replay_file(str(path), 2.0, 1.0, 0)
    assert "Replaying from 2 s - 3 s (" in text
    world.tick()
    car = lincolns(world)[0]
    now = seen(world, world.tick())
    assert is_near(log.frames[42].by_actor(POSITION)[ids[0]], now[car.id])
    ticks(world, 18)
    still = car.get_location()
    ticks(world, 20)
    assert car.get_location().distance(still) < 0.5


def test_the_factor_of_time_may_change_during_a_replay(client, world, recorded):
    path, log, ids = recorded
    client.set_replayer_time_factor(2.5)
    text = client.replay_file(str(path), 0.0, 0.0, 0)
    assert "at 2.5x" in text
    try:
        ticks(world, 4)
        car = lincolns(world)[0]
        now = seen(world, world.get_snapshot().frame)
        assert is_near(log.frames[10].by_actor(POSITION)[ids[0]], now[car.id])
        client.set_replayer_time_factor(0.5)
        ticks(world, 1)
        between = seen(world, world.tick())
        assert is_near(log.frames[11].by_actor(POSITION)[ids[0]], between[car.id])
        client.set_replayer_time_factor(0.0)
        ticks(world, 5)
        stopped = seen(world, world.get_snapshot().frame)
        assert stopped[car.id].location.distance(between[car.id].location) < NEAR_M
    finally:
        client.set_replayer_time_factor(1.0)
        client.stop_replayer(False)


@pytest.mark.parametrize("factor", [0.5, 1.0, 4.0])
def test_a_log_goes_by_as_fast_as_the_factor_says(client, world, recorded, factor):
    path, log, ids = recorded
    client.set_replayer_time_factor(factor)
    try:
        client.replay_file(str(path), 0.0, 0.0, 0)
        now = seen(world, ticks(world, 20))
        shown = log.frames[round(20 * factor)].by_actor(POSITION)
        assert all(is_near(shown[id_], now[id_]) for id_ in ids)
    finally:
        client.set_replayer_time_factor(1.0)
        client.stop_replayer(False)


def test_the_spectator_follows_an_actor_of_the_log(client, world, recorded):
    path, _, ids = recorded
    spectator = world.get_spectator()
    client.replay_file(str(path), 0.0, 0.0, ids[0])
    ticks(world, 10)
    car = lincolns(world)[0]
    apart = spectator.get_location().distance(car.get_location())
    assert apart == pytest.approx(math.hypot(10.0, 5.0), abs=0.05)
    client.stop_replayer(False)


def test_heroes_can_be_left_out_and_others_go_on(client, world, tmp_path):
    path = tmp_path / "hero.log"
    client.start_recorder(str(path))
    hero, other = spawn_car(world, 0, role_name="hero"), spawn_car(world, 1)
    ticks(world, 20)
    finished(client, path)
    hero.destroy()
    other.destroy()
    manager = client.get_trafficmanager(two_free_ports())
    manager.set_synchronous_mode(True)
    stranger = spawn_car(world, 7)
    ticks(world, 2)
    stranger.set_autopilot(True, manager.get_port())
    place = stranger.get_location()
    client.set_replayer_ignore_hero(True)
    try:
        text = client.replay_file(str(path), 0.0, 0.0, 0)
        assert "Ignoring Hero vehicle\n" in text
        ticks(world, 10)
        roles = [car.attributes["role_name"] for car in lincolns(world)]
        assert "hero" not in roles and len(roles) == 2
        # It sets off during the replay, and drives on after its end.
        ticks(world, 40)
        there = stranger.get_location()
        assert there.distance(place) > 1.0
        ticks(world, 40)
        assert stranger.get_location().distance(there) > 1.0
    finally:
        stranger.set_autopilot(False, manager.get_port())
        manager.shut_down()
        client.set_replayer_ignore_hero(False)


def test_a_replay_loads_the_map_of_its_log_first(client, world, recorded):
    path, *_ = recorded
    client.load_world("Town02")
    text = client.replay_file(str(path), 0.0, 0.0, 0)
    assert text.split("\n")[1:3] == [
        "Loading map Town10HD_Opt",
        "Replayer will start after map is loaded...",
    ]
    again = client.get_world()
    assert again.get_map().name.endswith("Town10HD_Opt")
    deadline = time.monotonic() + WAIT_SECS
    while not lincolns(again) and time.monotonic() < deadline:
        again.wait_for_tick()
    assert len(lincolns(again)) == 2


def test_a_stopped_replay_leaves_what_had_no_end(client, world, recorded):
    path, *_ = recorded
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 5)
    client.stop_replayer(True)
    client.stop_replayer(True)
    ticks(world, 2)
    assert len(lincolns(world)) == 2


def test_sensors_of_a_log_are_replayed_on_demand(client, world, tmp_path):
    path = tmp_path / "sensors.log"
    client.start_recorder(str(path))
    car = spawn_car(world)
    sensor, _ = attach(world, car, "sensor.other.imu")
    ticks(world, 10)
    finished(client, path)
    sensor.destroy()
    car.destroy()
    world.tick()
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 3)
    assert not world.get_actors().filter("sensor.*")
    client.stop_replayer(False)
    client.replay_file(str(path), 0.0, 0.0, 0, True)
    ticks(world, 3)
    (again,) = world.get_actors().filter("sensor.other.imu")
    measured = queue.Queue()
    again.listen(measured.put)
    ticks(world, 2)
    assert measured.get(timeout=WAIT_SECS) is not None


@pytest.mark.parametrize(
    ("name", "secs"), [("DistanceBetweenVehicles", "24.7237"), ("DistanceToLaneCenter", "12.5282")]
)
def test_a_log_of_carla_itself_is_replayed(client, world, name, secs):
    path = carla_log.genuine(name)
    log = carla_log.read(path)
    begin = log.frames[-1].elapsed * 0.4
    blueprints = {add[0]: add[4] for frame in log.frames for add in frame.records[ADD]}
    text = client.replay_file(str(path), begin, 0.0, 0)
    assert f"Total time recorded: {secs}\n" in text
    again = client.get_world()
    assert again.get_map().name.endswith("Town01")
    for number in range(1, 41):
        now = seen(again, again.tick())
        if number % 8:
            continue
        wanted = places_at(log, begin + number * STEP_SECS)
        recorded = [
            place for id_, place in wanted.items() if blueprints[id_].startswith("vehicle.")
        ]
        cars = again.get_actors().filter("vehicle.*")
        assert len(cars) == len(recorded) > 0
        for place in recorded:
            assert any(is_near(place, now[car.id]) for car in cars), (number, place)


def places_at(log: carla_log.Log, secs: float) -> dict[int, tuple]:
    """Places and rotations between the two frames around a time, angles by the shorter way."""
    after = next(at for at, frame in enumerate(log.frames) if frame.elapsed > secs)
    one, other = log.frames[after - 1], log.frames[after]
    share = (secs - one.elapsed) / (other.elapsed - one.elapsed)
    there = other.by_actor(POSITION)

    def between(before: tuple, then: tuple) -> tuple:
        lengths = [a + (b - a) * share for a, b in zip(before[:3], then[:3], strict=True)]
        angles = [
            a + ((b - a + 180) % 360 - 180) * share
            for a, b in zip(before[3:], then[3:], strict=True)
        ]
        return (*lengths, *angles)

    return {
        id_: between(place, there.get(id_, place)) for id_, place in one.by_actor(POSITION).items()
    }
