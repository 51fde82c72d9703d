"""What a journal beside a recording gives: replays to the bit, branches, exports."""

import base64
import io
import itertools
import json
import math
import queue
import struct
import subprocess
from pathlib import Path

import carla
import causeway
import causeway.frames
import pytest
from mcap.reader import make_reader
from PIL import Image

import carla_log
from carla_log import POSITION
from carla_site import STEP_SECS, attach, spawn_car, synchronous, ticks
from driving import act, session
from recorded_drive import drive, finished, seen
from running_site import Site, binary

TICKS = 60


def record(*arguments: object) -> subprocess.CompletedProcess:
    command = [binary(), "record", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def told(*arguments: object) -> str:
    done = record(*arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def folder(site: Site) -> Path:
    return site.log.parent / "recordings" / "local"


@pytest.fixture
def recorded(client, world, site):
    """A log with its journal, its content and two cars that go on driving."""
    client.start_recorder("exact.log", True)
    cars = drive(world)
    ticks(world, TICKS // 2)
    guest = spawn_car(world, 9)
    ticks(world, TICKS // 4)
    guest.destroy()
    ticks(world, TICKS - TICKS // 2 - TICKS // 4)
    path = folder(site) / "exact.log"
    return path, finished(client, path), cars


def test_a_log_is_replayed_to_the_bit_and_a_changed_one_is_not(recorded, tmp_path):
    path, log, _ = recorded
    said = told("replay", path)
    assert f"{TICKS} frames, 0 differences" in said and "the same to the bit" in said
    assert "0 differences" not in told("verify", path)
    listed = told("list", path.parent)
    assert "exact.log  log" in listed and "exact.log.journal  journal" in listed
    # The hash in the packet of the fourth frame from the end.
    changed = bytearray(path.read_bytes())
    at = -1
    for _ in range(4):
        at = changed.rindex(b"CWJL", 0, at)
    changed[at + 12] ^= 1
    other = tmp_path / "changed.log"
    other.write_bytes(changed)
    done = record("replay", other, "--journal", f"{path}.journal")
    assert done.returncode == 1 and "state hash of the log" in done.stderr
    # A log whose journal does not lie beside it, and a file that is neither.
    for wrong, why in ((other, "cannot be opened"), (binary(), "neither")):
        done = record("replay", wrong)
        assert done.returncode == 1 and why in done.stderr
    assert [frame.number for frame in log.frames] == list(range(1, TICKS + 1))


def test_pieces_are_logs_and_journals_of_their_own(recorded, tmp_path):
    path, log, cars = recorded
    part, journal = tmp_path / "part.log", tmp_path / "part.journal"
    assert "21 frames" in told("cut", path, "--from", 1, "--until", 2, "--to", part)
    piece = carla_log.read(part)
    assert [frame.number for frame in piece.frames] == list(range(1, 22))
    assert piece.frames[0].elapsed == 0.0 and piece.frames[-1].duration == -1.0
    for ours, whole in zip(piece.frames, log.frames[20:], strict=False):
        assert ours.by_actor(POSITION)[cars[0].id] == whole.by_actor(POSITION)[cars[0].id]
    assert {record[0] for record in piece.frames[0].records[carla_log.ADD]} >= {
        car.id for car in cars
    }
    told("cut", f"{path}.journal", "--from", 1, "--until", 2, "--to", journal)
    assert "the same to the bit" in told("verify", journal)
    again = record("cut", path, "--to", part)
    assert again.returncode == 1 and "exists" in again.stderr
    late = record("cut", path, "--from", 1000, "--to", tmp_path / "late.log")
    assert late.returncode == 1 and not (tmp_path / "late.log").exists()


def test_stop_replayer_goes_on_in_the_recorded_world(client, world, recorded):
    path, log, cars = recorded
    hero = cars[0]
    places = []
    for _ in range(2):
        # From the middle on: the replay shows frame 31, the branch goes on from there.
        client.replay_file(str(path), 30 * STEP_SECS, 0.0, 0)
        ticks(world, 1)
        client.stop_replayer(True)
        snapshot = seen(world, world.tick())
        place = log.frames[32].by_actor(POSITION)[hero.id]
        here = snapshot[hero.id].location
        # Commands and drivers are those of the recording: so is the next tick.
        assert math.dist(place[:2], (here.x * 100, here.y * 100)) < 1.0
        assert hero.get_velocity().length() > 2.0
        # The client sends a control only when it differs from the one before.
        hero.apply_control(carla.VehicleControl(brake=0.5))
        hero.apply_control(carla.VehicleControl(brake=1.0))
        ticks(world, 80)
        here = hero.get_location()
        places.append((here.x, here.y, here.z))
        assert hero.get_velocity().length() < 0.5
    assert places[0] == places[1]


def test_sensors_measure_in_the_recorded_world(client, world, site):
    car = spawn_car(world)
    _, measured = attach(world, car, "sensor.other.imu")
    client.start_recorder("sensors.log")
    ticks(world, 20)
    finished(client, folder(site) / "sensors.log")
    client.replay_file("sensors.log", 0.5, 0.0, 0)
    ticks(world, 1)
    client.stop_replayer(True)
    frame = ticks(world, 3)
    # What was measured before may still be on its way: the newest frame must come.
    while measured.get(timeout=30.0).frame < frame:
        pass


def test_a_fresh_world_becomes_the_recorded_one(client, recorded):
    path, _, cars = recorded
    names = {car.id: car.type_id for car in cars}
    client.load_world("Town10HD_Opt")
    with synchronous(client.get_world()) as world:
        client.replay_file(str(path), 1.0, 0.0, 0)
        ticks(world, 2)
        found = {car.id: car.type_id for car in world.get_actors().filter("vehicle.*")}
        assert found == names
        client.stop_replayer(True)
        ticks(world, 2)
        assert {car.id for car in world.get_actors().filter("vehicle.*")} == names.keys()


def test_a_session_begins_at_a_tick_of_a_journal(recorded, site):
    path, *_ = recorded
    name = f"{path.name}.journal"
    with make_mcap(path) as messages:
        frames = messages["/causeway/frame"]
    tick = causeway.frames.decode(frames[30]).tick
    ends = []
    with causeway.Session(site.base_url) as session:
        for _ in range(2):
            config = {"recording": name, "recording_tick": tick}
            session.reset("free_roam", scenario_config=config, seed=1)
            step = session.step("control", throttle=0.0, brake=1.0)
            ends.append(step.observation["speed_kmh"])
        assert ends[0] == ends[1] > 1.0
        for wrong in ({"recording_tick": 10_000_000}, {"recording_ego": 4_000_000}):
            with pytest.raises(Exception, match=r"tick|vehicle"):
                session.reset("free_roam", scenario_config={"recording": name, **wrong}, seed=1)
        with pytest.raises(Exception, match="journal"):
            session.reset("free_roam", scenario_config={"recording": "no.journal"}, seed=1)


class make_mcap:
    """What an export of a journal holds, by topic."""

    def __init__(self, path: Path, *flags: object) -> None:
        self.out = path.with_suffix(".mcap")
        self.out.unlink(missing_ok=True)
        told("export", f"{path}.journal", "--to", self.out, *flags)

    def __enter__(self) -> dict[str, list[bytes]]:
        messages: dict[str, list[bytes]] = {}
        with self.out.open("rb") as file:
            for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
                messages.setdefault(channel.topic, []).append(message.data)
        return messages

    def __exit__(self, *_: object) -> None:
        self.out.unlink()


def test_an_export_says_what_the_recording_says(recorded, tmp_path):
    path, log, cars = recorded
    out = tmp_path / "drive.mcap"
    assert f"{TICKS} frames" in told("export", f"{path}.journal", "--to", out, "--ego", cars[0].id)
    with out.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        topics = {channel.topic: channel for channel in summary.channels.values()}
        schemas = {schema.name: schema for schema in summary.schemas.values()}
        about = next(one for one in reader.iter_metadata() if "exact" in one.metadata)
        xodr = next(one for one in reader.iter_attachments() if one.name.endswith(".xodr"))
        messages: dict[str, list] = {}
        for _, channel, message in reader.iter_messages(log_time_order=True):
            content = (
                json.loads(message.data) if channel.message_encoding == "json" else message.data
            )
            messages.setdefault(channel.topic, []).append((message.log_time, content))
    assert summary.statistics.message_count == sum(map(len, messages.values()))
    assert {
        "/tf",
        "/map",
        "/actors",
        "/ego/odometry",
        "/events",
        "/causeway/frame",
    } <= topics.keys()
    assert schemas["foxglove.SceneUpdate"].encoding == "jsonschema"
    assert about.metadata["exact"] == "true" and about.metadata["map"] == "Town10HD_Opt"
    assert xodr.data.startswith(b"<?xml")
    poses, frames = messages["/ego/pose"], messages["/causeway/frame"]
    assert len(poses) == len(frames) == TICKS
    times = [time for time, _ in frames]
    assert [b - a for a, b in itertools.pairwise(times)] == pytest.approx(
        [STEP_SECS * 1e9] * (TICKS - 1), abs=2
    )
    for (_, pose), (_, data), frame in zip(poses, frames, log.frames, strict=True):
        x, y, z, *_ = frame.by_actor(POSITION)[cars[0].id]
        place = pose["pose"]["position"]
        assert (place["x"], -place["y"], place["z"]) == pytest.approx(
            (x / 100, y / 100, z / 100), abs=0.01
        )
        actors = causeway.frames.decode(data).actors
        (state,) = actors[actors["id"] == cars[0].id]
        assert state["world_from_actor"]["position_m"][0] == pytest.approx(place["x"], abs=1e-5)
    drawn = {entity["id"] for _, update in messages["/actors"] for entity in update["entities"]}
    assert {str(car.id) for car in cars} <= drawn
    happened = [line["name"] for _, line in messages["/events"]]
    assert [name for name in happened if name != "collision"] == ["spawned", "destroyed"]
    (drawn,) = messages["/map"]
    assert any(entity["lines"] for entity in drawn[1]["entities"])


def test_a_log_without_a_journal_is_exported_from_its_poses(recorded, tmp_path):
    path, log, cars = recorded
    out = tmp_path / "log.mcap"
    told("export", path, "--to", out, "--ego", cars[1].id, "--every", 2)
    with out.open("rb") as file:
        poses = [
            json.loads(message.data)["pose"]["position"]
            for *_, message in make_reader(file).iter_messages(topics=["/ego/pose"])
        ]
    wanted = [frame.by_actor(POSITION)[cars[1].id] for frame in log.frames[::2]]
    assert len(poses) == len(wanted)
    for place, (x, y, *_) in zip(poses, wanted, strict=True):
        assert (place["x"], -place["y"]) == pytest.approx((x / 100, y / 100), abs=1e-3)


def test_pictures_are_drawn_and_sensors_measure_again(client, world, site, tmp_path):
    car = spawn_car(world, role_name="hero")
    lidar, scans = attach(world, car, "sensor.lidar.ray_cast", points_per_second="20000")
    imu, jolts = attach(world, car, "sensor.other.imu")
    library = world.get_blueprint_library()
    depth = library.find("sensor.camera.depth")
    depth.set_attribute("image_size_x", "64")
    depth.set_attribute("image_size_y", "32")
    ahead = carla.Transform(carla.Location(x=2.5, z=1.2))
    camera = world.spawn_actor(depth, ahead, attach_to=car)
    client.start_recorder("seen.log")
    car.apply_control(carla.VehicleControl(throttle=0.7))
    frames = [world.tick() for _ in range(20)]
    finished(client, folder(site) / "seen.log")
    wanted = {"scan": by_frame(scans, frames), "jolt": by_frame(jolts, frames)}
    flags = ("--camera", "chase", "--camera", "top", "--camera", camera.id, "--sensors")
    more = ("--picture-size", "160x90", "--every", 10)
    with make_mcap(folder(site) / "seen.log", *flags, *more) as messages:
        told_of = {
            topic: [json.loads(data) for data in all_data]
            for topic, all_data in messages.items()
            if topic != "/causeway/frame"
        }
    for name in ("chase", "top"):
        assert len(told_of[f"/ego/{name}/image"]) == 2
        for message in told_of[f"/ego/{name}/image"]:
            assert message["format"] == "jpeg"
            with Image.open(io.BytesIO(base64.b64decode(message["data"]))) as picture:
                assert picture.size == (160, 90)
                assert max(high - low for low, high in picture.getextrema()) > 60
        calibration = told_of[f"/ego/{name}/calibration"][0]
        assert calibration["K"][0] == pytest.approx(80.0)
    (picture, _) = told_of[f"/cameras/{camera.id}/image"]
    assert (picture["encoding"], picture["width"], picture["step"]) == ("32FC1", 64, 256)
    depths = struct.unpack(f"<{64 * 32}f", base64.b64decode(picture["data"]))
    assert 0.5 < min(depths) < 60.0
    told_tf = [*told_of["/tf"], *told_of["/tf_static"]]
    children = {one["child_frame_id"] for tf in told_tf for one in tf["transforms"]}
    assert {"ego", "ego/chase_optical", f"ego/lidar/{lidar.id}"} <= children

    points = told_of[f"/ego/lidar/{lidar.id}/points"]
    assert len(points) == len(frames)
    for message, scan in zip(points, wanted["scan"], strict=True):
        ours = struct.iter_unpack("<4f", base64.b64decode(message["data"]))
        theirs = struct.iter_unpack("<4f", bytes(scan.raw_data))
        assert [(x, -y, z, i) for x, y, z, i in ours] == list(theirs)
    inertia = told_of[f"/ego/imu/{imu.id}/inertia"]
    for message, jolt in zip(inertia, wanted["jolt"], strict=True):
        assert message["acceleration_mps2"]["z"] == pytest.approx(jolt.accelerometer.z, abs=1e-4)


def by_frame(measured: queue.Queue, frames: list[int]) -> list[carla.SensorData]:
    """What a sensor measured in these frames, which follow one another."""
    found = {}
    while len(found) < len(frames):
        one = measured.get(timeout=60.0)
        if one.frame in frames:
            found[one.frame] = one
    return [found[frame] for frame in frames]


def test_what_only_a_journal_has_is_not_exported_of_a_log(recorded, tmp_path):
    path, *_ = recorded
    for flags in (("--sensors",), ("--camera", "12")):
        done = record("export", path, "--to", tmp_path / "no.mcap", *flags)
        assert done.returncode == 1 and "wanted a journal" in done.stderr
    done = record("export", f"{path}.journal", "--to", tmp_path / "no.mcap", "--camera", 4_000_000)
    assert done.returncode == 1 and "no camera" in done.stderr
    assert not (tmp_path / "no.mcap").exists()


def test_pictures_of_a_log_are_drawn_from_its_poses(recorded, tmp_path):
    path, _, cars = recorded
    out = tmp_path / "log.mcap"
    flags = ("--camera", "driver", "--picture-size", "64x36", "--every", 30, "--ego", cars[0].id)
    told("export", path, "--to", out, *flags)
    with out.open("rb") as file:
        images = list(make_reader(file).iter_messages(topics=["/ego/driver/image"]))
    assert len(images) == TICKS // 30


def test_a_journal_is_asked_as_a_log_is(recorded):
    path, *_ = recorded
    # Who stands somewhere for half a second: those who wait to set off do.
    asked = [
        told("blocked", name, "--time", 0.5, "--distance", 100)
        for name in (path, f"{path}.journal")
    ]
    rows = [[line for line in text.splitlines() if "vehicle." in line] for text in asked]
    assert rows[0] and rows[0] == rows[1]
    assert all(f"\nFrames: {TICKS}\n" in text for text in asked)


def test_a_session_hits_those_whom_its_recording_has(start_site):
    site = start_site("--no-render")
    at = ("--connect", site.endpoint)
    with session(site.base_url) as env:
        name = "trolley_micro_classic_5v1"
        env.reset(scenario_name=name, scenario_config={"aftermath_ticks": 100}, seed=2)
        (world,) = told("worlds", *at).splitlines()
        number = world.split()[0]
        journal = told("start", "--world", number, *at).split()[0]
        while not act(env).done:
            pass
        for _ in range(20):
            result = act(env)
        told("stop", "--world", number, *at)
        outcome = result.observation.metadata["outcome"]
    path = site.log.parent / "recordings" / journal
    rows = told("collisions", path, "--types", "vw").splitlines()
    hit = {row.split()[5] for row in rows if " walker.pedestrian." in row}
    assert len(hit) == outcome["actual_pedestrians_hit"] >= 3
