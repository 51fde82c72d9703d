"""What a replay shows beside poses, and how it goes together with everything else."""

import math
import time

import carla
import pytest

import carla_log
from carla_log import POSITION, STATE
from carla_site import STEP_SECS, attach, connect, spawn_car, ticks
from recorded_drive import WAIT_SECS, drive, finished, is_near, shows

CARS = "vehicle.lincoln.mkz_2020"


@pytest.fixture
def recorded(client, world, tmp_path):
    """A log of 60 frames of two driving cars, which are gone, and their ids."""
    path = tmp_path / "drive.log"
    client.start_recorder(str(path))
    cars = drive(world)
    ticks(world, 60)
    ids = [car.id for car in cars]
    log = finished(client, path)
    for car in cars:
        car.destroy()
    world.tick()
    return path, log, ids


def test_replayed_actors_have_their_recorded_ids(client, world, recorded):
    path, log, ids = recorded
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 3)
    assert sorted(car.id for car in world.get_actors().filter(CARS)) == ids
    assert shows(world, log.frames[3], ids)
    assert world.get_actor(ids[0]).attributes["role_name"] == "autopilot"
    newest = spawn_car(world, 5)
    assert newest.id > max(ids)


def test_an_id_that_somebody_else_has_or_had_is_not_given_again(client, world, recorded, tmp_path):
    path, _, ids = recorded
    data = path.read_bytes()
    # The same log of other cars: whoever remembers the old ones would take them for these.
    other = tmp_path / "other.log"
    other.write_bytes(data.replace(b"\x09\x00autopilot", b"\x09\x00otherrole"))
    client.replay_file(str(other), 0.0, 0.0, 0)
    ticks(world, 3)
    cars = world.get_actors().filter(CARS)
    assert len(cars) == 2 and not {car.id for car in cars} & set(ids)
    assert {car.attributes["role_name"] for car in cars} == {"otherrole"}


def test_replayed_actors_may_have_ids_of_earlier_worlds(client, world, recorded, tmp_path):
    path, _, ids = recorded
    other = tmp_path / "other.log"
    other.write_bytes(path.read_bytes().replace(b"\x09\x00autopilot", b"\x09\x00otherrole"))
    world = client.reload_world(False)
    assert min(actor.id for actor in world.get_actors()) > max(ids)
    for _ in range(2):
        client.replay_file(str(other), 0.0, 0.0, 0)
        ticks(world, 3)
        assert sorted(car.id for car in world.get_actors().filter(CARS)) == ids
        assert world.get_actor(ids[0]).attributes["role_name"] == "otherrole"
        client.stop_replayer(False)
    newest = spawn_car(world, 5)
    assert newest.id > max(actor.id for actor in world.get_actors() if actor.id != newest.id)


def test_one_who_lives_plays_itself_and_who_is_gone_comes_back(client, world, tmp_path):
    path = tmp_path / "drive.log"
    client.start_recorder(str(path))
    cars = drive(world)
    ticks(world, 40)
    log = finished(client, path)
    cars[1].destroy()
    world.tick()
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 20)
    ids = [car.id for car in cars]
    assert sorted(car.id for car in world.get_actors().filter(CARS)) == ids
    assert shows(world, log.frames[20], ids)


def test_the_last_seconds_are_replayed(client, world, recorded):
    path, log, ids = recorded
    total = log.frames[-1].elapsed
    text = client.replay_file(str(path), -1.0, 0.0, 0)
    assert f"Replaying from {total - 1:.6g} s - {total:.6g} s ({total:.6g} s)" in text
    ticks(world, 1)
    assert shows(world, log.frames[-20], ids)
    ticks(world, 18)
    assert shows(world, log.frames[-2], ids)


def test_a_log_is_replayed_twice_and_during_another_replay(client, world, recorded):
    path, log, ids = recorded
    for _ in range(2):
        client.replay_file(str(path), 0.0, 0.0, 0)
        ticks(world, 10)
        assert shows(world, log.frames[10], ids)
        assert len(world.get_actors().filter(CARS)) == 2


def test_a_replay_ends_a_recording_and_a_recording_ends_a_replay(client, world, recorded, tmp_path):
    path, log, ids = recorded
    first, second = tmp_path / "first.log", tmp_path / "second.log"
    client.start_recorder(str(first))
    ticks(world, 5)
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 10)
    assert "\nFrames: 5\n" in client.show_recorder_file_info(str(first), False)
    assert len(carla_log.read(first).frames) == 5
    client.start_recorder(str(second))
    ticks(world, 20)
    # Nobody moves the cars any more.
    again = finished(client, second)
    assert len(again.frames) == 20
    for id_ in ids:
        x, y, *_ = again.frames[-1].by_actor(POSITION)[id_]
        recorded_x, recorded_y, *_ = log.frames[30].by_actor(POSITION)[id_]
        assert math.dist((x, y), (recorded_x, recorded_y)) > 100.0


def test_in_asynchronous_mode_a_replay_goes_on_by_itself(client, world, recorded):
    path, log, ids = recorded
    settings = world.get_settings()
    settings.synchronous_mode = False
    world.apply_settings(settings)
    client.set_replayer_time_factor(4.0)
    try:
        client.replay_file(str(path), 0.0, 0.0, 0)
        end = log.frames[-1].by_actor(POSITION)[ids[0]]
        deadline = time.monotonic() + WAIT_SECS

        def is_there() -> bool:
            place = world.wait_for_tick().find(ids[0])
            if place is None:
                return False
            place = place.get_transform().location
            return math.dist((place.x * 100, place.y * 100), end[:2]) < 100.0

        while not is_there():
            assert time.monotonic() < deadline, "it does not come to where the log ends"
    finally:
        client.set_replayer_time_factor(1.0)
        client.stop_replayer(True)


@pytest.mark.parametrize(
    ("offset", "apart_m", "above_m"),
    [
        (None, math.hypot(10.0, 5.0), 5.0),
        (carla.Transform(carla.Location(z=40.0), carla.Rotation(pitch=-90.0)), 40.0, 40.0),
    ],
)
def test_the_spectator_follows_with_an_offset(client, world, recorded, offset, apart_m, above_m):
    path, _, ids = recorded
    more = () if offset is None else (False, offset)
    client.replay_file(str(path), 0.0, 0.0, ids[0], *more)
    for _ in range(5):
        ticks(world, 4)
        followed = world.get_actor(ids[0]).get_location()
        spectator = world.get_spectator().get_location()
        assert spectator.distance(followed) == pytest.approx(apart_m, abs=0.05)
        assert spectator.z - followed.z == pytest.approx(above_m, abs=0.5)


def test_the_spectator_stays_unless_the_log_is_to_move_it(client, world, tmp_path):
    path = tmp_path / "spectator.log"
    spectator = world.get_spectator()
    client.start_recorder(str(path))
    spawn_car(world)
    for number in range(20):
        spectator.set_transform(carla.Transform(carla.Location(x=float(number), z=50.0)))
        world.tick()
    log = finished(client, path)
    mine = carla.Transform(carla.Location(x=-70.0, y=3.0, z=20.0))
    spectator.set_transform(mine)
    world.tick()
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 5)
    assert spectator.get_location().distance(mine.location) < 0.01
    client.set_replayer_ignore_spectator(False)
    try:
        text = client.replay_file(str(path), 0.0, 0.0, 0)
        assert "Ignoring Spectator" not in text
        ticks(world, 5)
        place = log.frames[5].by_actor(POSITION)[spectator.id]
        assert is_near(place, spectator.get_transform())
    finally:
        client.set_replayer_ignore_spectator(True)


def told_intensity(site, lamp: carla.Light) -> float:
    """As a new client hears: each tells its own lamps itself."""
    (intensity,) = connect(site.carla_port).get_world().get_lightmanager().get_intensity([lamp])
    return intensity


def test_lights_doors_and_lamps_of_a_log_come_back(site, client, world, tmp_path):
    path = tmp_path / "lights.log"
    manager = world.get_lightmanager()
    # The client remembers lamps of the maps before.
    here = {
        one.id for one in connect(site.carla_port).get_world().get_lightmanager().get_all_lights()
    }
    lamp = next(one for one in manager.get_all_lights() if one.id in here)
    light = next(iter(world.get_actors().filter("traffic.traffic_light")))
    night = carla.WeatherParameters(sun_altitude_angle=-30.0, cloudiness=40.0)
    client.start_recorder(str(path))
    car = spawn_car(world)
    ticks(world, 5)
    car.set_light_state(carla.VehicleLightState(carla.VehicleLightState.LeftBlinker))
    car.open_door(carla.VehicleDoor.RL)
    manager.set_intensity([lamp], 123.0)
    light.set_state(carla.TrafficLightState.Yellow)
    world.set_weather(night)
    world.tick()
    # The client tells its lamps beside its frames.
    deadline = time.monotonic() + WAIT_SECS
    while told_intensity(site, lamp) != 123.0:
        assert time.monotonic() < deadline
        time.sleep(0.2)
    ticks(world, 19)
    log = finished(client, path)
    car.destroy()
    manager.set_intensity([lamp], 7.0)
    world.set_weather(carla.WeatherParameters.ClearNoon)
    ticks(world, 40)
    # What was said before the beginning holds.
    client.replay_file(str(path), 0.5, 0.0, 0)
    ticks(world, 5)
    car = world.get_actor(car.id)
    assert car.get_light_state() == carla.VehicleLightState.LeftBlinker
    assert world.get_weather().sun_altitude_angle == pytest.approx(-30.0)
    shown = {int(one.id): int(one.state) for one in world.get_actors().filter("*traffic_light")}
    recorded = log.frames[15].by_actor(STATE)
    assert shown == {id_: state for id_, (_, _, state) in recorded.items()}
    deadline = time.monotonic() + WAIT_SECS
    while manager.get_intensity([lamp]) != [123.0] and time.monotonic() < deadline:
        time.sleep(0.02)
    assert manager.get_intensity([lamp]) == [123.0]
    again = tmp_path / "again.log"
    client.start_recorder(str(again))
    ticks(world, 2)
    first = finished(client, again).frames[0]
    assert first.records[carla_log.DOOR] == [(car.id, 2, 1)]


def test_what_is_still_to_come_happens_at_a_stop_that_keeps_nothing(client, world, tmp_path):
    path = tmp_path / "ends.log"
    client.start_recorder(str(path))
    cars = drive(world)
    ticks(world, 20)
    late = spawn_car(world, 7)
    ticks(world, 5)
    cars[1].destroy()
    ticks(world, 5)
    finished(client, path)
    cars[0].destroy()
    late.destroy()
    world.tick()
    for keeps, left in ((True, [cars[0].id, cars[1].id]), (False, [cars[0].id, late.id])):
        client.replay_file(str(path), 0.0, 0.0, 0)
        ticks(world, 5)
        client.stop_replayer(keeps)
        ticks(world, 2)
        living = world.get_actors().filter(CARS)
        assert sorted(car.id for car in living) == sorted(left), keeps
        for car in living:
            car.destroy()
        world.tick()


def test_another_client_sees_and_stops_a_replay(client, world, site, recorded):
    path, log, ids = recorded
    other = connect(site.carla_port)
    other.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 5)
    assert shows(world, log.frames[5], ids)
    client.stop_replayer(True)
    # The recorded world goes on, and clients drive its cars.
    cars = [world.get_actor(id_) for id_ in ids]
    for car in cars:
        car.apply_control(carla.VehicleControl(brake=1.0))
    ticks(world, 80)
    assert all(car.get_velocity().length() < 0.5 for car in cars)


def test_contacts_are_measured_again_where_they_were_recorded(client, world, tmp_path):
    """The incident workflow: ask, then replay from a little before with the camera on the actor."""
    path = tmp_path / "col2.log"
    client.start_recorder(str(path))
    place = world.get_map().get_spawn_points()[0]
    hero = spawn_car(world, role_name="hero")
    place.location += place.get_forward_vector() * 12.0
    parked = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), place)
    attach(world, hero, "sensor.other.collision", carla.Transform())
    hero.apply_control(carla.VehicleControl(throttle=1.0))
    ticks(world, 80)
    log = finished(client, path)
    touching = [
        frame.elapsed
        for frame in log.frames
        if any(contact[2] == parked.id for contact in frame.records[carla_log.COLLISION])
    ]
    table = client.show_recorder_collisions(str(path), "h", "v")
    row = next(line for line in table.splitlines() if "vehicle.audi.tt" in line)
    assert float(row.split()[0]) == pytest.approx(touching[0], abs=0.5)
    text = client.replay_file(str(path), touching[0] - 1.0, 0.0, int(row.split()[3]))
    assert "Replaying from " in text
    ticks(world, round(1.0 / STEP_SECS))
    gap = (
        world.get_actor(hero.id).get_location().distance(world.get_actor(parked.id).get_location())
    )
    lengths = hero.bounding_box.extent.x + parked.bounding_box.extent.x
    assert gap < lengths + 0.1
    assert (
        world.get_spectator().get_location().distance(world.get_actor(hero.id).get_location())
        < 12.0
    )
    client.stop_replayer(True)
    # From here on it is another story: the hero brakes, and drives back.
    hero.apply_control(carla.VehicleControl(brake=1.0))
    ticks(world, 60)
    hero.apply_control(carla.VehicleControl(throttle=0.6, reverse=True))
    ticks(world, 80)
    apart = (
        world.get_actor(hero.id).get_location().distance(world.get_actor(parked.id).get_location())
    )
    assert apart > gap + 2.0


def test_lights_take_their_recorded_turns_in_a_world_made_anew(client, world, tmp_path):
    path = tmp_path / "turns.log"
    client.start_recorder(str(path), True)
    ticks(world, 5)
    light = world.get_actors().filter("traffic.traffic_light")[0]
    for one in light.get_group_traffic_lights():
        one.set_green_time(0.5)
        one.set_yellow_time(0.25)
        one.set_red_time(0.25)
    ticks(world, 75)
    log = finished(client, path)
    told = log.frames[5].by_actor(carla_log.LIGHT_TIMES)
    assert told[light.id] == (0.5, 0.25, 0.25)
    # Lights of a new world have new ids, in the same order.
    states = [
        [state for _, (_, _, state) in sorted(frame.by_actor(STATE).items())]
        for frame in log.frames
    ]
    assert {frame.by_actor(STATE)[light.id][2] for frame in log.frames} == {0, 1, 2}
    # Keeps its settings.
    again = client.reload_world(False)
    client.replay_file(str(path), 0.0, 0.0, 0)
    for wanted in states[1:79]:
        again.tick()
        lights = again.get_actors().filter("traffic.traffic_light")
        assert [int(one.state) for one in sorted(lights, key=lambda one: one.id)] == wanted


def test_at_the_end_vehicles_drive_on_around_what_is_new(start_site, tmp_path):
    """Where the site is told so."""
    site = start_site("--no-render", "--drive-after-replays")
    client = connect(site.carla_port)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, STEP_SECS
    world.apply_settings(settings)
    path = tmp_path / "drive.log"
    client.start_recorder(str(path))
    car = spawn_car(world)
    ticks(world, 20)
    finished(client, path)
    client.replay_file(str(path), 0.0, 0.0, 0)
    ticks(world, 20)
    place = car.get_location()
    ahead = world.get_map().get_spawn_points()[0]
    ahead.location += ahead.get_forward_vector() * 20.0
    new = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), ahead)
    ticks(world, 20)
    there = new.get_location()
    gaps = []
    for _ in range(25):
        ticks(world, 10)
        gaps.append(car.get_location().distance(there))
    # It changes its lane, or waits behind; nobody is touched.
    assert car.get_location().distance(place) > 5.0
    assert min(gaps) > car.bounding_box.extent.y + new.bounding_box.extent.y
    assert new.get_location().distance(there) < 0.01
    settings.synchronous_mode, settings.fixed_delta_seconds = False, None
    world.apply_settings(settings)
