"""Collisions, crossed lines and obstacles as CARLA's own client hears of them."""

import contextlib
import queue

import carla
import pytest

from carla_site import attach, spawn_car, ticks

WAIT_SECS = 30.0
# Events come within milliseconds of the tick or not at all.
SOON_SECS = 0.3


def events(measured: queue.Queue, at_least: int = 0) -> list:
    """All that came of the ticks so far."""
    found = [measured.get(timeout=WAIT_SECS) for _ in range(at_least)]
    with contextlib.suppress(queue.Empty):
        while True:
            found.append(measured.get(timeout=SOON_SECS))
    return found


def two_cars(world: carla.World, apart_m: float) -> tuple[carla.Vehicle, carla.Vehicle]:
    """One behind the other, `apart_m` between their middles."""
    behind = spawn_car(world)
    place = world.get_map().get_spawn_points()[0]
    place.location += place.get_forward_vector() * apart_m
    ahead = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), place)
    ticks(world, 60)
    return behind, ahead


def place_before_a_house(world: carla.World) -> carla.Transform:
    """A place 8 m from the wall of a house, and turned to it."""
    for house in world.get_environment_objects(carla.CityObjectLabel.Buildings):
        box = house.bounding_box
        sideways = carla.Transform(carla.Location(), box.rotation).get_right_vector()
        for side in (1.0, -1.0):
            start = box.location + sideways * (side * (box.extent.y + 8.0))
            start.z = 1.0
            below = world.ground_projection(start, 5.0)
            ahead = world.project_point(start, sideways * -side, 9.0)
            if below is None or ahead is None or ahead.label != house.type:
                continue
            yaw = box.rotation.yaw - side * 90.0
            place = carla.Transform(below.location, carla.Rotation(yaw=yaw))
            place.location.z += 0.3
            probe = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
            car = world.try_spawn_actor(probe, place)
            if car is not None:
                world.tick()
                car.destroy()
                world.tick()
                return place
    raise AssertionError("no house has free ground before it")


def test_both_cars_of_a_collision_feel_the_same_impulse_in_opposite_directions(world):
    cars = two_cars(world, 9.0)
    feelers = [attach(world, car, "sensor.other.collision") for car in cars]
    forward = cars[0].get_transform().get_forward_vector()
    cars[0].set_target_velocity(forward * 8.0)
    speeds = {}
    for _ in range(20):
        frame = world.tick()
        speeds[frame] = [car.get_velocity().dot(forward) for car in cars]
    behind, ahead = (events(measured, 1)[0] for _, measured in feelers)
    assert behind.frame == ahead.frame
    assert (behind.actor.id, behind.other_actor.id) == tuple(car.id for car in cars)
    assert (ahead.actor.id, ahead.other_actor.id) == tuple(car.id for car in reversed(cars))
    assert (behind.normal_impulse + ahead.normal_impulse).length() < 1.0
    before, after = speeds[behind.frame - 1], speeds[behind.frame]
    for at, felt in enumerate((behind, ahead)):
        change_ns = cars[at].get_physics_control().mass * (after[at] - before[at])
        assert felt.normal_impulse.dot(forward) == pytest.approx(change_ns, rel=0.2)
    for sensor, _ in feelers:
        sensor.destroy()


def test_a_house_that_is_run_into_has_no_actor_but_a_tag(world):
    place = place_before_a_house(world)
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    car = world.spawn_actor(blueprint, place)
    sensor, measured = attach(world, car, "sensor.other.collision")
    car.enable_constant_velocity(carla.Vector3D(10.0, 0.0, 0.0))
    ticks(world, 40)
    felt = events(measured, 1)[0]
    other = felt.other_actor
    assert other.type_id == "static.building"
    assert list(other.semantic_tags) == [int(carla.CityObjectLabel.Buildings)]
    assert world.get_actor(other.id) is None
    assert felt.normal_impulse.dot(place.get_forward_vector()) < 0.0
    sensor.destroy()


@pytest.mark.parametrize(("reach_m", "is_seen"), [("20", True), ("5", False)])
def test_an_obstacle_is_as_far_as_the_gap_to_it(world, reach_m, is_seen):
    behind, ahead = two_cars(world, 16.0)
    nose = carla.Transform(carla.Location(x=2.5, z=0.7))
    wanted = {"distance": reach_m, "hit_radius": "0.1", "only_dynamics": "true"}
    sensor, measured = attach(world, behind, "sensor.other.obstacle", nose, **wanted)
    world.tick()
    found = events(measured, int(is_seen))
    assert len(found) == is_seen
    for event in found:
        gap_m = ahead.get_location().distance(sensor.get_location()) - ahead.bounding_box.extent.x
        assert event.other_actor.id == ahead.id
        # The ball stops where its surface touches.
        assert event.distance + 0.1 == pytest.approx(gap_m, abs=0.05)
    sensor.destroy()


def test_only_dynamics_leaves_houses_out(world):
    place = place_before_a_house(world)
    place.location.z += 1.0
    seen = {}
    for only in ("true", "false"):
        wanted = {"distance": "20", "only_dynamics": only}
        sensor, measured = attach(world, None, "sensor.other.obstacle", place, **wanted)
        world.tick()
        seen[only] = events(measured, int(only == "false"))
        sensor.destroy()
    assert not seen["true"]
    (event,) = seen["false"]
    wall = world.project_point(place.location, place.get_forward_vector(), 20.0)
    assert event.distance == pytest.approx(wall.location.distance(place.location) - 0.5, abs=0.05)


def test_a_line_is_crossed_once_and_tells_its_paint(world):
    town = world.get_map()
    lanes = ((point, town.get_waypoint(point.location)) for point in town.get_spawn_points())
    marks = carla.LaneMarkingType
    place, lane = next(
        (point, lane)
        for point, lane in lanes
        if lane.left_lane_marking.type == marks.Broken
        and lane.get_left_lane().lane_id * lane.lane_id > 0
    )
    car = spawn_car(world)
    car.set_simulate_physics(False)
    car.set_transform(place)
    ticks(world, 2)
    sensor, crossings = attach(world, car, "sensor.other.lane_invasion")
    aside = place.get_right_vector() * -1.0
    way_m = lane.lane_width
    for step in range(1, 11):
        to = place.location + aside * (way_m * step / 10)
        car.set_transform(carla.Transform(to, place.rotation))
        world.tick()
    found = events(crossings, 2)
    crossed = {mark.type for event in found for mark in event.crossed_lane_markings}
    assert crossed == {marks.Broken}
    assert {mark.color for event in found for mark in event.crossed_lane_markings} == {
        lane.left_lane_marking.color
    }
    # The left wheels and the right ones.
    assert len(found) == 2
    sensor.stop()
