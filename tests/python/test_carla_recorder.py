"""CARLA's recorder and its queries, through CARLA's own client."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import carla
import pytest

import carla_log
import metrics_text
from carla_log import ADD, COLLISION, KINEMATICS, POSITION, STATE
from carla_site import STEP_SECS, attach, connect, spawn_car, ticks
from recorded_drive import drive, finished, is_near, seen
from running_site import binary, child, two_free_ports


def test_a_log_says_of_each_frame_what_clients_see_in_its_snapshot(client, world, tmp_path):
    path = tmp_path / "a.log"
    before = spawn_car(world, 5)
    world.tick()
    assert client.start_recorder(str(path)) == str(path)
    cars = drive(world)
    snapshots = [seen(world, world.tick()) for _ in range(40)]
    cars[1].destroy()
    snapshots += [seen(world, world.tick()) for _ in range(5)]
    log = finished(client, path)
    assert (log.version, log.map) == (2, "Town10HD_Opt")
    assert abs(log.date - time.time()) < 600
    assert [frame.number for frame in log.frames] == list(range(1, 46))
    for frame, snapshot in zip(log.frames, snapshots, strict=True):
        positions = frame.by_actor(POSITION)
        assert {before.id, cars[0].id} <= positions.keys()
        assert all(is_near(positions[id_], snapshot[id_]) for id_ in positions)
        assert frame.elapsed == pytest.approx((frame.number - 1) * STEP_SECS)
    assert [frame.duration for frame in log.frames[:-1]] == pytest.approx([STEP_SECS] * 44)
    assert log.frames[-1].duration == -1.0
    assert cars[1].id not in log.frames[40].by_actor(POSITION)
    assert log.frames[40].records[carla_log.DESTROY] == [(cars[1].id,)]
    lights = world.get_actors().filter("traffic.traffic_light")
    states = log.frames[0].by_actor(STATE)
    assert {light.id: int(light.state) for light in lights} == {
        id_: state for id_, (_, _, state) in log.frames[-1].by_actor(STATE).items()
    }
    assert len(states) == len(lights)


def test_actors_are_told_with_class_number_and_attributes(client, world, tmp_path):
    path = tmp_path / "a.log"
    car = spawn_car(world, role_name="hero", color="10,20,30")
    world.tick()
    client.start_recorder(str(path), True)
    world.tick()
    roof = carla.Transform(carla.Location(x=-5.9, z=2.5))
    camera, _ = attach(world, car, "sensor.other.gnss", roof)
    car.set_light_state(carla.VehicleLightState(carla.VehicleLightState.Brake))
    car.open_door(carla.VehicleDoor.FR)
    ticks(world, 3)
    camera.destroy()
    world.tick()
    log = finished(client, path)
    adds = {record[0]: record[1:] for frame in log.frames for record in frame.records[ADD]}
    class_, place, uid, blueprint, attributes = adds[car.id]
    assert (class_, blueprint) == (1, "vehicle.lincoln.mkz_2020")
    here = car.get_location()
    assert place[:2] == pytest.approx((here.x * 100, here.y * 100), abs=1.0) and uid > 0
    assert attributes["role_name"] == (4, "hero") and attributes["color"] == (5, "10,20,30")
    assert attributes["number_of_wheels"] == (2, "4")
    class_, place, _, blueprint, _ = adds[camera.id]
    assert (class_, blueprint) == (5, "sensor.other.gnss")
    of_map = [*world.get_actors().filter("traffic.*"), world.get_spectator()]
    assert not any(one.attributes for one in of_map)
    assert not any(adds[one.id][-1] for one in of_map)
    assert place[:3] == pytest.approx((-590, 0, 250), abs=0.5)
    assert (camera.id, car.id) in log.frames[1].records[carla_log.PARENT]
    assert log.frames[1].records[carla_log.DOOR] == [(car.id, 1, 1)]
    assert log.frames[1].by_actor(carla_log.LIGHTS)[car.id] == (8,)
    assert {carla_log.BOX, carla_log.PLATFORM_TIME, carla_log.BONES} <= set(log.frames[2].ids)
    assert log.frames[0].by_actor(carla_log.BOX)[car.id][3:] == pytest.approx(
        [100 * getattr(car.bounding_box.extent, axis) for axis in "xyz"], abs=0.1
    )
    volumes = log.frames[0].by_actor(carla_log.VOLUME)
    lights = {one.id for one in world.get_actors().filter("traffic.traffic_light")}
    assert lights & volumes.keys()
    text = client.show_recorder_file_info(str(path), True)
    for section in (
        "Dynamic actors",
        "Actor bounding boxes",
        "Actor trigger volumes",
        "Current platform time",
        "Physics Control events",
        "Traffic Light time events",
    ):
        assert f"\n {section}: " in text
    physics = log.frames[0].by_actor(carla_log.PHYSICS)[car.id]
    assert physics[0][8] == pytest.approx(car.get_physics_control().mass)
    velocity = log.frames[0].by_actor(KINEMATICS)[car.id]
    assert math.dist(velocity[:3], (0, 0, 0)) < 1.0
    assert len(log.frames[0].records[carla_log.LIGHT_TIMES]) > 0
    assert len(log.frames[0].records[carla_log.WEATHER][0]) == 14


def test_without_additional_data_there_is_none(client, world, tmp_path):
    path = tmp_path / "a.log"
    client.start_recorder(str(path))
    ticks(world, 3)
    ids = {id_ for frame in finished(client, path).frames for id_ in frame.ids}
    assert not ids & {12, 13, 14, 15, 16, 17, 18, 19}


def test_the_text_of_a_log_is_what_metrics_take_apart(client, world, tmp_path):
    path = tmp_path / "a.log"
    client.start_recorder(str(path), True)
    cars = drive(world)
    ticks(world, 10)
    cars[0].open_door(carla.VehicleDoor.All)
    cars[1].destroy()
    ticks(world, 10)
    log = finished(client, path)
    info = metrics_text.parse(client.show_recorder_file_info(str(path), True))
    assert (info["map"], info["total_frames"]) == ("Town10HD_Opt", 20)
    assert info["duration"] == pytest.approx(19 * STEP_SECS, abs=1e-5)
    assert info["actors"][cars[0].id]["type_id"] == "vehicle.lincoln.mkz_2020"
    assert info["actors"][cars[0].id]["role_name"] == cars[0].attributes["role_name"]
    for told, frame in zip(info["frames"], log.frames, strict=True):
        for id_, recorded in frame.by_actor(POSITION).items():
            assert told["actors"][id_]["location"] == pytest.approx(recorded[:3], rel=1e-5)
    assert info["frames"][-1]["actors"][cars[0].id]["velocity"] is not None
    short = client.show_recorder_file_info(str(path), False)
    assert f" Destroy {cars[1].id}\n" in short and "Positions" not in short


def crash(world: carla.World, has_sensor: bool) -> tuple[carla.Vehicle, carla.Vehicle]:
    """A hero that runs into a parked car."""
    place = world.get_map().get_spawn_points()[0]
    hero = spawn_car(world, role_name="hero")
    place.location += place.get_forward_vector() * 12.0
    parked = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), place)
    if has_sensor:
        sensor = world.get_blueprint_library().find("sensor.other.collision")
        world.spawn_actor(sensor, carla.Transform(), attach_to=hero)
    hero.apply_control(carla.VehicleControl(throttle=1.0))
    ticks(world, 80)
    return hero, parked


def test_a_contact_is_recorded_of_who_carries_a_collision_sensor(client, world, tmp_path):
    path = tmp_path / "col.log"
    client.start_recorder(str(path))
    hero, parked = crash(world, has_sensor=True)
    log = finished(client, path)
    contacts = {record[1:] for frame in log.frames for record in frame.records[COLLISION]}
    assert (hero.id, parked.id, 1, 0) in contacts
    text = client.show_recorder_collisions(str(path), "h", "v")
    rows = [line for line in text.split("\n") if "vehicle.audi.tt" in line]
    assert rows and rows[0][8:15] == "   v v " and rows[0].split()[3] == str(hero.id)
    assert "vehicle.audi.tt" not in client.show_recorder_collisions(str(path), "w", "a")
    blocked = client.show_recorder_actors_blocked(str(path), 1.0, 100.0)
    assert f" {parked.id} vehicle.audi.tt " in blocked


def test_a_contact_with_a_walker_has_its_letter(client, world, tmp_path):
    path = tmp_path / "walker.log"
    client.start_recorder(str(path))
    hero = spawn_car(world, role_name="hero")
    place = world.get_map().get_spawn_points()[0]
    place.location += place.get_forward_vector() * 12.0 + carla.Location(z=0.5)
    walker = world.spawn_actor(world.get_blueprint_library().find("walker.pedestrian.0005"), place)
    sensor = world.get_blueprint_library().find("sensor.other.collision")
    world.spawn_actor(sensor, carla.Transform(), attach_to=hero)
    hero.apply_control(carla.VehicleControl(throttle=1.0))
    ticks(world, 80)
    finished(client, path)
    for letters, is_told in (
        ("hw", True),
        ("vw", True),
        ("aa", True),
        ("wv", False),
        ("vv", False),
    ):
        text = client.show_recorder_collisions(str(path), *letters)
        rows = [line for line in text.splitlines() if "walker.pedestrian.0005" in line]
        assert bool(rows) == is_told, letters
        if rows:
            assert rows[0][8:15] == "   v w " and int(rows[0].split()[3]) == hero.id
            assert int(rows[0].split()[5]) == walker.id


def test_a_contact_with_a_thing_has_the_letter_of_others(client, world, tmp_path):
    path = tmp_path / "thing.log"
    client.start_recorder(str(path))
    hero = spawn_car(world, role_name="hero")
    place = world.get_map().get_spawn_points()[0]
    place.location += place.get_forward_vector() * 12.0
    library = world.get_blueprint_library()
    thing = world.spawn_actor(library.find("static.prop.container"), place)
    world.spawn_actor(library.find("sensor.other.collision"), carla.Transform(), attach_to=hero)
    hero.apply_control(carla.VehicleControl(throttle=1.0))
    ticks(world, 80)
    finished(client, path)
    for letters, is_told in (("vo", True), ("ho", True), ("vt", False), ("vv", False)):
        text = client.show_recorder_collisions(str(path), *letters)
        rows = [line for line in text.splitlines() if "static.prop.container" in line]
        assert bool(rows) == is_told, letters
        if rows:
            assert rows[0][8:15] == "   v o " and int(rows[0].split()[5]) == thing.id


def test_without_a_collision_sensor_nothing_is_recorded_of_a_contact(client, world, tmp_path):
    path = tmp_path / "col.log"
    client.start_recorder(str(path))
    crash(world, has_sensor=False)
    assert not any(frame.records[COLLISION] for frame in finished(client, path).frames)


def test_a_second_recording_ends_the_first_and_a_stop_too_many_is_harmless(client, world, tmp_path):
    client.stop_recorder()
    first, second = tmp_path / "1.log", tmp_path / "2.log"
    client.start_recorder(str(first))
    ticks(world, 5)
    client.start_recorder(str(second))
    ticks(world, 3)
    # Questions wait until a recording that has ended is written.
    assert "\nFrames: 5\n" in client.show_recorder_file_info(str(first), False)
    assert len(carla_log.read(first).frames) == 5
    assert len(finished(client, second).frames) == 3
    client.stop_recorder()


def test_files_that_are_missing_foreign_or_elsewhere_are_told_apart(client, world, tmp_path):
    missing, foreign = tmp_path / "missing.log", tmp_path / "foreign.log"
    foreign.write_text("notes of somebody")
    for ask in (
        lambda name: client.show_recorder_file_info(name, True),
        lambda name: client.show_recorder_collisions(name, "a", "a"),
        lambda name: client.show_recorder_actors_blocked(name, 30, 10),
    ):
        assert ask(str(missing)) == f"File {missing} not found on server\n"
        assert ask(str(foreign)) == "File is not a CARLA recorder\n"
    replayed = client.replay_file(str(missing), 0, 0, 0)
    assert replayed == f"Replaying File: {missing}\nFile {missing} not found on server\n"
    with pytest.raises(RuntimeError, match="neither"):
        client.start_recorder(str(foreign))
    assert foreign.read_text() == "notes of somebody"
    with pytest.raises(RuntimeError, match="Windows"):
        client.start_recorder("c:\\records\\r.log")
    with pytest.raises(RuntimeError, match="wanted a recording in"):
        client.start_recorder("../other-tenant/r.log")


def test_a_log_may_be_named_after_the_time(client, world, tmp_path):
    name = tmp_path / "recording_2026-11-28 05:15:19.log"
    assert client.start_recorder(str(name)) == str(name)
    ticks(world, 3)
    assert len(finished(client, name).frames) == 3


def test_a_log_that_is_cut_is_told_and_replayed_up_to_its_last_whole_frame(client, world, tmp_path):
    path, cut = tmp_path / "whole.log", tmp_path / "cut.log"
    client.start_recorder(str(path))
    car = spawn_car(world)
    ticks(world, 30)
    finished(client, path)
    car.destroy()
    world.tick()
    cut.write_bytes(path.read_bytes()[:-100])
    assert "\nFrames: 29\n" in client.show_recorder_file_info(str(cut), True)
    text = client.replay_file(str(cut), 0.0, 0.0, 0)
    assert f"Total time recorded: {28 * STEP_SECS:.6g}\n" in text
    ticks(world, 5)
    assert world.get_actor(car.id) is not None


def test_a_log_of_a_map_that_nobody_has_is_refused_and_changes_nothing(client, world, tmp_path):
    path, elsewhere = tmp_path / "here.log", tmp_path / "elsewhere.log"
    client.start_recorder(str(path))
    ticks(world, 3)
    finished(client, path)
    elsewhere.write_bytes(path.read_bytes().replace(b"Town10HD_Opt", b"Town99XY_Opt", 1))
    before = world.id
    text = client.replay_file(str(elsewhere), 0.0, 0.0, 0)
    assert text == f"Replaying File: {elsewhere}\nCould not load mapfile Town99XY_Opt\n"
    assert client.get_world().id == before


def test_two_endpoints_do_not_record_to_one_file(start_site, tmp_path):
    ports = [two_free_ports(), two_free_ports()]
    endpoints = ",".join(map(str, ports))
    start_site("--no-render", "--carla", endpoints, "--recordings", str(tmp_path / "kept"))
    first, second = map(connect, ports)
    path = first.start_recorder("one.log")
    with pytest.raises(RuntimeError, match="nobody records to"):
        second.start_recorder("one.log")
    first.stop_recorder()
    first.show_recorder_file_info("one.log", False)
    assert second.start_recorder("one.log") == path


# Records until it is killed.
RECORDING = """
import sys
import carla

client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(60.0)
print(client.start_recorder("killed.log"), flush=True)
world = client.get_world()
while True:
    world.wait_for_tick()
"""


@pytest.mark.parametrize("victim", ["client", "gateway"])
def test_whoever_is_killed_leaves_a_whole_log(start_site, victim):
    site = start_site("--no-render")
    command = [sys.executable, "-c", RECORDING, str(site.carla_port)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as recording:
        try:
            path = Path(recording.stdout.readline().strip())
            wait_for_frames(path, 10)
            killed = recording.pid if victim == "client" else child(site, "gateway")
            os.kill(killed, signal.SIGKILL)
        finally:
            recording.kill()
    if victim == "client":
        # Nobody ticks an endpoint without clients: the next one ends the recording.
        client = connect(site.carla_port)
        client.stop_recorder()
        client.show_recorder_file_info("killed.log", False)
        log = carla_log.read(path)
        assert log.frames[-1].duration == -1.0
        assert [frame.number for frame in log.frames] == list(range(1, len(log.frames) + 1))
    # At most the frame that was being written is cut, and told so.
    told = frames_told(path)
    assert told.returncode == 0 or "the recording ends at" in told.stderr
    assert frame_count(told) >= 10


def frames_told(path: Path) -> subprocess.CompletedProcess:
    command = [binary(), "record", "info", path]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def frame_count(told: subprocess.CompletedProcess) -> int:
    return int(told.stdout.split("\nFrames: ")[1].split()[0]) if told.stdout else 0


def wait_for_frames(path: Path, count: int) -> None:
    deadline = time.monotonic() + 60.0
    while frame_count(frames_told(path)) < count:
        assert time.monotonic() < deadline, "no frames are written"
        time.sleep(0.05)


def test_a_client_records_traffic_asks_and_replays_without_being_synchronous(start_site, tmp_path):
    site = start_site("--no-render", "--recordings", str(tmp_path / "kept"))
    session = Path(__file__).parent / "recording_session.py"
    ports = [str(site.carla_port), str(two_free_ports())]
    command = [sys.executable, session, *ports, "test1.log"]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert run.returncode == 0, run.stderr[-2000:]
    told = json.loads(run.stdout.splitlines()[-1])
    assert told["path"] == str(tmp_path / "kept" / "local" / "test1.log")
    assert len(told["cars"]) == 10
    log = carla_log.read(Path(told["path"]))
    total = f"{log.frames[-1].elapsed:.6g}"
    for car in told["cars"]:
        assert f" Create {car}: vehicle." in told["info"] and f" Destroy {car}\n" in told["info"]
    for text in (told["info"], told["all"], told["blocked"]):
        assert text.endswith(f"\nFrames: {len(log.frames)}\nDuration: {total} seconds\n")
    assert told["all"].count("\n Positions: ") == len(log.frames)
    assert told["collisions"].split("\n")[4].startswith("    Time  Types     Id Actor 1   ")
    replay = told["replay"]
    assert f"Replaying from 1 s - {total} s ({total} s) at 2.0x\n" in replay["text"]
    assert replay["most"] == 10 and replay["left"] == 0
    assert any(abs(height - 40.0) < 1.0 for height in replay["heights"])
