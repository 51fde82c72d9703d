"""Pictures as CARLA's own client hands them to programs: layout, conversion, files, events."""

import math
import queue

import carla
import numpy as np
import pytest
from PIL import Image

from carla_site import attach, connect, spawn_car, ticks, ticks_until

WAIT_SECS = 30.0
WIDE_PX, HIGH_PX = 161, 121
SMALL = {"image_size_x": str(WIDE_PX), "image_size_y": str(HIGH_PX)}
LABEL = carla.CityObjectLabel
FAR_M = 1000.0


def street(world: carla.World) -> carla.Transform:
    point = world.get_map().get_spawn_points()[0]
    return carla.Transform(point.location + carla.Location(z=2.0), point.rotation)


def shot(world: carla.World, kind: str, place: carla.Transform, **attributes: str) -> carla.Image:
    wanted = SMALL | attributes
    camera, pictures = attach(world, None, f"sensor.camera.{kind}", place, **wanted)
    world.tick()
    image = pictures.get(timeout=WAIT_SECS)
    camera.destroy()
    return image


def pixels(image) -> np.ndarray:
    """Rows of blue, green, red, alpha."""
    return np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4).copy()


def share_of_far(image: carla.Image) -> np.ndarray:
    rows = pixels(image).astype(np.int64)
    return (rows[:, :, 2] + 256 * rows[:, :, 1] + 65536 * rows[:, :, 0]) / (2**24 - 1)


def ray_of(place: carla.Transform, column: int, row: int, fov_deg: float) -> carla.Vector3D:
    """From the eye through the middle of a pixel, of length 1 along the view."""
    focal_px = WIDE_PX / 2.0 / math.tan(math.radians(fov_deg) / 2.0)
    aside, down = (column + 0.5 - WIDE_PX / 2.0) / focal_px, (row + 0.5 - HIGH_PX / 2.0) / focal_px
    sideways = place.get_right_vector() * aside - place.get_up_vector() * down
    return place.get_forward_vector() + sideways


def test_an_image_tells_its_size_its_view_and_its_pixels(world):
    place = street(world)
    image = shot(world, "rgb", place, fov="75")
    assert (image.width, image.height) == (WIDE_PX, HIGH_PX)
    assert image.fov == pytest.approx(75.0)
    assert image.transform.location.distance(place.location) < 0.01
    assert image.frame == image.frame_number == world.get_snapshot().frame
    assert image.timestamp == pytest.approx(world.get_snapshot().timestamp.elapsed_seconds)
    rows = pixels(image)
    assert (rows[:, :, 3] == 255).all()
    assert len(image) == WIDE_PX * HIGH_PX
    sky = image[WIDE_PX // 2]
    assert [sky.b, sky.g, sky.r, sky.a] == list(rows[0, WIDE_PX // 2])
    assert sky.b > sky.r, "blue comes first"


def test_a_camera_is_800_by_600_and_90_degrees_wide_unless_told(world):
    camera, pictures = attach(world, None, "sensor.camera.rgb", street(world))
    world.tick()
    image = pictures.get(timeout=WAIT_SECS)
    camera.destroy()
    assert (image.width, image.height, image.fov) == (800, 600, 90.0)


@pytest.mark.parametrize("fov_deg", [60.0, 100.0])
def test_depth_is_what_rays_measure_along_the_view(world, fov_deg):
    place = street(world)
    place.rotation.pitch = -4.0
    depth_m = FAR_M * share_of_far(shot(world, "depth", place, fov=str(fov_deg)))
    tags = pixels(shot(world, "semantic_segmentation", place, fov=str(fov_deg)))[:, :, 2]
    forward, far = place.get_forward_vector(), 0.0
    for row in range(HIGH_PX // 3, HIGH_PX, 6):
        for column in range(0, WIDE_PX, 20):
            hit = world.project_point(place.location, ray_of(place, column, row, fov_deg), 100.0)
            # Paint on the road and windows in walls have a depth of their own in pictures.
            flat = hit and hit.label in (LABEL.Roads, LABEL.Sidewalks)
            if not flat or tags[row, column] != int(hit.label):
                continue
            wanted_m = (hit.location - place.location).dot(forward)
            far = max(far, wanted_m)
            assert depth_m[row, column] == pytest.approx(wanted_m, abs=0.01), (row, column)
    assert far > 30.0
    assert depth_m[tags == int(LABEL.Sky)].min() == pytest.approx(FAR_M)


def test_tags_are_those_of_rays(world):
    place = street(world)
    rows = pixels(shot(world, "semantic_segmentation", place))
    tags, seen = rows[:, :, 2], []
    assert not rows[:, :, :2].any() and (rows[:, :, 3] == 255).all()
    for row in range(0, HIGH_PX, 5):
        for column in range(0, WIDE_PX, 5):
            hit = world.project_point(place.location, ray_of(place, column, row, 90.0), 900.0)
            seen.append((int(tags[row, column]), int(hit.label if hit else LABEL.Sky)))
    roads = int(LABEL.RoadLines), int(LABEL.Roads)
    same = sum(tag == label or (tag, label) == roads for tag, label in seen)
    assert same >= 0.99 * len(seen), [pair for pair in seen if pair[0] != pair[1]]
    assert len({tag for tag, _ in seen}) > 5


def test_depth_is_converted_to_grey_linearly_and_by_logarithm(world):
    place = street(world)
    place.rotation.pitch = -20.0
    grey = {}
    for converter in ("Depth", "LogarithmicDepth"):
        image = shot(world, "depth", place)
        share = share_of_far(image)
        image.convert(getattr(carla.ColorConverter, converter))
        grey[converter] = pixels(image)[:, :, 0].astype(float)
    assert grey["Depth"] == pytest.approx(255 * share, abs=1.0)
    logarithm = 1.0 + np.log(np.maximum(share, 1e-6)) / 5.70378
    assert grey["LogarithmicDepth"] == pytest.approx(255 * logarithm.clip(0.005, 1.0), abs=1.5)


def test_files_hold_the_pixels_of_the_picture(world, tmp_path):
    image = shot(world, "rgb", street(world))
    rows = pixels(image)
    image.save_to_disk(str(tmp_path / "plain.png"))
    with Image.open(tmp_path / "plain.png") as saved:
        assert np.array_equal(np.asarray(saved.convert("RGB")), rows[:, :, 2::-1])
    image.save_to_disk(str(tmp_path / "small.jpg"))
    with Image.open(tmp_path / "small.jpg") as saved:
        coarse = np.asarray(saved.convert("RGB")).astype(float)
        assert np.abs(coarse - rows[:, :, 2::-1]).mean() < 8.0
    tags = shot(world, "semantic_segmentation", street(world))
    road = pixels(tags)[:, :, 2] == int(LABEL.Roads)
    tags.save_to_disk(str(tmp_path / "tags.png"), carla.ColorConverter.CityScapesPalette)
    with Image.open(tmp_path / "tags.png") as saved:
        painted = np.asarray(saved.convert("RGB"))
    assert road.sum() > 1000 and (painted[road] == (128, 64, 128)).all()


def test_events_are_told_one_by_one_as_columns_and_as_a_picture(world):
    place = street(world)
    camera, pictures = attach(world, None, "sensor.camera.dvs", place, **SMALL)
    ticks(world, 2)
    place.rotation.yaw += 3.0
    camera.set_transform(place)
    world.tick()
    events = pictures.get(timeout=WAIT_SECS)
    camera.destroy()
    assert (events.width, events.height, events.fov) == (WIDE_PX, HIGH_PX, 90.0)
    columns = [events.to_array_x(), events.to_array_y(), events.to_array_t()]
    listed = [[event.x, event.y, event.t, 1 if event.pol else -1] for event in events]
    assert listed == [list(row) for row in zip(*columns, events.to_array_pol(), strict=True)]
    assert len(listed) == len(events)
    painted = [at for at, colour in enumerate(events.to_image()) if colour.r or colour.b]
    places = zip(columns[0], columns[1], strict=True)
    assert painted == sorted({y * WIDE_PX + x for x, y in places})


def test_flow_is_told_pixel_by_pixel(world):
    place = street(world)
    camera, pictures = attach(world, None, "sensor.camera.optical_flow", place, **SMALL)
    world.tick()
    place.location += place.get_forward_vector() * 0.5
    camera.set_transform(place)
    world.tick()
    pictures.get(timeout=WAIT_SECS)
    image = pictures.get(timeout=WAIT_SECS)
    camera.destroy()
    raw = np.frombuffer(image.raw_data, np.float32).reshape(-1, 2)
    assert len(image) == WIDE_PX * HIGH_PX == len(raw)
    at = (HIGH_PX - 10) * WIDE_PX + WIDE_PX // 2
    assert (image[at].x, image[at].y) == pytest.approx(tuple(raw[at]))
    # The road below comes nearer: it moves down.
    assert image[at].y < -0.01


def test_a_sensor_listens_until_it_is_stopped_and_may_begin_again(world):
    car = spawn_car(world)
    gnss, first = attach(world, car, "sensor.other.gnss")
    assert gnss.is_listening()
    frame = world.tick()
    assert first.get(timeout=WAIT_SECS).frame == frame
    gnss.stop()
    assert not gnss.is_listening()
    world.tick()
    second = queue.Queue()
    gnss.listen(second.put)
    frame = world.tick()
    assert second.get(timeout=WAIT_SECS).frame == frame
    assert first.empty() and second.empty()
    gnss.stop()
    gnss.destroy()


def of_frame(pictures: queue.Queue, frame: int) -> carla.Image:
    while (image := pictures.get(timeout=WAIT_SECS)).frame != frame:
        pass
    return image


def test_two_clients_may_listen_to_one_sensor(site, world):
    camera, own = attach(world, None, "sensor.camera.rgb", street(world), **SMALL)
    world.tick()
    own.get(timeout=WAIT_SECS)
    other = connect(site.carla_port).get_world().get_actor(camera.id)
    theirs = queue.Queue()
    other.listen(theirs.put)
    ticks_until(world, lambda: not theirs.empty())
    frame = world.tick()
    pictures = [of_frame(pictures, frame) for pictures in (own, theirs)]
    assert np.array_equal(pixels(pictures[0]), pixels(pictures[1]))
    other.stop()
    camera.destroy()


def test_a_camera_with_a_period_sends_that_often(world):
    camera, pictures = attach(
        world, None, "sensor.camera.rgb", street(world), sensor_tick="0.15", **SMALL
    )
    frames = [world.tick() for _ in range(10)]
    seen = [pictures.get(timeout=WAIT_SECS).frame for _ in range(4)]
    assert seen == frames[::3]
    with pytest.raises(queue.Empty):
        pictures.get(timeout=0.2)
    camera.destroy()


def mounted(here: carla.Transform, place: carla.Transform) -> carla.Vector3D:
    """The client's own `transform` changes what it is given."""
    return here.transform(carla.Location(place.location))


def test_a_sensor_is_where_it_hangs_in_the_frame_of_its_datum(world):
    car = spawn_car(world)
    place = carla.Transform(carla.Location(x=1.0, y=0.5, z=2.0), carla.Rotation(yaw=90.0))
    gnss, measured = attach(world, car, "sensor.other.gnss", place)
    car.apply_control(carla.VehicleControl(throttle=1.0))
    for _ in range(20):
        world.tick()
        datum = measured.get(timeout=WAIT_SECS)
        here = car.get_transform()
        assert datum.transform.location.distance(mounted(here, place)) < 0.01
        assert datum.transform.location.distance(gnss.get_location()) < 1e-3
    assert car.get_velocity().length() > 1.0
    gnss.destroy()


def test_switches_without_effect_are_accepted(world):
    gnss, _ = attach(world, None, "sensor.other.gnss", street(world))
    gnss.enable_for_ros()
    assert gnss.is_enabled_for_ros() is False
    gnss.disable_for_ros()
    world.set_annotations_traverse_translucency(True)
    world.tick()
    gnss.destroy()
