"""What is where in the map: rays, objects and boxes through CARLA's own client."""

import carla
import pytest

from carla_site import connect, spawn_car, ticks

UP = carla.Location(z=1.0)
LABEL = carla.CityObjectLabel
# Neither is anything that stands up, and lights are beside their boxes' middles.
FLAT = {LABEL.Roads, LABEL.RoadLines, LABEL.Sidewalks, LABEL.Terrain}
SIGNALS = {LABEL.TrafficLight, LABEL.TrafficSigns}


def over_a_road(world: carla.World) -> carla.Location:
    point = world.get_map().get_spawn_points()[0].location
    return carla.Location(point.x, point.y, 3.0)


def test_a_ray_downwards_meets_the_road_at_its_height(world):
    start = over_a_road(world)
    road = world.get_map().get_waypoint(start).transform.location
    for hit in (
        world.ground_projection(start, 5.0),
        world.project_point(start, carla.Vector3D(0.0, 0.0, -2.0), 5.0),
        world.cast_ray(start, start - carla.Location(z=5.0))[0],
    ):
        assert hit.label == LABEL.Roads
        assert hit.location.distance(carla.Location(start.x, start.y, road.z)) < 0.01


def test_a_ray_into_the_air_meets_nothing(world):
    start = over_a_road(world)
    assert world.project_point(start, carla.Vector3D(0.0, 0.0, 1.0), 50.0) is None
    assert world.ground_projection(start, 2.0) is None
    assert len(world.cast_ray(start, start + carla.Location(z=50.0))) == 0


@pytest.mark.parametrize("length", [0.1, 1.0, 10.0])
def test_how_far_a_ray_looks_does_not_depend_on_the_length_of_its_direction(world, length):
    start, down = over_a_road(world), carla.Vector3D(0.0, 0.0, -length)
    assert world.project_point(start, down, 2.9) is None
    assert world.project_point(start, down, 3.1).location.z == pytest.approx(0.0, abs=0.01)


def test_a_ray_through_a_car_meets_it_and_then_the_road(world):
    car = spawn_car(world)
    ticks(world, 40)
    here = car.get_location()
    hits = world.cast_ray(here + carla.Location(z=5.0), here - carla.Location(z=0.03))
    assert [hit.label for hit in hits] == [LABEL.Car, LABEL.Roads]
    roof = car.bounding_box.location.z + car.bounding_box.extent.z
    assert hits[0].location.z == pytest.approx(here.z + roof, abs=0.1)
    side = car.get_transform().get_right_vector()
    low = here + carla.Location(z=0.6)
    hit = world.project_point(low + side * 5.0, side * -1.0, 10.0)
    assert hit.label == LABEL.Car
    gap_m = 5.0 - car.bounding_box.extent.y
    assert hit.location.distance(low + side * 5.0) == pytest.approx(gap_m, abs=0.02)


def test_a_ray_that_begins_in_a_car_meets_it_there_and_then_what_is_ahead(world):
    """As programs ask whether a camera sees a car: nothing met is a car that is not there."""
    car = spawn_car(world)
    ticks(world, 40)
    middle = car.get_transform().transform(car.bounding_box.location)
    hits = world.cast_ray(middle, middle + carla.Location(z=5.0))
    assert [hit.label for hit in hits] == [LABEL.Car]
    assert hits[0].location.distance(middle) < 0.001
    hits = world.cast_ray(middle, middle - carla.Location(z=5.0))
    assert [hit.label for hit in hits[:2]] == [LABEL.Car, LABEL.Roads]
    assert world.project_point(middle, carla.Vector3D(1.0, 0.0, 0.0), 5.0).label == LABEL.Car


def test_things_of_the_map_are_of_one_kind_for_rays_boxes_and_lists(world):
    """Of every kind, the first three that stand free enough to be seen from a side."""
    upright = [
        one for one in world.get_environment_objects(LABEL.Any) if one.type not in FLAT | SIGNALS
    ]
    kinds = {one.type for one in upright}
    assert {LABEL.Buildings, LABEL.Poles, LABEL.Vegetation, LABEL.Fences, LABEL.Dynamic} <= kinds
    for kind in kinds:
        for one in [other for other in upright if other.type == kind][:3]:
            box, seen = one.bounding_box, set()
            turn = carla.Transform(carla.Location(), box.rotation)
            away = max(box.extent.x, box.extent.y, box.extent.z) + 1.0
            for side in (turn.get_right_vector(), turn.get_forward_vector()):
                for way in (side, side * -1.0):
                    hit = world.project_point(box.location + way * away, way * -1.0, away)
                    seen |= {hit.label} if hit else set()
            assert kind in seen, f"{one.name}: {seen}"


def test_the_foot_of_an_object_is_under_its_box(world):
    for one in world.get_environment_objects(LABEL.Buildings)[:20]:
        middle, foot = one.bounding_box.location, one.transform.location
        assert (foot.x, foot.y) == pytest.approx((middle.x, middle.y), abs=0.01)
        assert foot.z == pytest.approx(middle.z - one.bounding_box.extent.z, abs=0.01)
        assert one.bounding_box.rotation == one.transform.rotation


def test_names_are_those_of_the_listed_objects(world):
    names = world.get_names_of_all_objects()
    assert sorted(names) == sorted(one.name for one in world.get_environment_objects(LABEL.Any))
    assert len(set(names)) == len(names) > 100


def is_in(box: carla.BoundingBox, point: carla.Location) -> bool:
    """Within 5 cm; the client's own `contains` leaves the box's rotation out."""
    grown = carla.BoundingBox(carla.Location(), box.extent + carla.Vector3D(0.05, 0.05, 0.05))
    return grown.contains(point, carla.Transform(box.location, box.rotation))


def test_boxes_of_houses_contain_what_rays_from_the_road_meet(world):
    boxes, met = world.get_level_bbs(LABEL.Buildings), 0
    for point in world.get_map().get_spawn_points()[:40]:
        for way in (point.get_right_vector(), point.get_right_vector() * -1.0):
            hit = world.project_point(point.location + UP * 3.0, way, 60.0)
            if hit is not None and hit.label == LABEL.Buildings:
                met += 1
                assert any(is_in(box, hit.location) for box in boxes)
    assert met > 10


def test_lights_of_vehicles_are_told_for_all_at_once(site, world):
    cars = [spawn_car(world, index) for index in (0, 1)]
    world.tick()
    flags = carla.VehicleLightState
    wanted = carla.VehicleLightState(flags.HighBeam | flags.LeftBlinker)
    cars[0].set_light_state(wanted)
    world.tick()
    for seen in (world, connect(site.carla_port).get_world()):
        assert seen.get_vehicles_light_states() == {
            cars[0].id: wanted,
            cars[1].id: carla.VehicleLightState(flags.NONE),
        }


def test_a_taken_place_is_refused_and_free_again_when_its_owner_is_gone(world):
    car = spawn_car(world)
    world.tick()
    with pytest.raises(RuntimeError, match="Spawn failed because of collision at spawn position"):
        spawn_car(world)
    car.destroy()
    world.tick()
    assert spawn_car(world).type_id == car.type_id


def test_five_hundred_spawns_leave_nothing_behind(client, world):
    place = world.get_map().get_spawn_points()[0]
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    before = {actor.id for actor in world.get_actors()}
    ids = set()
    for _ in range(500):
        (spawned,) = client.apply_batch_sync([carla.command.SpawnActor(blueprint, place)], False)
        assert not spawned.error
        ids.add(spawned.actor_id)
        client.apply_batch_sync([carla.command.DestroyActor(spawned.actor_id)], False)
    world.tick()
    assert len(ids) == 500 and {actor.id for actor in world.get_actors()} == before


def test_random_places_for_walkers_are_on_sidewalks_and_follow_the_seed(world):
    places = []
    for seed in (5, 5, 6):
        world.set_pedestrians_seed(seed)
        places.append([world.get_random_location_from_navigation() for _ in range(10)])
    first, again, other = [[(at.x, at.y) for at in found] for found in places]
    assert first == again != other
    for place in places[0]:
        ground = world.ground_projection(place + UP, 3.0)
        assert ground.label == LABEL.Sidewalks
        assert ground.location.distance(place) < 0.3
