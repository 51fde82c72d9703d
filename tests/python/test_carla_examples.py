"""The examples over CARLA's own client do what they say, each run as a user runs it."""

import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import carla
import numpy as np
import pytest
from PIL import Image
from plyfile import PlyData

from carla_example import EXAMPLES, LIMIT_SECS, PROGRAMS, environment, run, started
from running_site import two_free_ports

#: From the start of the process to the first metre; beside much other work it took 3 s.
DRIVES_SECS = 30.0

#: What both rays and pictures show.
WALLS_AND_GROUND = (
    carla.CityObjectLabel.Buildings,
    carla.CityObjectLabel.Roads,
    carla.CityObjectLabel.Sidewalks,
)


@pytest.mark.parametrize("name", PROGRAMS)
def test_an_example_tells_its_options_without_the_client(name):
    without = "import runpy, sys; sys.modules['carla'] = None; sys.argv = sys.argv[1:]"
    program = f"{without}; sys.path.insert(0, {str(EXAMPLES)!r})"
    program += "; runpy.run_path(sys.argv[0], run_name='__main__')"
    told = subprocess.run(
        [sys.executable, "-c", program, str(EXAMPLES / name), "--help"],
        env=environment(CARLA_HOST="there", CARLA_PORT="2345", COLUMNS="200"),
        capture_output=True,
        text=True,
        timeout=LIMIT_SECS,
    )
    assert told.returncode == 0, told.stderr
    for option in ("--host", "--port", "--verbose", "default: there", "default: 2345"):
        assert option in told.stdout


# The client library ends some runs of client_example here in its clean-up, with a server just up.
@pytest.mark.parametrize("name", sorted(set(PROGRAMS) - {"client_example.py"}))
def test_an_example_waits_for_a_server_that_starts_later(name, start_site, tmp_path):
    port = two_free_ports()
    where = {"CARLA_HOST": "127.0.0.1", "CARLA_PORT": str(port)}
    with started(tmp_path, name, *PROGRAMS[name], **where) as process:
        for _ in range(2):
            said = process.stdout.readline()
            assert said.startswith(f"127.0.0.1:{port}: ") and "trying again" in said
        start_site("--carla", str(port))
        said, _ = process.communicate()
        assert process.returncode == 0, said


def png_names(folder: Path) -> list[str]:
    for path in folder.glob("*.png"):
        with Image.open(path) as picture:
            assert (picture.format, picture.size) == ("PNG", (400, 300))
    return sorted(path.name for path in folder.iterdir())


def test_the_client_example_drives_and_saves_every_picture(site, client, tmp_path):
    options = ("-a", "-i", "-q", "Low", "--episodes", 1, "--frames", 30, "--seed", 1)
    ran = run(site, tmp_path, "client_example.py", *options)
    assert ran.status == 0, ran.err
    folder = tmp_path / "_out" / "episode_0000"
    wanted = [f"{frame:06}.png" for frame in range(30)]
    assert png_names(folder / "CameraRGB") == png_names(folder / "CameraDepth") == wanted
    assert {path.name for path in folder.iterdir()} == {"CameraRGB", "CameraDepth"}
    places = ran.numbers(r"vehicle at \((\S+), (\S+)\)")
    assert len(places) == 30
    assert np.hypot(*np.subtract(places[-1], places[0])) > 5.0
    # The road is near, the sky far.
    depth = np.asarray(Image.open(folder / "CameraDepth" / wanted[-1]).convert("RGB"), float)
    depth_m = depth @ [1.0, 256.0, 65536.0] * 1000.0 / (2**24 - 1)
    assert depth_m[0].max() > 100.0 and depth_m[-1].max() < 20.0


def test_the_autopilot_drives_for_most_of_a_minute(site, client, tmp_path):
    file = tmp_path / "none.ini"
    file.write_text("[CARLA/LevelSettings]\nNumberOfVehicles=20\nNumberOfPedestrians=0\n")
    options = ("-a", "-c", file, "--episodes", 1, "--frames", 600, "--seed", 3)
    ran = run(site, tmp_path, "client_example.py", *options)
    assert ran.status == 0, ran.err
    told = ran.numbers(r"\), (\S+) km/h, collisions: vehicles (\S+),")
    speeds_kmh = [speed for speed, _ in told]
    assert len(speeds_kmh) == 600, "a minute of frames of 0.1 s"
    drives = sum(speed > 0.0 for speed in speeds_kmh) / len(speeds_kmh)
    print(f"drives {100 * drives:.0f} % of the time")
    # It waits at red lights, up to 19 s at one.
    assert drives > 0.5


def test_a_car_drives_as_soon_as_the_map_is_there(start_site):
    port = two_free_ports()
    begun = time.monotonic()
    start_site("--carla", str(port))
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(LIMIT_SECS)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    start = world.get_map().get_spawn_points()[0]
    vehicle = world.spawn_actor(blueprint, start)
    vehicle.apply_control(carla.VehicleControl(throttle=1.0))
    while (
        world.wait_for_tick().find(vehicle.id).get_transform().location.distance(start.location)
        < 1.0
    ):
        assert time.monotonic() - begun < DRIVES_SECS
    print(f"the first metre was driven {time.monotonic() - begun:.2f} s after the process began")


def test_the_same_seed_measures_the_same(site, client, tmp_path):
    options = ("-q", "Low", "--episodes", 2, "--frames", 6, "--seed", 7)
    first, second = (run(site, tmp_path, "client_example.py", *options) for _ in range(2))
    assert (first.status, second.status) == (0, 0), first.err + second.err
    assert len(first.numbers(r"vehicle at \((\S+), (\S+)\)")) == 12
    assert first.out == second.out
    assert not list(tmp_path.iterdir()), "nothing is saved unless asked"


SETTINGS = """
[CARLA/LevelSettings]
NumberOfVehicles=3
NumberOfPedestrians=0
WeatherId=6
PlayerVehicle=/Game/Mustang
[CARLA/Sensor]
Sensors=Front,Turning
SensorType=CAMERA
[CARLA/Sensor/Front]
PostProcessing=SemanticSegmentation
ImageSizeX=200
ImageSizeY=100
PositionZ=2.0 ; on the roof
[CARLA/Sensor/Turning]
SensorType=LIDAR_RAY_CAST
Channels=8
PointsPerSecond=5000
RotationFrequency=10
"""


def test_the_client_example_reads_settings_of_the_old_client(site, client, tmp_path):
    file = tmp_path / "CarlaSettings.ini"
    file.write_text(SETTINGS)
    options = ("-c", file, "-i", "-v", "--episodes", 1, "--frames", 2, "--out", "saved")
    ran = run(site, tmp_path, "client_example.py", *options)
    assert ran.status == 0, ran.err
    assert "HardRainNoon, 3 cars, 0 walkers" in ran.err
    assert "playervehicle of [CARLA/LevelSettings] is not known" in ran.err
    folder = tmp_path / "saved" / "episode_0000"
    with Image.open(folder / "Front" / "000001.png") as picture:
        assert picture.size == (200, 100)
    assert (folder / "Turning" / "000001.ply").read_bytes().startswith(b"ply\n")


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ("NumberOfVehicles=many", "numberofvehicles=many is not a number"),
        ("WeatherId=15", "weatherid=15 is out of range"),
        ("[CARLA/Sensor]\nSensors=A", "no section [CARLA/Sensor/A]"),
        ("[CARLA/Sensor/", "contains no section headers|parsing errors"),
    ],
)
def test_wrong_settings_are_named(site, tmp_path, wrong, told):
    file = tmp_path / "wrong.ini"
    file.write_text(f"[CARLA/LevelSettings]\n{wrong}\n")
    ran = run(site, tmp_path, "client_example.py", "-c", file)
    assert ran.status == 1 and "Traceback" not in ran.err
    assert any(part in ran.err for part in told.split("|")), ran.err


def test_an_interrupted_example_clears_up(site, client, tmp_path):
    at = ("--port", site.carla_port)
    with started(tmp_path, "client_example.py", *at, "-a", "-q", "Low") as process:
        for line in process.stdout:
            if line.startswith("vehicle at"):
                break
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate()
        assert process.returncode == 130, said
        assert said.endswith("cancelled\n") and "Traceback" not in said
    world = client.get_world()
    assert not world.get_settings().synchronous_mode
    assert not world.get_settings().fixed_delta_seconds
    # A frame from before may have been the newest.
    world.wait_for_tick()
    kinds = {one.type_id.split(".")[0] for one in world.get_actors()}
    assert not kinds & {"vehicle", "walker", "sensor", "controller"}


def test_a_point_cloud_is_what_rays_hit(site, client, tmp_path):
    world = client.get_world()
    options = ("--frames", 2, "-i", "--seed", 5, "--max-depth", 150)
    ran = run(site, tmp_path, "point_cloud_example.py", *options)
    assert ran.status == 0, ran.err
    assert sorted(path.name for path in (tmp_path / "_out").glob("*.ply")) == [
        "00000.ply",
        "00001.ply",
    ]
    cloud = PlyData.read(tmp_path / "_out" / "00001.ply")
    (camera,) = [text.split()[1:] for text in cloud.comments if text.startswith("camera ")]
    eye_m = np.array(camera, float)
    vertices = cloud["vertex"]
    points_m = np.stack([vertices[name] for name in "xyz"], axis=1).astype(float)
    with Image.open(tmp_path / "_out" / "CameraRGB" / "00001.png") as picture:
        seen = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    last = [vertices[name][-1] for name in ("red", "green", "blue")]
    assert list(seen[-1]) == last, "the last point is the last pixel"
    wrong_m = []
    for point_m in points_m[::997]:
        way_m = point_m - eye_m
        far_m = float(np.linalg.norm(way_m))
        hit = world.project_point(carla.Location(*eye_m), carla.Vector3D(*(way_m / far_m)), 100.0)
        if hit and hit.label in WALLS_AND_GROUND and far_m < 50.0:
            there = hit.location
            wrong_m.append(far_m - np.linalg.norm([there.x, there.y, there.z] - eye_m))
    wrong_m = np.abs(wrong_m)
    assert len(wrong_m) > 300
    # Lights and signs stand in pictures only.
    seen_by_both = wrong_m[wrong_m < 0.15]
    assert len(seen_by_both) > 0.95 * len(wrong_m)
    # Paint lies 15 mm above the road in pictures, most others agree to a fraction of that.
    assert np.sqrt(np.mean(seen_by_both**2)) < 0.05
    assert np.median(seen_by_both) < 0.002


def test_start_positions_are_drawn_with_their_numbers(site, client, tmp_path):
    count = len(client.get_world().get_map().get_spawn_points())
    ran = run(site, tmp_path, "view_start_positions.py", "--out", "all.svg")
    assert ran.status == 0, ran.err
    drawn = (tmp_path / "all.svg").read_text()
    assert drawn.count('<g id="start">') == drawn.count('<g id="number">') == count
    # Letters are outlines; matplotlib says in comments which text they are.
    assert {f"<!-- {number} -->" for number in range(count)} <= set(re.findall("<!--.*-->", drawn))

    two = ("--positions", "0,1", "--no-labels", "--out", "two.png")
    assert run(site, tmp_path, "view_start_positions.py", *two).status == 0
    with Image.open(tmp_path / "two.png") as picture:
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    red = (colours == [0xC0, 0x39, 0x2B]).all(axis=1).sum()
    assert 100 < red < 2000, "two small circles and where they look"


@pytest.mark.parametrize(
    ("wanted", "told"), [("0,9999", "no start position 9999"), ("first", "'first' is not a number")]
)
def test_start_positions_that_are_not_there_are_named(site, client, tmp_path, wanted, told):
    ran = run(site, tmp_path, "view_start_positions.py", "-pos", wanted)
    assert ran.status == 1 and told in ran.err and "Traceback" not in ran.err
    assert not list(tmp_path.iterdir())


def test_an_incident_is_found_replayed_and_avoided(site, client, tmp_path):
    ran = run(site, tmp_path, "incident.py", "--out", "pictures")
    assert ran.status == 0, ran.err
    ((_, secs),) = ran.numbers(r"actor (\d+) meets the parked car after ([\d.]+) s")
    gap_m = float(re.findall(r"stands ([\d.]+) m from", ran.out)[0])
    # Two cars that touch are about 4.5 m apart.
    assert 1.0 < secs < 6.0 and gap_m > 5.5
    brightness = []
    for name in ("before", "contact", "braked"):
        with Image.open(tmp_path / "pictures" / f"{name}.jpg") as picture:
            assert picture.size == (480, 270)
            brightness.append(np.asarray(picture.convert("L"), float))
        assert (tmp_path / "pictures" / f"{name}.jpg").stat().st_size < 100_000
    assert all(np.ptp(one) > 100 for one in brightness)
    assert np.abs(brightness[0] - brightness[1]).mean() > 2.0


def test_keys_drive_the_car(site, client, tmp_path):
    """Every key that does something, in a window without a screen."""
    options = ("--res", "320x180", "--seed", 1, "-q", "Low")

    def place(keys: str, *more: object) -> tuple[float, ...]:
        ran = run(site, tmp_path, "manual_control.py", *options, "--keys", keys, *more)
        assert ran.status == 0, ran.err
        return ran.numbers(r"the car is at \((\S+), (\S+)\)")[0]

    start = place("x*10")
    ahead = place("w*60", "--save", "window.png")
    assert np.hypot(*np.subtract(ahead, start)) > 5.0
    with Image.open(tmp_path / "window.png") as picture:
        assert picture.size == (320, 180)
        colours = np.asarray(picture.convert("RGB")).reshape(-1, 3)
        assert len(np.unique(colours, axis=0)) > 500
    back = np.subtract(place("q w*60"), start)
    assert back @ np.subtract(ahead, start) < 0.0
    assert np.hypot(*np.subtract(place("space+w*20"), start)) < 1.0
    left = np.subtract(place("w*30 w+left*15"), start)
    right = np.subtract(place("w*30 w+right*15"), start)
    assert abs(left[0] * right[1] - left[1] * right[0]) > 1.0
    assert np.hypot(*np.subtract(place("r x*5"), start)) > 5.0
    place("c tab down+s*2 p w*3 p d*2 esc x*999999", "-l")


@pytest.mark.parametrize("keys", ["w*many", "ctrl*3", "w+*2"])
def test_keys_that_are_not_there_are_named(site, tmp_path, keys):
    ran = run(site, tmp_path, "manual_control.py", "--keys", keys)
    assert ran.status == 2 and keys in ran.err and "Traceback" not in ran.err
