"""Layers and single things of the map go and come back: for cameras, lidars, rays and bodies."""

import queue

import carla
import numpy as np

from carla_site import MAP, connect, synchronous, ticks

WAIT_SECS = 60.0
BUILDINGS = int(carla.CityObjectLabel.Buildings)
FAR_M = 1000.0


def house_and_view(world: carla.World) -> tuple[carla.EnvironmentObject, carla.Transform]:
    """A house, and a place over a road from which it is the first thing ahead."""
    houses = world.get_environment_objects(carla.CityObjectLabel.Buildings)
    for point in world.get_map().get_spawn_points():
        eye = point.location + carla.Location(z=2.0)
        for house in houses:
            middle = carla.Location(house.bounding_box.location)
            middle.z = eye.z
            if not 15.0 < eye.distance(middle) < 45.0:
                continue
            hits = world.cast_ray(eye, middle)
            if hits and inside(house, hits[0].location):
                yaw = np.degrees(np.arctan2(middle.y - eye.y, middle.x - eye.x))
                return house, carla.Transform(eye, carla.Rotation(yaw=float(yaw)))
    raise AssertionError("no house can be seen from a road")


def inside(house: carla.EnvironmentObject, point: carla.Location) -> bool:
    """In its box or within 0.1 m of it. `BoundingBox.contains` leaves the box's rotation out."""
    box = house.bounding_box
    turned = box.rotation
    axes = turned.get_forward_vector(), turned.get_right_vector(), turned.get_up_vector()
    offset = point - box.location
    halves = box.extent.x, box.extent.y, box.extent.z
    return all(abs(offset.dot(axis)) <= half + 0.1 for axis, half in zip(axes, halves, strict=True))


def touches(world: carla.World, house: carla.EnvironmentObject, point: carla.Location) -> bool:
    """Whether a point is on this house and not on the wall of its neighbour."""
    houses = world.get_environment_objects(carla.CityObjectLabel.Buildings)
    others = (one for one in houses if one.id != house.id)
    return inside(house, point) and not any(inside(other, point) for other in others)


class Eyes:
    """A depth camera, a semantic camera and a semantic lidar at one place."""

    def __init__(self, world: carla.World, place: carla.Transform):
        self.world, self.house = world, None
        size = {"image_size_x": "160", "image_size_y": "90"}
        scan = {"range": "100", "channels": "8", "lower_fov": "-5", "upper_fov": "5"}
        scan |= {"rotation_frequency": "20", "points_per_second": "160000"}
        self.sensors = [
            self.put("sensor.camera.depth", place, size),
            self.put("sensor.camera.semantic_segmentation", place, size),
            self.put("sensor.lidar.ray_cast_semantic", place, scan),
        ]

    def put(self, kind: str, place: carla.Transform, attributes: dict[str, str]):
        blueprint = self.world.get_blueprint_library().find(kind)
        for name, value in attributes.items():
            blueprint.set_attribute(name, value)
        sensor, measured = self.world.spawn_actor(blueprint, place), queue.Queue()
        sensor.listen(measured.put)
        return sensor, measured

    def look(self) -> tuple[float, int, int, list[carla.Location]]:
        """Depth and tag of the middle of the picture, pixels of houses, points on houses."""
        self.world.tick()
        depth, tags, scan = [measured.get(timeout=WAIT_SECS) for _, measured in self.sensors]
        b, g, r, _ = np.moveaxis(np.reshape(bytearray(depth.raw_data), (90, 160, 4)), 2, 0)[
            :, 45, 80
        ]
        depth_m = (int(r) + int(g) * 256 + int(b) * 65536) / (2**24 - 1) * FAR_M
        tags = np.reshape(bytearray(tags.raw_data), (90, 160, 4))[:, :, 2]
        points = [hit for hit in scan if hit.object_tag == BUILDINGS]
        places = [scan.transform.transform(hit.point) for hit in points]
        return depth_m, int(tags[45, 80]), int(np.sum(tags == BUILDINGS)), places

    def close(self) -> None:
        for sensor, _ in self.sensors:
            sensor.stop()


def test_a_house_that_is_switched_off_lets_everything_through(world):
    house, place = house_and_view(world)
    ahead = place.location + place.get_forward_vector() * 60.0
    eyes = Eyes(world, place)
    before = eyes.look()
    depth_m, tag, _, points = before
    assert tag == BUILDINGS and any(touches(world, house, point) for point in points)

    world.enable_environment_objects({house.id}, False)
    far_m, _, pixels, points = eyes.look()
    assert far_m > depth_m + 2.0
    assert pixels < before[2]
    assert not any(touches(world, house, point) for point in points)
    hits = world.cast_ray(place.location, ahead)
    assert not any(touches(world, house, hit.location) for hit in hits)
    projected = world.project_point(place.location, place.get_forward_vector(), FAR_M)
    assert projected is None or not touches(world, house, projected.location)
    above = carla.Location(house.bounding_box.location) + carla.Location(z=100.0)
    assert world.ground_projection(above, 200.0).label != carla.CityObjectLabel.Buildings
    listed = world.get_environment_objects(carla.CityObjectLabel.Buildings)
    assert house.id in {one.id for one in listed}

    world.enable_environment_objects({house.id}, True)
    again = eyes.look()
    assert again[:3] == before[:3]
    assert len(again[3]) == len(before[3])
    assert world.ground_projection(above, 200.0).label == carla.CityObjectLabel.Buildings
    eyes.close()


def test_layers_of_an_opt_map_go_and_come_back(world):
    label = carla.CityObjectLabel
    _, place = house_and_view(world)
    eyes = Eyes(world, place)
    before = eyes.look()
    trees = len(world.get_environment_objects(label.Vegetation))
    roads = len(world.get_environment_objects(label.Roads))
    world.unload_map_layer(carla.MapLayer.Buildings)
    assert not world.get_environment_objects(label.Buildings)
    assert not world.get_level_bbs(label.Buildings)
    assert len(world.get_environment_objects(label.Vegetation)) == trees > 0
    _, tag, pixels, points = eyes.look()
    assert tag != BUILDINGS and pixels == 0 and not points
    world.unload_map_layer(carla.MapLayer.All)
    assert not world.get_environment_objects(label.Vegetation)
    assert len(world.get_environment_objects(label.Roads)) == roads > 0
    world.load_map_layer(carla.MapLayer.All)
    assert eyes.look()[:3] == before[:3]
    eyes.close()


def drive_into(world: carla.World, house: carla.EnvironmentObject, place: carla.Transform):
    """Holds a car at 15 m/s towards a house; how far it comes and what it touches on the way."""
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    start = carla.Transform(place.location - carla.Location(z=1.5), place.rotation)
    car = world.spawn_actor(blueprint, start)
    sensor = world.spawn_actor(
        world.get_blueprint_library().find("sensor.other.collision"), carla.Transform(), car
    )
    touched = []
    sensor.listen(touched.append)
    car.enable_constant_velocity(carla.Vector3D(15.0, 0.0, 0.0))
    went_through = False
    for _ in range(80):
        world.tick()
        where = car.get_location() + carla.Location(z=1.0)
        went_through |= inside(house, where)
    sensor.stop()
    sensor.destroy()
    car.destroy()
    return went_through, len(touched)


def test_a_world_with_two_layers_has_no_others_and_cars_drive_where_houses_were(site):
    client = connect(site.carla_port)
    layers = carla.MapLayer(carla.MapLayer.Buildings | carla.MapLayer.ParkedVehicles)
    with synchronous(client.load_world(MAP, True, layers)) as world:
        label = carla.CityObjectLabel
        assert world.get_environment_objects(label.Buildings)
        assert not world.get_environment_objects(label.Vegetation)
        assert world.get_environment_objects(label.TrafficLight)
        house, place = house_and_view(world)
        ticks(world, 2)
        assert drive_into(world, house, place)[1] > 0
        world.unload_map_layer(carla.MapLayer.Buildings)
        went_through, touched = drive_into(world, house, place)
        assert went_through and touched == 0
        world.load_map_layer(carla.MapLayer.Buildings)
        went_through, touched = drive_into(world, house, place)
        assert not went_through and touched > 0
    world = client.reload_world()
    assert world.get_environment_objects(carla.CityObjectLabel.Vegetation)


def test_maps_that_are_not_opt_have_no_layers(client):
    world = client.load_world("Town02", True, carla.MapLayer.NONE)
    houses = len(world.get_environment_objects(carla.CityObjectLabel.Buildings))
    world.unload_map_layer(carla.MapLayer.All)
    assert len(world.get_environment_objects(carla.CityObjectLabel.Buildings)) == houses > 0
