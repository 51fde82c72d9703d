"""Sensors, traffic lights and walkers through CARLA's own client."""

import math

import carla
import pytest

from carla_site import attach, connect, spawn_car, ticks

WAIT_SECS = 30.0


@pytest.mark.parametrize(
    "blueprint_id",
    [
        "sensor.lidar.ray_cast",
        "sensor.lidar.ray_cast_semantic",
        "sensor.other.radar",
        "sensor.other.imu",
        "sensor.other.gnss",
    ],
)
def test_a_sensor_measures_once_in_every_tick_from_the_first(world, blueprint_id):
    car = spawn_car(world)
    world.tick()
    sensor, measured = attach(world, car, blueprint_id)
    frames = [world.tick() for _ in range(10)]
    assert [measured.get(timeout=WAIT_SECS).frame for _ in frames] == frames
    assert measured.empty()
    sensor.stop()


def test_a_period_between_two_ticks_is_kept_on_average(world):
    car = spawn_car(world)
    world.tick()
    sensor, measured = attach(world, car, "sensor.other.gnss", sensor_tick="0.12")
    frames = [world.tick() for _ in range(16)]
    seen = [measured.get(timeout=WAIT_SECS).frame for _ in range(7)]
    # Ticks of 0.05 s.
    assert seen == [frames[at - 1] for at in (1, 4, 6, 9, 11, 13, 16)]
    sensor.stop()


@pytest.mark.parametrize(
    ("arm", "lift"),
    [(carla.AttachmentType.SpringArmGhost, 0.0), (carla.AttachmentType.SpringArm, 0.3)],
)
def test_what_hangs_on_a_spring_arm_looks_at_its_parent(world, arm, lift):
    car = spawn_car(world)
    world.tick()
    blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
    # As in CARLA's manual_control.py, behind, and ahead without a rotation of its own.
    behind = carla.Transform(carla.Location(x=-6.0, z=2.5), carla.Rotation(pitch=8.0))
    ahead = carla.Transform(carla.Location(x=5.0, y=1.5, z=1.5))
    cameras = [world.spawn_actor(blueprint, place, car, arm) for place in (behind, ahead)]
    car.set_target_velocity(8.0 * car.get_transform().get_forward_vector())
    ticks(world, 20)
    here = car.get_transform()
    for camera, place in zip(cameras, (behind, ahead), strict=True):
        found = camera.get_transform()
        away = here.inverse_transform(carla.Location(found.location))
        assert away.distance(place.location + carla.Location(z=lift)) < 0.15
        look = -1.0 * place.location
        wanted = math.degrees(math.atan2(look.z, math.hypot(look.x, look.y)))
        assert found.rotation.pitch == pytest.approx(wanted + place.rotation.pitch, abs=1.0)
        turned = found.rotation.yaw - here.rotation.yaw - math.degrees(math.atan2(look.y, look.x))
        assert abs((turned + 180.0) % 360.0 - 180.0) < 2.0
        camera.destroy()


def test_gnss_tells_what_the_map_says_of_the_place(world):
    car = spawn_car(world)
    world.tick()
    sensor, measured = attach(world, car, "sensor.other.gnss")
    world.tick()
    found = measured.get(timeout=WAIT_SECS)
    wanted = world.get_map().transform_to_geolocation(found.transform.location)
    assert found.latitude == pytest.approx(wanted.latitude, abs=1e-6)
    assert found.longitude == pytest.approx(wanted.longitude, abs=1e-6)
    sensor.stop()


def leaderboards_place(world_map: carla.Map, place: carla.Location) -> tuple[float, float]:
    """Latitude and longitude as CARLA's leaderboard counts them from the map's origin."""
    origin = world_map.transform_to_geolocation(carla.Location())
    scaled_m = 6_378_137.0 * math.cos(math.radians(origin.latitude))
    half = math.radians(90.0 + origin.latitude) / 2.0
    north = math.log(math.tan(half)) - place.y / scaled_m
    latitude = 2.0 * math.degrees(math.atan(math.exp(north))) - 90.0
    return latitude, origin.longitude + math.degrees(place.x / scaled_m)


def test_latitudes_grow_to_the_north_where_the_site_is_told_so(start_site):
    site = start_site("--no-render", "--latitudes", "north")
    world = connect(site.carla_port).get_world()
    car = spawn_car(world)
    sensor, measured = attach(world, car, "sensor.other.gnss")
    found = measured.get(timeout=WAIT_SECS)
    place = found.transform.location
    assert abs(place.y) > 1.0
    wanted = leaderboards_place(world.get_map(), place)
    assert (found.latitude, found.longitude) == pytest.approx(wanted, abs=1e-7)
    sensor.stop()


def test_an_imu_at_rest_feels_gravity_upwards(world):
    car = spawn_car(world)
    ticks(world, 40)
    sensor, measured = attach(world, car, "sensor.other.imu")
    world.tick()
    assert measured.get(timeout=WAIT_SECS).accelerometer.z == pytest.approx(9.81, abs=0.2)
    sensor.stop()


def test_traffic_lights_belong_to_signals_and_obey(world):
    world.tick()
    lights = world.get_actors().filter("traffic.traffic_light")
    assert len(lights) > 0
    light = lights[0]
    assert light.id in [other.id for other in light.get_group_traffic_lights()]
    assert light.get_affected_lane_waypoints()
    for wanted in (carla.TrafficLightState.Red, carla.TrafficLightState.Green):
        light.freeze(True)
        light.set_state(wanted)
        world.tick()
        assert light.state == wanted
    light.freeze(False)


def test_walkers_find_their_way_on_the_navigation_mesh(client, world, tmp_path):
    client.set_files_base_folder(str(tmp_path))
    world.tick()
    world.set_pedestrians_seed(1)
    library = world.get_blueprint_library()
    places = [world.get_random_location_from_navigation() for _ in range(6)]
    assert all(places)
    body = library.find("walker.pedestrian.0001")
    above = carla.Location(z=1.0)
    spawned = [world.try_spawn_actor(body, carla.Transform(place + above)) for place in places]
    walkers = [walker for walker in spawned if walker]
    world.tick()
    brain = library.find("controller.ai.walker")
    brains = [world.spawn_actor(brain, carla.Transform(), walker) for walker in walkers]
    world.tick()
    for controller in brains:
        controller.start()
        controller.go_to_location(world.get_random_location_from_navigation())
        controller.set_max_speed(1.4)
    starts = [walker.get_location() for walker in walkers]
    ticks(world, 200)
    walked = [
        walker.get_location().distance(start) for walker, start in zip(walkers, starts, strict=True)
    ]
    assert len(walkers) >= 4
    assert sum(metres > 5.0 for metres in walked) >= len(walkers) - 1, walked
    for controller in brains:
        controller.stop()


def test_a_sensor_that_cannot_be_is_refused_at_its_spawn(world):
    car = spawn_car(world)
    with pytest.raises(RuntimeError, match="positive_threshold"):
        attach(world, car, "sensor.camera.dvs", positive_threshold="-1.0")
    with pytest.raises(RuntimeError, match="image_size_x"):
        attach(world, car, "sensor.camera.rgb", image_size_x="100000")


def test_cameras_that_measure_tell_depth_tags_ids_and_normals_of_the_same_tick(world):
    car = spawn_car(world)
    ticks(world, 20)
    size = {"image_size_x": "64", "image_size_y": "48"}
    kinds = ("depth", "semantic_segmentation", "instance_segmentation", "normals")
    cameras = {kind: attach(world, car, f"sensor.camera.{kind}", **size) for kind in kinds}
    frame = world.tick()
    images = {kind: queued.get(timeout=WAIT_SECS) for kind, (_, queued) in cameras.items()}
    assert {image.frame for image in images.values()} == {frame}

    def below_the_middle(kind: str) -> tuple[int, int, int]:
        """Blue, green and red of the road some metres ahead."""
        start = 4 * (64 * 44 + 32)
        return tuple(bytes(images[kind].raw_data)[start : start + 3])

    blue, green, red = below_the_middle("depth")
    depth_m = 1000.0 * (red + 256 * green + 65536 * blue) / 16_777_215
    assert 1.0 < depth_m < 10.0
    roads = {1, 14, 24}  # The road, its lines, or the car's own bonnet.
    assert below_the_middle("semantic_segmentation")[2] in roads
    assert below_the_middle("instance_segmentation")[2] in roads
    assert max(below_the_middle("normals")) > 200
    for sensor, _ in cameras.values():
        sensor.stop()
