"""The commands of a batch through CARLA's own client: what each does, and what refused ones say."""

import time

import carla
import pytest

from carla_site import STEP_SECS, connect, spawn_car, ticks
from running_site import two_free_ports

cmd = carla.command
SOON_SECS = 30.0
GONE = 99_999
NOT_FOUND = "Actor could not be found in the registry.  Actor Id: 99999"
WRONG_TYPE = "Actor does not match the expected type.  Actor Id: {}"


def run(client: carla.Client, *commands) -> list:
    """Their responses, none of which is an error, when the frame after them was seen."""
    world = client.get_world()
    before = world.get_snapshot().frame
    responses = client.apply_batch_sync(list(commands), True)
    deadline = time.monotonic() + SOON_SECS
    while world.get_snapshot().frame == before and time.monotonic() < deadline:
        time.sleep(0.001)
    assert [response.error for response in responses] == [""] * len(commands)
    return responses


def spawn_walker(world: carla.World, index: int = 3) -> carla.Walker:
    blueprint = world.get_blueprint_library().find("walker.pedestrian.0001")
    place = world.get_map().get_spawn_points()[index]
    place.location.z += 1.0
    return world.spawn_actor(blueprint, place)


def test_commands_drive_cars(client, world):
    car, other = spawn_car(world, 0), spawn_car(world, 5)
    ticks(world, 20)
    gears = car.get_physics_control()
    gears.mass = 2_500.0
    lights = carla.VehicleLightState(carla.VehicleLightState.Fog)
    run(
        client,
        cmd.ApplyVehicleControl(car, carla.VehicleControl(throttle=0.7)),
        cmd.ApplyVehicleAckermannControl(other.id, carla.VehicleAckermannControl(speed=4.0)),
        cmd.ApplyVehiclePhysicsControl(car, gears),
        # With an actor instead of its id the client makes a truth value of the lights.
        cmd.SetVehicleLightState(car.id, lights),
    )
    assert car.get_control().throttle == pytest.approx(0.7)
    assert car.get_light_state() == lights
    assert world.get_vehicles_light_states()[car.id] == lights
    assert car.get_physics_control().mass == 2_500.0
    ticks(world, 60)
    assert car.get_velocity().length() > 2.0
    assert other.get_velocity().length() > 2.0


def test_commands_move_bodies(client, world):
    car = spawn_car(world)
    world.tick()
    mass = car.get_physics_control().mass
    place = carla.Transform(car.get_location() + carla.Location(z=20.0), carla.Rotation(yaw=30.0))
    run(
        client,
        cmd.SetEnableGravity(car, False),
        cmd.ApplyTransform(car, place),
        cmd.ApplyTargetVelocity(car, carla.Vector3D(x=2.0)),
        cmd.ApplyTargetAngularVelocity(car, carla.Vector3D()),
    )
    assert car.get_transform().rotation.yaw == pytest.approx(30.0, abs=0.01)
    assert car.get_location().z == pytest.approx(place.location.z, abs=0.01)
    assert car.get_velocity().x == pytest.approx(2.0, abs=0.01)
    run(
        client,
        cmd.ApplyImpulse(car, carla.Vector3D(y=mass)),
        cmd.ApplyForce(car, carla.Vector3D(z=mass / STEP_SECS)),
    )
    velocity = car.get_velocity()
    assert (velocity.x, velocity.y, velocity.z) == pytest.approx((2.0, 1.0, 1.0), abs=0.02)
    run(client, cmd.ApplyAngularImpulse(car, carla.Vector3D(z=6e8)))
    spin = car.get_angular_velocity().z
    assert spin > 10.0
    run(client, cmd.ApplyTorque(car, carla.Vector3D(z=-6e8 / STEP_SECS)))
    assert car.get_angular_velocity().z == pytest.approx(0.0, abs=0.02 * spin)
    run(client, cmd.SetSimulatePhysics(car, False))
    still = car.get_location()
    ticks(world, 5)
    assert car.get_location().distance(still) < 1e-3


def test_commands_move_walkers(client, world):
    walker = spawn_walker(world)
    ticks(world, 10)
    start = walker.get_location()
    run(client, cmd.ApplyWalkerControl(walker, carla.WalkerControl(carla.Vector3D(y=1.0), 1.5)))
    ticks(world, 40)
    way = walker.get_location() - start
    assert way.y == pytest.approx(1.5 * 41 * STEP_SECS, rel=0.15) and abs(way.x) < 0.1
    feet = start - carla.Location(z=walker.bounding_box.extent.z)
    stand = carla.Transform(feet, carla.Rotation(yaw=90.0))
    run(client, cmd.ApplyWalkerState(walker, stand, 0.5))
    assert walker.get_control().speed == pytest.approx(0.5)
    assert walker.get_location().distance(start) < 0.2
    assert walker.get_transform().rotation.yaw == pytest.approx(90.0, abs=1.0)


def test_a_spawn_is_followed_by_its_commands(client, world):
    library, places = world.get_blueprint_library(), world.get_map().get_spawn_points()
    future = cmd.FutureActor
    lights = carla.VehicleLightState(carla.VehicleLightState.HighBeam)
    imu = library.find("sensor.other.imu")
    spawn = (
        cmd.SpawnActor(library.find("vehicle.tesla.model3"), places[0])
        .then(cmd.SetVehicleLightState(future, lights))
        .then(cmd.SetSimulatePhysics(future, False))
        .then(cmd.ApplyTargetVelocity(future, carla.Vector3D(x=4.0)))
        .then(cmd.SpawnActor(imu, carla.Transform(carla.Location(z=2.0)), future))
    )
    (response,) = run(client, spawn)
    car = world.get_actor(response.actor_id)
    assert not response.has_error() and isinstance(car, carla.Vehicle)
    assert car.get_light_state() == lights
    assert car.get_velocity().x == pytest.approx(4.0)
    (sensor,) = world.get_actors().filter("sensor.other.imu")
    assert sensor.parent.id == car.id
    assert sensor.get_location().z - car.get_location().z == pytest.approx(2.0, abs=1e-3)


def test_autopilot_and_destruction_in_a_batch(client, world):
    manager = client.get_trafficmanager(two_free_ports())
    manager.set_synchronous_mode(True)
    car = spawn_car(world)
    world.tick()
    start = car.get_location()
    run(client, cmd.SetAutopilot(car, True, manager.get_port()))
    ticks(world, 100)
    assert car.get_location().distance(start) > 3.0
    run(client, cmd.SetAutopilot(car, False, manager.get_port()))
    run(client, cmd.DestroyActor(car))
    manager.shut_down()
    assert world.get_actor(car.id) is None or not world.get_snapshot().has_actor(car.id)


def test_refused_commands_say_why_in_carlas_words(client, world):
    car, walker = spawn_car(world), spawn_walker(world)
    world.tick()
    library, place = world.get_blueprint_library(), car.get_transform()
    blueprint, imu = library.find("vehicle.audi.tt"), library.find("sensor.other.imu")
    control, stroll = carla.VehicleControl(), carla.WalkerControl()
    refused = {
        cmd.ApplyVehicleControl(GONE, control): f"apply_control_to_vehicle: {NOT_FOUND}",
        cmd.ApplyWalkerControl(GONE, stroll): f"apply_control_to_walker: {NOT_FOUND}",
        cmd.ApplyTransform(GONE, place): f"set_actor_transform: {NOT_FOUND}",
        cmd.ApplyImpulse(GONE, carla.Vector3D()): f"add_actor_impulse: {NOT_FOUND}",
        cmd.SetSimulatePhysics(GONE, True): f"set_actor_simulate_physics: {NOT_FOUND}",
        cmd.ApplyVehicleControl(walker, control): (
            f"apply_control_to_vehicle: {WRONG_TYPE.format(walker.id)}"
        ),
        cmd.ApplyVehiclePhysicsControl(walker, car.get_physics_control()): (
            f"apply_physics_control: {WRONG_TYPE.format(walker.id)}"
        ),
        cmd.ApplyWalkerState(car, place, 1.0): f"set_walker_state: {WRONG_TYPE.format(car.id)}",
    }
    responses = client.apply_batch_sync([*refused, cmd.SetEnableGravity(car, True)], False)
    wanted = [f"Responding error from function {text}" for text in refused.values()]
    assert [response.error for response in responses] == [*wanted, ""]
    assert all(response.has_error() for response in responses[:-1])
    assert responses[-1].actor_id == car.id
    about_life = {
        cmd.DestroyActor(GONE): "unable to destroy actor: not found",
        cmd.SpawnActor(blueprint, place): "Spawn failed because of collision at spawn position",
        cmd.SpawnActor(imu, place, GONE): "unable to attach actor: parent actor not found",
    }
    responses = client.apply_batch_sync(list(about_life), False)
    assert [response.error for response in responses] == list(about_life.values())


def test_debug_telemetry_is_no_command_of_the_wheel(client, world):
    with pytest.raises(TypeError, match="ShowDebugTelemetry"):
        client.apply_batch([cmd.ShowDebugTelemetry(1, True)])


def test_calls_about_what_another_client_destroyed_say_so(site, client, world):
    car = spawn_car(world)
    world.tick()
    other = connect(site.carla_port).get_world().get_actor(car.id)
    assert car.destroy() and not car.is_alive
    for call in (car.destroy, car.get_location, car.get_physics_control):
        with pytest.raises(RuntimeError, match="trying to operate on a destroyed actor"):
            call()
    with pytest.raises(RuntimeError) as refusal:
        other.get_physics_control()
    assert str(refusal.value) == (
        "Responding error from function get_physics_control: Actor could not be found in the "
        f"registry.  Actor Id: {car.id}"
    )
    assert other.bounding_box.extent.x == 0.0
    assert not other.destroy()
