"""CARLA's own client spawns, drives, batches and destroys."""

import carla
import pytest

from carla_site import STEP_SECS, connect, spawn_car, ticks
from running_site import two_free_ports


def test_a_car_stands_where_it_was_spawned_with_what_it_was_given(world):
    place = world.get_map().get_spawn_points()[0]
    car = spawn_car(world, role_name="hero")
    world.tick()
    assert isinstance(car, carla.Vehicle)
    assert car.attributes["role_name"] == "hero"
    assert car.get_location().distance(place.location) < 1.0
    assert car.get_transform().rotation.yaw == pytest.approx(place.rotation.yaw, abs=1.0)
    assert 1.5 < car.bounding_box.extent.x < 3.5


def test_a_car_drives_forward_and_turns_to_the_side_of_the_wheel(world):
    car = spawn_car(world)
    ticks(world, 20)
    start = car.get_transform()
    car.apply_control(carla.VehicleControl(throttle=0.7))
    ticks(world, 60)
    assert car.get_velocity().length() > 3.0
    assert car.get_control().throttle == pytest.approx(0.7)
    way = car.get_location() - start.location
    assert way.dot(start.get_forward_vector()) > 3.0
    yaw_before = car.get_transform().rotation.yaw
    car.apply_control(carla.VehicleControl(throttle=0.4, steer=0.5))
    ticks(world, 15)
    turned = (car.get_transform().rotation.yaw - yaw_before + 180.0) % 360.0 - 180.0
    assert turned > 2.0, "positive steer turns right, and right is a growing yaw"
    assert car.get_angular_velocity().z > 2.0


def test_a_taken_place_is_refused_in_carlas_words(world):
    spawn_car(world)
    with pytest.raises(RuntimeError, match="collision at spawn position"):
        spawn_car(world)
    blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
    assert world.try_spawn_actor(blueprint, world.get_map().get_spawn_points()[0]) is None


def test_a_destroyed_car_is_gone(world):
    car = spawn_car(world)
    world.tick()
    assert car.destroy()
    world.tick()
    assert not world.get_snapshot().has_actor(car.id)
    assert len(world.get_actors().filter("vehicle.*")) == 0


def test_set_transform_holds_at_the_next_tick(world):
    car = spawn_car(world)
    world.tick()
    place = world.get_map().get_spawn_points()[5]
    car.set_transform(place)
    world.tick()
    assert car.get_location().distance(place.location) < 1.0


def test_a_batch_spawns_chains_and_destroys(client, world):
    blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
    points = world.get_map().get_spawn_points()[:8]
    future = carla.command.FutureActor
    control = carla.VehicleControl(throttle=1.0)
    commands = [
        carla.command.SpawnActor(blueprint, point).then(
            carla.command.ApplyVehicleControl(future, control)
        )
        for point in [*points, points[0]]
    ]
    responses = client.apply_batch_sync(commands, True)
    assert [bool(response.error) for response in responses] == [False] * 8 + [True]
    assert "collision" in responses[-1].error
    ticks(world, 40)
    ids = [response.actor_id for response in responses[:-1]]
    speeds = [actor.get_velocity().length() for actor in world.get_actors(ids)]
    assert len(speeds) == 8
    assert sum(speed > 2.0 for speed in speeds) >= 6
    gone = client.apply_batch_sync([carla.command.DestroyActor(id) for id in ids], True)
    assert not any(response.error for response in gone)
    world.tick()
    assert len(world.get_actors().filter("vehicle.*")) == 0


def test_actors_are_listed_filtered_and_found(world):
    cars = [spawn_car(world, index) for index in (0, 4)]
    world.tick()
    actors = world.get_actors()
    found = [actor.id for actor in actors.filter("vehicle.*")]
    assert sorted(found) == sorted(car.id for car in cars)
    assert [actors[at].id for at in range(len(actors))] == [actor.id for actor in actors]
    assert actors.find(cars[0].id).type_id == "vehicle.lincoln.mkz_2020"
    assert actors.find(99_999) is None and world.get_actor(99_999) is None
    assert len(actors.filter("vehicle.audi.*")) == 0
    assert [actor.id for actor in world.get_actors([cars[1].id, 99_999])] == [cars[1].id]
    assert {actor.id for actor in actors} == {one.id for one in world.get_snapshot()}
    with pytest.raises(IndexError):
        actors[len(actors)]


def test_an_actor_tells_of_the_frame_what_its_snapshot_does(world):
    car = spawn_car(world)
    car.apply_control(carla.VehicleControl(throttle=0.8, steer=0.3))
    ticks(world, 40)
    snapshot = world.get_snapshot().find(car.id)
    assert snapshot.id == car.id and world.get_snapshot().find(99_999) is None
    assert snapshot.get_transform() == car.get_transform()
    assert snapshot.get_velocity() == car.get_velocity()
    assert snapshot.get_angular_velocity() == car.get_angular_velocity()
    assert snapshot.get_acceleration() == car.get_acceleration()
    before, place = car.get_velocity(), car.get_location()
    world.tick()
    change = (car.get_velocity() - before) / STEP_SECS
    assert change.length() > 0.2
    assert (car.get_acceleration() - change).length() < 1e-3
    mean = (car.get_velocity() + before) / 2
    assert ((car.get_location() - place) / STEP_SECS).distance(mean) < 0.2


def test_an_actor_says_what_it_is(world):
    car = spawn_car(world)
    world.tick()
    label = carla.CityObjectLabel
    thing = world.get_blueprint_library().find("static.prop.constructioncone")
    cone = world.spawn_actor(thing, world.get_map().get_spawn_points()[4])
    assert type(cone) is carla.Actor and cone.type_id == "static.prop.constructioncone"
    assert car.is_alive and car.is_active and not car.is_dormant
    assert car.actor_state == carla.ActorState.Active
    assert list(car.semantic_tags) == [int(label.Car)]
    assert car.parent is None and car.get_world().id == world.id
    assert car.bounding_box.actor_id == car.id
    bike = world.get_blueprint_library().find("vehicle.yamaha.yzf")
    rider = world.spawn_actor(bike, world.get_map().get_spawn_points()[8])
    assert int(label.Motorcycle) in list(rider.semantic_tags)
    assert rider.bounding_box.extent.y < 0.6 < car.bounding_box.extent.y


def test_boxes_of_actors_contain_what_is_inside_them(world):
    car = spawn_car(world)
    ticks(world, 10)
    box, here = car.bounding_box, car.get_transform()
    corners = box.get_world_vertices(here)
    assert len(corners) == len(box.get_local_vertices()) == 8
    middle = sum((carla.Vector3D(at.x, at.y, at.z) for at in corners), carla.Vector3D()) / 8
    # The client transforms in place.
    assert middle.distance(here.transform(carla.Location(box.location))) < 1e-3
    assert box.contains(here.location + carla.Location(z=0.5), here)
    assert not box.contains(here.location + carla.Location(y=1.5), here)
    lowest = min(corner.z for corner in corners)
    assert lowest == pytest.approx(here.location.z, abs=0.1)
    for corner in corners:
        back = here.inverse_transform(corner)
        assert abs(back.x - box.location.x) == pytest.approx(box.extent.x, abs=1e-3)
        assert abs(back.y - box.location.y) == pytest.approx(box.extent.y, abs=1e-3)


def test_light_state_is_read_by_who_wrote_it(world):
    car = spawn_car(world)
    world.tick()
    lights = carla.VehicleLightState(carla.VehicleLightState.LowBeam)
    car.set_light_state(lights)
    assert car.get_light_state() == lights


def test_the_traffic_manager_drives_cars_in_synchronous_mode(client, world):
    manager = client.get_trafficmanager(two_free_ports())
    manager.set_synchronous_mode(True)
    manager.set_random_device_seed(7)
    cars = [spawn_car(world, index) for index in range(0, 12, 3)]
    world.tick()
    for car in cars:
        car.set_autopilot(True, manager.get_port())
    starts = [car.get_location() for car in cars]
    ticks(world, 200)
    moved = [car.get_location().distance(start) for car, start in zip(cars, starts, strict=True)]
    assert sum(metres > 5.0 for metres in moved) >= 3, moved
    for car in cars:
        car.set_autopilot(False, manager.get_port())
    manager.shut_down()


def test_a_walkers_controller_starts_only_where_the_client_finds_a_way(world):
    """From elsewhere the client would look for one until its stack is full."""
    library = world.get_blueprint_library()
    pedestrian = library.filter("walker.pedestrian.*")[0]
    controller = library.find("controller.ai.walker")
    outside = world.get_map().get_spawn_points()[0].location + carla.Location(x=5_000.0)
    walker = world.spawn_actor(pedestrian, carla.Transform(outside))
    world.tick()
    strays = world.spawn_actor(controller, carla.Transform(), attach_to=walker)
    with pytest.raises(RuntimeError, match="more than 12 m away from all sidewalks"):
        strays.start()
    inside = carla.Transform(world.get_random_location_from_navigation())
    walker = world.spawn_actor(pedestrian, inside)
    world.tick()
    strolls = world.spawn_actor(controller, carla.Transform(), attach_to=walker)
    strolls.start()
    strolls.stop()


def test_cars_have_real_tyres_where_the_site_is_told_so(start_site):
    site = start_site("--no-render", "--cars", "real")
    world = connect(site.carla_port).get_world()
    blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
    car = world.spawn_actor(blueprint, world.get_map().get_spawn_points()[0])
    wheels = car.get_physics_control().wheels
    assert all(0.8 < wheel.tire_friction < 1.2 for wheel in wheels)
    assert all(20.0 < wheel.max_steer_angle < 45.0 for wheel in wheels[:2])


def test_cars_have_carlas_tyres(start_site):
    site = start_site("--no-render")
    world = connect(site.carla_port).get_world()
    library, places = world.get_blueprint_library(), world.get_map().get_spawn_points()
    blueprint = library.find("vehicle.tesla.model3")
    alone = world.spawn_actor(blueprint, places[0])
    batch = carla.command.SpawnActor(blueprint, places[1])
    client = connect(site.carla_port)
    (response,) = client.apply_batch_sync([batch], False)
    for car in (alone, client.get_world().get_actor(response.actor_id)):
        wheels = car.get_physics_control().wheels
        assert [round(wheel.tire_friction, 2) for wheel in wheels] == [3.5] * 4
        assert [round(wheel.max_steer_angle) for wheel in wheels] == [70, 70, 0, 0]
    bike = world.spawn_actor(library.find("vehicle.kawasaki.ninja"), places[2])
    assert all(wheel.tire_friction < 2.0 for wheel in bike.get_physics_control().wheels)
