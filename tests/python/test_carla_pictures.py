"""Cameras of every kind through CARLA's own client: flow, events, textures, drawn shapes."""

import math
import queue
import re
import subprocess
import time

import carla
import numpy as np
import pytest

from carla_site import attach, connect, spawn_car, synchronous, ticks
from running_site import child

WAIT_SECS = 60.0
WIDE_PX, HIGH_PX = 160, 120


def look(world: carla.World, kind: str, parent=None, place=None, **attributes: str):
    """A small camera and the queue of its pictures."""
    blueprint = world.get_blueprint_library().find(f"sensor.camera.{kind}")
    wanted = {"image_size_x": str(WIDE_PX), "image_size_y": str(HIGH_PX), **attributes}
    for name, value in wanted.items():
        blueprint.set_attribute(name, value)
    place = place or carla.Transform(carla.Location(x=2.5, z=2.0))
    camera = world.spawn_actor(blueprint, place, attach_to=parent)
    pictures = queue.Queue()
    camera.listen(pictures.put)
    return camera, pictures


def high_above(world: carla.World, yaw: float = 0.0) -> carla.Transform:
    """A place above the roofs that looks down the street a little."""
    start = world.get_map().get_spawn_points()[0].location
    return carla.Transform(start + carla.Location(z=40.0), carla.Rotation(pitch=-20.0, yaw=yaw))


def pixels(image: carla.Image) -> np.ndarray:
    """Rows of blue, green, red, alpha."""
    return np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4)


def flow_of(image) -> np.ndarray:
    return np.frombuffer(image.raw_data, np.float32).reshape(image.height, image.width, 2)


def test_the_flow_of_a_turning_camera_is_that_of_its_angle(world):
    place = high_above(world)
    camera, pictures = look(world, "optical_flow", place=carla.Transform(place.location))
    world.tick()
    still = flow_of(pictures.get(timeout=WAIT_SECS))
    assert np.abs(still).max() < 1e-4
    turn_deg = 1.0
    camera.set_transform(carla.Transform(place.location, carla.Rotation(yaw=turn_deg)))
    world.tick()
    image = pictures.get(timeout=WAIT_SECS)
    middle = flow_of(image)[HIGH_PX // 2, WIDE_PX // 2]
    assert middle[0] == pytest.approx(-math.tan(math.radians(turn_deg)), rel=0.02)
    assert abs(middle[1]) < 1e-3
    coded = image.get_color_coded_flow()
    assert (coded.width, coded.height) == (WIDE_PX, HIGH_PX)
    camera.destroy()


def test_events_come_only_where_something_changes_and_in_order(world):
    place = high_above(world)
    camera, pictures = look(world, "dvs", place=place)
    ticks(world, 3)
    with pytest.raises(queue.Empty):
        pictures.get(timeout=1.0)
    place.rotation.yaw += 3.0
    camera.set_transform(place)
    frame = world.tick()
    events = pictures.get(timeout=WAIT_SECS)
    assert events.frame == frame
    stamps = events.to_array_t()
    assert len(stamps) > 50 and stamps == sorted(stamps)
    now_ns = world.get_snapshot().timestamp.elapsed_seconds * 1e9
    assert now_ns - 0.051e9 <= stamps[0] and stamps[-1] <= now_ns + 1e3
    assert max(events.to_array_x()) < WIDE_PX and max(events.to_array_y()) < HIGH_PX
    camera.destroy()


def test_textures_of_a_camera_are_of_the_same_frame(world):
    camera, pictures = look(world, "rgb", place=high_above(world))
    camera.enable_gbuffers(True)
    textures = queue.Queue()
    wanted = {
        "colour": carla.GBufferTextureID.SceneColor,
        "stencil": carla.GBufferTextureID.SceneStencil,
        "missing": carla.GBufferTextureID.GBufferE,
    }
    for name, number in wanted.items():
        camera.listen_to_gbuffer(number, lambda image, name=name: textures.put((name, image)))
    frame = world.tick()
    plain = pictures.get(timeout=WAIT_SECS)
    found = dict(textures.get(timeout=WAIT_SECS) for _ in wanted)
    assert {plain.frame, *(image.frame for image in found.values())} == {frame}
    assert np.array_equal(pixels(found["colour"]), pixels(plain))
    assert len(np.unique(pixels(found["stencil"])[:, :, 2])) > 2
    assert pixels(found["missing"])[:, :, :3].max() == 0
    for number in wanted.values():
        camera.stop_gbuffer(number)
    camera.destroy()


def test_the_cosmos_camera_paints_what_things_are(world):
    place = high_above(world)
    painted, pictures = look(world, "cosmos_visualization", place=place)
    tagged, tags = look(world, "semantic_segmentation", place=place)
    world.tick()
    image = tags.get(timeout=WAIT_SECS)
    image.convert(carla.ColorConverter.CityScapesPalette)
    assert np.array_equal(
        pixels(pictures.get(timeout=WAIT_SECS))[:, :, :3], pixels(image)[:, :, :3]
    )
    painted.destroy()
    tagged.destroy()


def test_a_camera_does_not_see_vehicles_that_it_ignores(world):
    car = spawn_car(world)
    above = carla.Transform(carla.Location(z=12.0), carla.Rotation(pitch=-90.0))
    camera, pictures = look(world, "semantic_segmentation", parent=car, place=above)

    def car_pixels() -> int:
        world.tick()
        tags = pixels(pictures.get(timeout=WAIT_SECS))[:, :, 2]
        return int((tags == carla.CityObjectLabel.Car).sum())

    assert car_pixels() > 100
    camera.set_ignored_vehicles([car.id])
    assert car_pixels() == 0
    camera.set_ignored_vehicles([])
    assert car_pixels() > 100
    with pytest.raises(RuntimeError, match="a vehicle"):
        camera.set_ignored_vehicles([camera.id])
    camera.destroy()
    car.destroy()


def test_a_drawn_line_is_in_the_picture_until_its_time_is_over(world):
    place = carla.Transform(high_above(world).location)
    camera, pictures = look(world, "rgb", place=place)
    begin = place.location + carla.Location(x=10.0, y=-3.0)
    red, life_secs = carla.Color(255, 0, 0), 0.12
    world.debug.draw_line(begin, begin + carla.Location(y=6.0), 0.1, red, life_secs)
    seen = []
    for _ in range(4):
        world.tick()
        image = pixels(pictures.get(timeout=WAIT_SECS))
        seen.append(int((image[:, :, :3] == (0, 0, 255)).all(axis=2).sum()))
    assert seen[0] > 30 and seen[1] > 30
    assert seen[3] == 0
    world.debug.draw_point(begin + carla.Location(y=3.0), 0.1, red, 0.0)
    ticks(world, 2)
    image = [pictures.get(timeout=WAIT_SECS) for _ in range(2)][-1]
    assert (pixels(image)[:, :, :3] == (0, 0, 255)).all(axis=2).any()
    camera.destroy()


def test_a_car_that_passes_flows_and_the_street_does_not(world):
    car = spawn_car(world)
    ticks(world, 20)
    place = car.get_transform()
    side = place.get_right_vector()
    eye = carla.Transform(
        place.location + carla.Location(side.x * 8, side.y * 8, 1.0),
        carla.Rotation(yaw=place.rotation.yaw - 90.0),
    )
    flow_camera, flows = look(world, "optical_flow", place=eye)
    tag_camera, tags = look(world, "semantic_segmentation", place=eye)
    ahead = place.get_forward_vector()
    car.enable_constant_velocity(carla.Vector3D(8.0, 0.0, 0.0))
    ticks(world, 2)
    flow = [flow_of(flows.get(timeout=WAIT_SECS)) for _ in range(2)][-1]
    tag = [pixels(tags.get(timeout=WAIT_SECS)) for _ in range(2)][-1][:, :, 2]
    assert abs(ahead.length() - 1.0) < 1e-3
    is_car = tag == 14
    assert is_car.sum() > 200
    assert np.median(flow[is_car][:, 0]) > 0.02
    assert np.abs(flow[tag == 1]).max() < 1e-3
    flow_camera.destroy()
    tag_camera.destroy()


def renderers_come(site) -> int:
    """How many renderers have come up so far."""
    return len(re.findall(r"renderer .* up after", site.log.read_text(errors="replace")))


def test_the_picture_that_loses_its_renderer_is_drawn_by_the_next_one(start_site):
    site = start_site()
    world = connect(site.carla_port).get_world()
    with synchronous(world):
        blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
        blueprint.set_attribute("image_size_x", "1280")
        blueprint.set_attribute("image_size_y", "720")
        camera = world.spawn_actor(blueprint, carla.Transform(carla.Location(z=40.0)))
        pictures = queue.Queue()
        camera.listen(lambda image: pictures.put(image.frame))
        world.tick()
        pictures.get(timeout=WAIT_SECS)
        lost = child(site, "render")
        frame = world.tick()
        subprocess.run(["kill", "-9", str(lost)], check=True)
        began = time.monotonic()
        while renderers_come(site) < 2:
            assert time.monotonic() < began + WAIT_SECS
            time.sleep(0.02)
        away_secs = time.monotonic() - began
        try:
            assert pictures.get(timeout=WAIT_SECS) == frame
        except queue.Empty:
            # A picture waits for five seconds for a renderer.
            assert away_secs > 4.0
        # The next tick may come before the gateway hears of the new renderer, and goes without one.
        deadline = time.monotonic() + WAIT_SECS
        while pictures.empty():
            assert time.monotonic() < deadline
            world.tick()
            time.sleep(0.1)
        camera.stop()


def test_a_camera_without_any_renderer_is_refused_and_the_world_goes_on(start_site):
    world = connect(start_site("--no-render").carla_port).get_world()
    with synchronous(world):
        car = spawn_car(world)
        with pytest.raises(RuntimeError, match="no renderer is up"):
            attach(world, car, "sensor.camera.rgb")
        imu, measured = attach(world, car, "sensor.other.imu")
        for _ in range(20):
            frame = world.tick()
            assert measured.get(timeout=WAIT_SECS).frame == frame
        imu.stop()
