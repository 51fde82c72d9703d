"""Many streams, slow listeners and what pictures show of which frame, with CARLA's own client."""

import math
import threading
import time

import carla
import numpy as np
import pytest

from carla_site import attach, connect, spawn_car, synchronous, ticks

WAIT_SECS = 60.0
WIDE_PX, HIGH_PX = 160, 90
SIZE = {"image_size_x": str(WIDE_PX), "image_size_y": str(HIGH_PX)}
TINY = {"image_size_x": "32", "image_size_y": "24"}


def test_ten_sensors_tell_of_every_tick_once(world):
    car = spawn_car(world)
    world.tick()
    kinds = [("camera.rgb", TINY), ("camera.depth", TINY), ("camera.semantic_segmentation", TINY)]
    kinds += [("lidar.ray_cast", {}), ("lidar.ray_cast_semantic", {}), ("other.radar", {})]
    kinds += [("other.imu", {}), ("other.gnss", {})] * 2
    sensors = [attach(world, car, f"sensor.{kind}", **more) for kind, more in kinds]
    car.apply_control(carla.VehicleControl(throttle=0.5))
    for _ in range(50):
        frame = world.tick()
        data = [measured.get(timeout=WAIT_SECS) for _, measured in sensors]
        assert {datum.frame for datum in data} == {frame}
        assert len({datum.timestamp for datum in data}) == 1
    assert all(measured.empty() for _, measured in sensors)
    for sensor, _ in sensors:
        sensor.destroy()


def seen_box(image: carla.Image, label: carla.CityObjectLabel) -> float:
    """Column of the middle of all pixels with a tag."""
    tags = np.frombuffer(image.raw_data, np.uint8).reshape(HIGH_PX, WIDE_PX, 4)[:, :, 2]
    columns = np.nonzero(tags == int(label))[1]
    assert len(columns) > 30
    return (columns.min() + columns.max() + 1) / 2


def test_a_picture_shows_a_moving_car_where_its_frame_has_it(world):
    """A car at 20 m/s crosses 10 pixels in a tick."""
    car = spawn_car(world)
    ticks(world, 20)
    start = car.get_transform()
    ahead, side = start.get_forward_vector(), start.get_right_vector()
    eye = start.location + ahead * 10.0 - side * 16.0 + carla.Location(z=1.0)
    view = carla.Transform(carla.Location(eye), carla.Rotation(yaw=start.rotation.yaw + 90.0))
    camera, pictures = attach(world, None, "sensor.camera.semantic_segmentation", view, **SIZE)
    car.enable_constant_velocity(carla.Vector3D(20.0, 0.0, 0.0))
    for _ in range(10):
        frame = world.tick()
        image = pictures.get(timeout=WAIT_SECS)
        assert image.frame == frame
        middle = carla.Location(car.bounding_box.location)
        car.get_transform().transform(middle)
        inverse = np.array(view.get_inverse_matrix())
        x, y, _, _ = inverse @ [middle.x, middle.y, middle.z, 1.0]
        column = WIDE_PX / 2 * (1.0 + y / x)
        assert seen_box(image, carla.CityObjectLabel.Car) == pytest.approx(column, abs=3.0)
    camera.destroy()


def test_instances_are_numbered_by_actor_with_the_low_byte_in_green(world):
    cars = [spawn_car(world), None]
    place = world.get_map().get_spawn_points()[0]
    place.location += place.get_forward_vector() * 9.0
    cars[1] = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), place)
    ticks(world, 5)
    above = carla.Transform(carla.Location(x=4.0, z=14.0), carla.Rotation(pitch=-90.0))
    kind = "sensor.camera.instance_segmentation"
    camera, pictures = attach(world, cars[0], kind, above, **SIZE)
    world.tick()
    image = pictures.get(timeout=WAIT_SECS)
    rows = np.frombuffer(image.raw_data, np.uint8).reshape(-1, 4)
    of_cars = rows[rows[:, 2] == int(carla.CityObjectLabel.Car)].astype(int)
    ids, counts = np.unique(of_cars[:, 1] + 256 * of_cars[:, 0], return_counts=True)
    # Ids are never given again, so that they outgrow the 15 bits of a pixel.
    assert set(ids) == {car.id % 32_768 for car in cars} and counts.min() > 50
    camera.destroy()


def test_pictures_and_scans_go_on_in_no_rendering_mode(world):
    """As in CARLA 0.9.16, where the mode spares the view of the server alone."""
    place = carla.Transform(world.get_map().get_spawn_points()[0].location + carla.Location(z=2.0))
    camera, pictures = attach(world, None, "sensor.camera.rgb", place, **TINY)
    lidar, scans = attach(world, None, "sensor.lidar.ray_cast", place)
    settings = world.get_settings()
    settings.no_rendering_mode = True
    world.apply_settings(settings)
    for frame in [world.tick() for _ in range(3)]:
        image, scan = pictures.get(timeout=WAIT_SECS), scans.get(timeout=WAIT_SECS)
        while image.frame < frame:
            image = pictures.get(timeout=WAIT_SECS)
        while scan.frame < frame:
            scan = scans.get(timeout=WAIT_SECS)
        assert image.frame == scan.frame == frame
        assert len(scan) > 100 and len(set(bytes(image.raw_data))) > 10
    camera.destroy()
    lidar.destroy()


def test_frames_go_on_while_a_listener_takes_its_time_and_its_pictures_stay_whole(client):
    world = client.get_world()
    place = carla.Transform(carla.Location(z=40.0))
    seen, goes_on = [], threading.Event()

    def look(image: carla.Image) -> None:
        goes_on.wait(4 * WAIT_SECS)
        seen.append((image.frame, len(image.raw_data)))

    blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
    for name, value in SIZE.items():
        blueprint.set_attribute(name, value)
    camera = world.spawn_actor(blueprint, place)
    camera.listen(look)
    first = world.wait_for_tick()
    while world.wait_for_tick().frame < first.frame + 40:
        assert not seen
    goes_on.set()
    deadline = time.monotonic() + WAIT_SECS
    while len(seen) < 3 and time.monotonic() < deadline:
        world.wait_for_tick()
    camera.stop()
    frames = [frame for frame, _ in seen]
    assert len(frames) >= 3 and frames == sorted(set(frames))
    assert {size for _, size in seen} == {4 * WIDE_PX * HIGH_PX}
    world.wait_for_tick()
    camera.destroy()


def test_two_runs_of_one_script_are_equal_to_the_last_bit(client):
    def run() -> list[list[float]]:
        with synchronous(client.reload_world()) as world:
            cars = [spawn_car(world, index) for index in range(4)]
            told = []
            # Ids go on from those of the world before.
            first = min(actor.id for actor in world.get_actors())
            for step in range(60):
                for at, car in enumerate(cars):
                    steer = 0.1 * math.sin(step / 5 + at)
                    car.apply_control(carla.VehicleControl(throttle=0.6, steer=steer))
                world.tick()
                for one in world.get_snapshot():
                    place, speed = one.get_transform(), one.get_velocity()
                    where = place.location
                    told.append([one.id - first, where.x, where.y, where.z])
                    told.append([place.rotation.yaw, speed.x, speed.y, speed.z])
            return told

    assert run() == run()


def test_an_actor_cannot_hang_on_one_that_is_gone(site, world):
    car = spawn_car(world)
    world.tick()
    gone = connect(site.carla_port).get_world().get_actor(car.id)
    car.destroy()
    world.tick()
    blueprint = world.get_blueprint_library().find("sensor.other.gnss")
    with pytest.raises(RuntimeError, match="parent actor not found"):
        world.spawn_actor(blueprint, carla.Transform(), attach_to=gone)


def test_spawns_are_answered_while_frames_go_on(client):
    world = client.get_world()
    frames = []
    callback = world.on_tick(lambda snapshot: frames.append(snapshot.frame))
    world.wait_for_tick()
    car = spawn_car(world)
    spawned, deadline = len(frames), time.monotonic() + WAIT_SECS
    while len(frames) < spawned + 15 and time.monotonic() < deadline:
        world.wait_for_tick()
    world.remove_on_tick(callback)
    assert len(frames) > 15 and frames == list(range(frames[0], frames[-1] + 1))
    car.destroy()
