"""What clients do to bodies through CARLA's own client: pushes, velocities, switches, places."""

import carla
import pytest

from carla_site import STEP_SECS, spawn_car, ticks

ALOFT = carla.Location(z=30.0)


def vector(found: carla.Vector3D) -> tuple[float, float, float]:
    return found.x, found.y, found.z


@pytest.fixture
def floater(world):
    """A car high above the road that does not fall."""
    car = spawn_car(world)
    world.tick()
    set_free(world, car)
    return car


def set_free(world: carla.World, car: carla.Vehicle) -> None:
    """Back to where it floats, without any motion."""
    start = world.get_map().get_spawn_points()[0]
    car.set_enable_gravity(False)
    car.set_transform(carla.Transform(start.location + ALOFT))
    car.set_target_velocity(carla.Vector3D())
    car.set_target_angular_velocity(carla.Vector3D())
    world.tick()


def test_an_impulse_changes_the_velocity_by_itself_over_the_mass(world, floater):
    mass = floater.get_physics_control().mass
    for wanted in ((3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0)):
        set_free(world, floater)
        floater.add_impulse(carla.Vector3D(*wanted) * mass)
        world.tick()
        assert vector(floater.get_velocity()) == pytest.approx(wanted, abs=0.01)
        felt = tuple(speed / STEP_SECS for speed in wanted)
        assert vector(floater.get_acceleration()) == pytest.approx(felt, abs=0.1)
        world.tick()
        assert floater.get_acceleration().length() < 0.1


def test_a_force_works_for_one_tick(world, floater):
    mass = floater.get_physics_control().mass
    floater.add_force(carla.Vector3D(y=4.0 * mass))
    world.tick()
    assert floater.get_velocity().y == pytest.approx(4.0 * STEP_SECS, rel=0.01)
    assert floater.get_acceleration().y == pytest.approx(4.0, rel=0.01)
    ticks(world, 5)
    assert floater.get_velocity().y == pytest.approx(4.0 * STEP_SECS, rel=0.01)


def test_twists_are_in_degrees_and_square_centimetres(world, floater):
    """As Unreal has them. The client sends `add_torque` as an angular impulse."""
    amount = carla.Vector3D(z=6e8)
    floater.add_angular_impulse(amount)
    world.tick()
    spin = floater.get_angular_velocity().z
    inertia_kgm2 = amount.z * 1e-4 / spin
    assert 2_000.0 < inertia_kgm2 < 4_000.0, "of a car of 1.8 t"
    assert floater.get_transform().rotation.yaw == pytest.approx(spin * STEP_SECS, rel=0.05)
    set_free(world, floater)
    floater.add_torque(amount)
    world.tick()
    assert floater.get_angular_velocity().z == pytest.approx(spin, rel=0.01)


def test_a_target_velocity_is_there_at_once_and_stays(world, floater):
    wanted = (5.0, -2.0, 1.0)
    floater.set_target_velocity(carla.Vector3D(*wanted))
    start = floater.get_location()
    ticks(world, 20)
    assert vector(floater.get_velocity()) == pytest.approx(wanted, abs=0.02)
    assert vector(floater.get_location() - start) == pytest.approx(wanted, abs=0.05)


def test_an_angular_velocity_turns_as_unreal_turns(world, floater):
    for axis, angle, sign in (("x", "roll", -1), ("y", "pitch", -1), ("z", "yaw", 1)):
        set_free(world, floater)
        floater.set_target_angular_velocity(carla.Vector3D(**{axis: 40.0}))
        ticks(world, 10)
        assert getattr(floater.get_angular_velocity(), axis) == pytest.approx(40.0, abs=0.5)
        turned = getattr(floater.get_transform().rotation, angle)
        assert turned == pytest.approx(sign * 40.0 * 10 * STEP_SECS, abs=0.5)


def test_a_constant_velocity_holds_in_the_frame_of_the_actor(world):
    car = spawn_car(world)
    ticks(world, 20)
    car.enable_constant_velocity(carla.Vector3D(x=7.0))
    car.apply_control(carla.VehicleControl(brake=1.0))
    for _ in range(20):
        world.tick()
        assert car.get_velocity().length() == pytest.approx(7.0, abs=0.05)
    way = car.get_transform().get_forward_vector()
    assert car.get_velocity().dot(way) == pytest.approx(7.0, abs=0.05)
    car.disable_constant_velocity()
    ticks(world, 40)
    assert car.get_velocity().length() < 1.0


def test_without_collisions_cars_pass_through_each_other(world):
    ghost, wall = spawn_car(world, 0), spawn_car(world, 5)
    ticks(world, 30)
    place = wall.get_transform()
    ghost.set_collisions(False)
    behind = place.location - 12.0 * place.get_forward_vector()
    ghost.set_transform(carla.Transform(behind, place.rotation))
    ghost.enable_constant_velocity(carla.Vector3D(x=20.0))
    ticks(world, 24)
    assert (ghost.get_location() - place.location).dot(place.get_forward_vector()) > 8.0
    assert wall.get_location().distance(place.location) < 0.1


def test_without_gravity_nothing_falls_and_with_it_things_do(world, floater):
    height = floater.get_location().z
    ticks(world, 20)
    assert floater.get_location().z == pytest.approx(height, abs=0.01)
    floater.set_enable_gravity(True)
    ticks(world, 20)
    assert height - floater.get_location().z == pytest.approx(9.81 / 2, rel=0.07)


def test_without_physics_an_actor_stays_and_tells_the_velocity_it_is_given(world):
    car = spawn_car(world)
    world.tick()
    car.set_simulate_physics(False)
    place = carla.Transform(car.get_location() + ALOFT, carla.Rotation(pitch=10.0, yaw=70.0))
    car.set_transform(place)
    car.apply_control(carla.VehicleControl(throttle=1.0))
    car.set_target_velocity(carla.Vector3D(x=3.0))
    ticks(world, 20)
    assert car.get_location().distance(place.location) < 1e-3
    rotation = car.get_transform().rotation
    assert (rotation.pitch, rotation.yaw) == pytest.approx((10.0, 70.0), abs=1e-3)
    assert vector(car.get_velocity()) == pytest.approx((3.0, 0.0, 0.0))
    car.set_simulate_physics(True)
    ticks(world, 10)
    assert place.location.z - car.get_location().z > 1.0


def test_a_new_location_keeps_the_rotation_of_the_same_frame(world, floater):
    place = floater.get_transform()
    floater.set_transform(carla.Transform(place.location, carla.Rotation(yaw=60.0)))
    floater.set_location(place.location + carla.Location(x=7.0))
    world.tick()
    assert vector(floater.get_location() - place.location) == pytest.approx((7, 0, 0), abs=1e-3)
    assert floater.get_transform().rotation.yaw == pytest.approx(60.0, abs=1e-3)


def test_what_is_attached_is_placed_in_the_frame_of_its_parent(world, floater):
    library = world.get_blueprint_library()
    yaw = carla.Rotation(yaw=50.0)
    floater.set_transform(carla.Transform(floater.get_location(), yaw))
    at = carla.Transform(carla.Location(x=1.0, z=2.0), carla.Rotation(yaw=30.0))
    sensor = world.spawn_actor(library.find("sensor.other.imu"), at, attach_to=floater)
    world.tick()
    assert sensor.parent.id == floater.id
    here = floater.get_transform()
    assert sensor.get_location().distance(here.transform(at.location)) < 1e-3
    assert sensor.get_transform().rotation.yaw == pytest.approx(80.0, abs=1e-3)
    moved = carla.Location(x=-1.0, y=0.5, z=1.0)
    sensor.set_location(moved)
    world.tick()
    assert sensor.get_location().distance(here.transform(moved)) < 1e-3
    assert sensor.get_transform().rotation.yaw == pytest.approx(80.0, abs=1e-3)
    floater.set_target_velocity(carla.Vector3D(x=2.0))
    world.tick()
    assert sensor.get_velocity().x == pytest.approx(2.0, abs=0.01)
    assert floater.destroy()
    world.tick()
    assert world.get_actor(sensor.id) is not None, "as in CARLA children outlive their parents"


def test_a_thing_falls_and_is_pushed_once_its_physics_is_on(world):
    blueprint = world.get_blueprint_library().find("static.prop.box01")
    place = world.get_map().get_spawn_points()[0].location + carla.Location(z=3.0)
    box = world.spawn_actor(blueprint, carla.Transform(place))
    ticks(world, 10)
    assert box.get_location().distance(place) < 1e-3
    box.set_simulate_physics(True)
    ticks(world, 60)
    on_ground = box.get_location().z
    assert on_ground < place.z - 2.0
    box.add_impulse(carla.Vector3D(z=50.0))
    ticks(world, 4)
    assert box.get_location().z > on_ground + 0.1
