"""What MCAP files of recordings say, as the readers of others open them."""

import base64
import io
import json
import math
from pathlib import Path

import carla
import causeway.frames
import jsonschema
import numpy as np
import pytest
from mcap.reader import make_reader
from PIL import Image

from carla_site import attach, fresh, spawn_car, synchronous, ticks
from recorded_drive import finished
from test_exact_recordings import folder, record, told

TICKS = 20
SENSORS = ("lidar.ray_cast", "lidar.ray_cast_semantic", "other.radar", "other.imu", "other.gnss")
# Where the ego carries its sensors: ahead, and turned to the left (CARLA's angles are clockwise).
CARRIED = carla.Transform(carla.Location(x=0.8, z=1.7), carla.Rotation(yaw=-90.0))


class Mcap:
    """A file, read whole: channels and messages by topic, JSON decoded."""

    def __init__(self, path: Path) -> None:
        self.messages: dict[str, list] = {}
        self.times: dict[str, list[int]] = {}
        with path.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            summary = reader.get_summary()
            self.schemas = {
                channel.topic: (channel.message_encoding, summary.schemas[channel.schema_id])
                for channel in summary.channels.values()
            }
            self.attachments = {one.name: one.data for one in reader.iter_attachments()}
            self.metadata = {one.name: one.metadata for one in reader.iter_metadata()}
            for _, channel, message in reader.iter_messages():
                is_json = channel.message_encoding == "json"
                content = json.loads(message.data) if is_json else message.data
                self.messages.setdefault(channel.topic, []).append(content)
                self.times.setdefault(channel.topic, []).append(message.log_time)

    def transforms(self, topic: str) -> dict[str, dict]:
        """The last one of each child."""
        return {one["child_frame_id"]: one for one in all_transforms(self, topic)}


def strict(schema: object) -> object:
    """The same schema, in which an object has no other fields."""
    if isinstance(schema, list):
        return [strict(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    inner = {name: strict(value) for name, value in schema.items()}
    return {**inner, "additionalProperties": False} if "properties" in schema else inner


@pytest.fixture(scope="module")
def recording(site):
    """A journal with all kinds of sensors, and what its clients know of it."""
    client = fresh(site.carla_port)
    with synchronous(client.get_world()) as world:
        ego = spawn_car(world, role_name="hero")
        library = world.get_blueprint_library()
        place = world.get_map().get_spawn_points()[0]
        place.location += place.get_forward_vector() * 15.0
        other = world.spawn_actor(library.find("vehicle.audi.tt"), place)
        sensors = {}
        for kind in SENSORS:
            own = {"points_per_second": "10000"} if kind.startswith("lidar") else {}
            sensors[kind], _ = attach(world, ego, f"sensor.{kind}", CARRIED, **own)
        camera = library.find("sensor.camera.semantic_segmentation")
        camera.set_attribute("image_size_x", "64")
        camera.set_attribute("image_size_y", "32")
        sensors["camera"] = world.spawn_actor(camera, CARRIED, attach_to=ego)
        client.start_recorder("topics.log", True)
        ego.apply_control(carla.VehicleControl(throttle=0.4, steer=0.1))
        ticks(world, TICKS)
        path = folder(site) / "topics.log"
        finished(client, path)
        ids = {kind: sensor.id for kind, sensor in sensors.items()}
        yield Path(f"{path}.journal"), ego.id, other.id, ids
        for sensor in sensors.values():
            sensor.destroy()


def exported(recording, tmp_path, *flags: object) -> Mcap:
    journal, ego, _, _ = recording
    out = tmp_path / "out.mcap"
    told("export", journal, "--to", out, "--ego", ego, *flags)
    return Mcap(out)


def test_messages_of_all_topics_fit_their_schemas(recording, tmp_path):
    _, _, _, ids = recording
    cameras = ("--camera", "chase", "--camera", ids["camera"], "--picture-size", "160x90")
    file = exported(recording, tmp_path, "--sensors", "--boxes", *cameras)
    below_ego = {
        "lidar": ("lidar.ray_cast", "points"),
        "radar": ("other.radar", "points"),
        "imu": ("other.imu", "inertia"),
        "gnss": ("other.gnss", "fix"),
    }
    wanted = {f"/ego/{name}/{ids[kind]}/{word}" for name, (kind, word) in below_ego.items()}
    wanted |= {
        f"/{camera}/{word}"
        for camera in ("ego/chase", f"cameras/{ids['camera']}")
        for word in ("image", "calibration", "annotations")
    }
    wanted |= set(
        "/tf /tf_static /map /map/opendrive /actors /actors/poses /traffic_lights /ego/odometry "
        "/ego/pose /ego/fix /ego/state /weather /causeway/frame".split()
    )
    assert wanted <= file.messages.keys(), wanted - file.messages.keys()
    for topic, all_messages in file.messages.items():
        encoding, schema = file.schemas[topic]
        if topic == "/causeway/frame":
            # A compiled schema of FlatBuffers says so after the place of its root.
            assert (encoding, schema.encoding, schema.data[4:8]) == (
                "flatbuffer",
                "flatbuffer",
                b"BFBS",
            )
            assert all(causeway.frames.decode(data).tick for data in all_messages)
            continue
        assert (encoding, schema.encoding) == ("json", "jsonschema"), topic
        assert schema.name.startswith(("foxglove.", "causeway.")), topic
        fits = jsonschema.Draft202012Validator(strict(json.loads(schema.data)))
        for message in all_messages:
            fits.validate(message)
    assert len(file.messages["/ego/pose"]) == TICKS
    assert file.schemas["/ego/chase/annotations"][1].name == "foxglove.ImageAnnotations"


def test_what_the_ego_carries_is_told_once(recording, tmp_path):
    _, _, _, ids = recording
    file = exported(recording, tmp_path, "--sensors", "--camera", "chase", "--every", 4)
    lidar = f"ego/lidar/{ids['lidar.ray_cast']}"
    static = file.transforms("/tf_static")
    assert {lidar, "ego/chase_optical"} <= static.keys()
    assert all(one["parent_frame_id"] == "ego" for one in static.values())
    place, turn = static[lidar]["translation"], static[lidar]["rotation"]
    assert (place["x"], place["y"], place["z"]) == pytest.approx((0.8, 0.0, 1.7), abs=1e-3)
    # A quarter of a turn to the left, which is positive about z.
    assert (turn["z"], turn["w"]) == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)), abs=1e-3)
    children = [one["child_frame_id"] for one in all_transforms(file, "/tf_static")]
    assert len(children) == len(set(children))
    # Where the ego is, is told whenever something was measured, also of frames passed over.
    assert len(set(file.times["/tf"])) == TICKS
    assert set(file.transforms("/tf")) == {"ego"}


def test_the_map_has_lanes_marks_crossings_signs_and_lights(recording, tmp_path):
    (scene,) = exported(recording, tmp_path).messages["/map"]
    entities = {entity["id"]: entity for entity in scene["entities"]}
    (surface,) = entities["lanes"]["triangles"]
    assert len(surface["indices"]) % 3 == 0 and len(surface["indices"]) > 1_000
    assert max(surface["indices"]) < len(surface["points"])
    assert all(line["points"] for line in entities["marks"]["lines"])
    assert entities["crossings"]["triangles"][0]["points"]
    assert entities["lights"]["cubes"]
    assert [name for name in entities if name.startswith("sign/")]


def test_boxes_lie_over_the_actors_of_a_picture(recording, tmp_path):
    _, _, other, _ = recording
    flags = ("--camera", "chase", "--boxes", "--picture-size", "320x180")
    file = exported(recording, tmp_path, *flags)
    chase = file.messages["/ego/chase/annotations"][0]
    index = next(i for i, text in enumerate(chase["texts"]) if text["text"] == f"{other} tt")
    ends = np.array([(end["x"], end["y"]) for end in chase["points"][index]["points"]])
    # The middle of the other car, through the transforms and the calibration of the file.
    k = np.array(file.messages["/ego/chase/calibration"][0]["K"]).reshape(3, 3)
    actors = causeway.frames.decode(file.messages["/causeway/frame"][0]).actors
    (car,) = actors[actors["id"] == other]
    map_from_ego = matrix(file.messages["/tf"][0]["transforms"][0])
    ego_from_optical = matrix(file.transforms("/tf_static")["ego/chase_optical"])
    place = np.append(car["world_from_actor"]["position_m"], 1.0)
    place[2] += 0.7
    seen = (np.linalg.inv(map_from_ego @ ego_from_optical) @ place)[:3]
    x, y, depth = k @ seen
    middle = np.array([x, y]) / depth
    assert (ends.min(axis=0) < middle).all() and (middle < ends.max(axis=0)).all()
    assert ends.max() < 320.0
    # And something is drawn there that is not drawn beside it.
    data = base64.b64decode(file.messages["/ego/chase/image"][0]["data"])
    with Image.open(io.BytesIO(data)) as picture:
        pixels = np.asarray(picture.convert("RGB"), dtype=float)
    column, row = middle.astype(int)
    patch = pixels[row - 2 : row + 3, column - 2 : column + 3].mean(axis=(0, 1))
    beside = pixels[row - 2 : row + 3, column + 60 : column + 65].mean(axis=(0, 1))
    assert np.abs(patch - beside).max() > 10.0


def matrix(transform: dict) -> np.ndarray:
    place, turn = transform["translation"], transform["rotation"]
    x, y, z, w = (turn[name] for name in "xyzw")
    whole = np.eye(4)
    whole[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    whole[:3, 3] = [place[name] for name in "xyz"]
    return whole


def test_a_file_may_have_the_names_of_nuscenes(recording, tmp_path):
    _, _, _, ids = recording
    cameras = ("--camera", "chase", "--camera", ids["camera"], "--picture-size", "64x36")
    file = exported(recording, tmp_path, "--names", "nuscenes", "--sensors", "--boxes", *cameras)
    wanted = set(
        "/tf /map /semantic_map /drivable_area /lidar_top /markers/annotations "
        "/markers/car /pose /gps /imu /odom /diagnostics /cam_chase/image_rect_compressed "
        "/cam_chase/camera_info /cam_chase/annotations".split()
    )
    # Turned to the left by a right angle: between the cameras at 55° and at 110°.
    wanted |= {"/cam_back_left/image_rect"}
    assert wanted <= file.messages.keys(), wanted - file.messages.keys()
    frames = {one["child_frame_id"]: one["parent_frame_id"] for one in all_transforms(file, "/tf")}
    assert frames["base_link"] == "map"
    assert frames["lidar_top"] == frames["cam_back_left"] == frames["imu"] == "base_link"
    (grid,) = file.messages["/drivable_area"]
    cells = base64.b64decode(grid["data"])
    assert len(cells) % grid["row_stride"] == 0 and set(cells) == {0, 255}
    ego = file.messages["/pose"][-1]["pose"]["position"]
    corner, size = grid["pose"]["position"], grid["cell_size"]
    column, row = (int((ego[axis] - corner[axis]) / size[axis]) for axis in "xy")
    assert cells[row * grid["row_stride"] + column] == 255
    (car,) = file.messages["/markers/car"]
    assert car["entities"][0]["frame_id"] == "base_link" and car["entities"][0]["frame_locked"]
    for topic, (encoding, schema) in file.schemas.items():
        if encoding == "json":
            fits = jsonschema.Draft202012Validator(strict(json.loads(schema.data)))
            for message in file.messages.get(topic, []):
                fits.validate(message)


def all_transforms(file: Mcap, topic: str) -> list[dict]:
    return [one for message in file.messages[topic] for one in message["transforms"]]


def test_a_journal_comes_back_from_its_file(recording, tmp_path):
    journal, _, _, _ = recording
    out, again = tmp_path / "out.mcap", tmp_path / "again.journal"
    told("export", journal, "--to", out)
    assert f"{TICKS} ticks, the same to the bit" in told("import", out, "--to", again)
    assert "the same to the bit" in told("verify", again)
    for name, *flags in (("collisions", "--types", "aa"), ("blocked", "--time", 0.1)):
        # But for the lines of when each was written.
        ours, theirs = (told(name, path, *flags).splitlines()[3:] for path in (journal, again))
        assert ours == theirs
    twice = record("import", out, "--to", again)
    assert twice.returncode == 1 and "exists" in twice.stderr


def test_a_part_of_a_journal_comes_back_as_that_part(recording, tmp_path):
    journal, _, _, _ = recording
    out, again = tmp_path / "out.mcap", tmp_path / "again.journal"
    told("export", journal, "--from", 0.5, "--to", out)
    told("import", out, "--to", again)
    assert "the same to the bit" in told("verify", again)


def test_what_is_no_whole_journal_is_not_imported(recording, tmp_path):
    journal, _, _, _ = recording
    some, log = tmp_path / "some.mcap", tmp_path / "log.mcap"
    told("export", journal, "--to", some, "--every", 2)
    told("export", str(journal).removesuffix(".journal"), "--to", log)
    for path in (some, log):
        done = record("import", path, "--to", tmp_path / "no.journal")
        assert done.returncode == 1 and "/ego/pose" in done.stderr, done.stderr
    done = record("import", journal, "--to", tmp_path / "no.journal")
    assert done.returncode == 1 and "does not begin as an MCAP file" in done.stderr
    whole = tmp_path / "whole.mcap"
    told("export", journal, "--to", whole)
    (tmp_path / "cut.mcap").write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    done = record("import", tmp_path / "cut.mcap", "--to", tmp_path / "no.journal")
    assert done.returncode == 1 and "cannot be imported" in done.stderr
    assert not list(tmp_path.glob("no.*"))
