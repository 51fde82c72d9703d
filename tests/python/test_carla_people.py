"""Walkers through CARLA's own client: what their control and their controllers make them do."""

import carla
import pytest

from carla_site import STEP_SECS, ticks


def spawn_walker(world: carla.World, place: carla.Location) -> carla.Walker:
    blueprint = world.get_blueprint_library().find("walker.pedestrian.0005")
    return world.spawn_actor(blueprint, carla.Transform(place + carla.Location(z=1.0)))


@pytest.fixture
def walker(world):
    """One that stands on the road."""
    found = spawn_walker(world, world.get_map().get_spawn_points()[0].location)
    ticks(world, 20)
    return found


def test_a_new_walker_looks_east_and_stands(walker):
    control = walker.get_control()
    assert (control.direction.x, control.speed, control.jump) == (1.0, 0.0, False)
    assert walker.get_velocity().length() < 0.01
    assert walker.bounding_box.extent.z == pytest.approx(0.9, abs=0.15)
    assert list(walker.semantic_tags) == [int(carla.CityObjectLabel.Pedestrians)]


def test_a_walker_walks_where_and_as_fast_as_it_is_told(world, walker):
    for direction, speed, yaw in (((1, 0), 1.4, 0.0), ((0, 1), 2.5, 90.0), ((-1, 0), 0.8, 180.0)):
        way = carla.Vector3D(*map(float, direction), 0.0)
        walker.apply_control(carla.WalkerControl(way, speed))
        ticks(world, 10)
        start = walker.get_location()
        ticks(world, 20)
        moved = walker.get_location() - start
        assert moved.dot(way) == pytest.approx(speed * 20 * STEP_SECS, rel=0.02)
        assert moved.length() == pytest.approx(moved.dot(way), rel=0.02)
        assert walker.get_velocity().dot(way) == pytest.approx(speed, rel=0.02)
        assert abs(walker.get_transform().rotation.yaw) == pytest.approx(yaw, abs=2.0)
        assert walker.get_control().speed == pytest.approx(speed)
    walker.apply_control(carla.WalkerControl())
    ticks(world, 20)
    assert walker.get_velocity().length() < 0.01


def test_the_length_of_a_direction_counts(world, walker):
    for direction, speed, wanted in (
        ((0.5, 0.0, 0.0), 3.0, 1.5),
        ((0.0, -2.0, 1.0), 1.2, 2.4),
        ((0.0, 0.0, 1.0), 2.0, 0.0),
    ):
        walker.apply_control(carla.WalkerControl(carla.Vector3D(*direction), speed))
        ticks(world, 30)
        assert walker.get_velocity().length() == pytest.approx(wanted, abs=0.03)
        told = walker.get_control()
        assert (told.direction.x, told.direction.y, told.direction.z) == direction
        assert told.speed == pytest.approx(speed)


def test_a_walker_jumps_until_it_is_told_otherwise(world, walker):
    ground = walker.get_location().z

    def heights(jump):
        walker.apply_control(carla.WalkerControl(carla.Vector3D(x=1.0), 0.0, jump))
        told = []
        for _ in range(60):
            world.tick()
            told.append(walker.get_location().z - ground)
        return told

    jumping = heights(True)
    assert 1.1 < max(jumping) < 1.4
    assert max(jumping[30:]) > 1.1
    assert max(heights(False)[40:]) < 0.1


def test_a_walker_is_put_elsewhere_and_stands_there(world, walker):
    place = world.get_map().get_spawn_points()[7].location + carla.Location(z=1.0)
    walker.set_transform(carla.Transform(place, carla.Rotation(yaw=45.0)))
    world.tick()
    assert walker.get_location().distance_2d(place) < 0.01
    assert walker.get_transform().rotation.yaw == pytest.approx(45.0, abs=0.1)
    walker.set_simulate_physics(False)
    walker.set_location(place + carla.Location(z=10.0))
    ticks(world, 10)
    assert walker.get_location().distance(place + carla.Location(z=10.0)) < 1e-3


def test_a_controller_leads_a_walker_to_its_goal_at_its_speed(world):
    start = world.get_random_location_from_navigation()
    goals = (world.get_random_location_from_navigation() for _ in range(1_000))
    goal = next(goal for goal in goals if 8.0 < goal.distance(start) < 20.0)
    walker = spawn_walker(world, start)
    world.tick()
    blueprint = world.get_blueprint_library().find("controller.ai.walker")
    controller = world.spawn_actor(blueprint, carla.Transform(), attach_to=walker)
    assert isinstance(controller, carla.WalkerAIController)
    assert controller.parent.id == walker.id
    world.tick()
    controller.start()
    controller.go_to_location(goal)
    controller.set_max_speed(1.8)
    fastest, nearest = 0.0, start.distance_2d(goal)
    for _ in range(1_500):
        world.tick()
        fastest = max(fastest, walker.get_velocity().length())
        nearest = min(nearest, walker.get_location().distance_2d(goal))
        if nearest < 1.0:
            break
    assert nearest < 1.0
    assert fastest == pytest.approx(1.8, abs=0.2)
    controller.stop()
    left = walker.get_location()
    ticks(world, 20)
    assert walker.get_location().distance(left) < 0.1
    assert walker.get_velocity().length() < 0.01
    assert controller.destroy()
