"""CARLA's own client connects, reads the world, and turns its clock."""

import statistics

import carla
import pytest

from carla_site import connect, spawn_car, ticks


def test_the_official_client_takes_us_for_its_server(client):
    assert client.get_server_version() == client.get_client_version() == "0.9.16"
    assert any(name.endswith("/Town10HD_Opt") for name in client.get_available_maps())
    assert client.get_world().get_map().name.endswith("Town10HD_Opt")


def test_the_map_has_places_to_start_on_its_lanes(world):
    town = world.get_map()
    points = town.get_spawn_points()
    assert len(points) > 20
    for point in points:
        on_lane = town.get_waypoint(point.location).transform.location
        assert on_lane.distance(point.location) < 1.0


def test_places_to_start_are_some_millimetres_beside_the_middle_of_their_lane(world):
    """As CARLA's are: programs divide by differences of coordinates."""
    town = world.get_map()
    sides, turns = [], []
    for point in town.get_spawn_points():
        lane = town.get_waypoint(point.location).transform
        seen = point.location - lane.location
        sides.append(seen.dot(lane.get_right_vector()))
        turns.append((point.rotation.yaw - lane.rotation.yaw + 180.0) % 360.0 - 180.0)
    assert min(sides) < 0.0 < max(sides) and 0.0 not in sides + turns
    # The client's lanes differ from ours in bends.
    assert statistics.median(map(abs, sides)) == pytest.approx(0.003, abs=0.001)
    assert statistics.median(map(abs, turns)) == pytest.approx(0.002, abs=0.001)


def test_every_blueprint_can_be_read(world):
    library = world.get_blueprint_library()
    assert len(library.filter("vehicle.*")) >= 40
    assert len(library.filter("walker.pedestrian.*")) >= 40
    hero = library.find("vehicle.tesla.model3")
    assert hero.get_attribute("number_of_wheels").as_int() == 4
    with pytest.raises(IndexError):
        library.find("vehicle.of.nobody")


def test_frames_count_ticks_and_deltas_are_exact(world):
    first = world.tick()
    assert world.tick() == first + 1
    stamp = world.get_snapshot().timestamp
    assert stamp.frame == first + 1
    assert stamp.delta_seconds == pytest.approx(0.05, abs=1e-7)
    before = stamp.elapsed_seconds
    ticks(world, 10)
    assert world.get_snapshot().timestamp.elapsed_seconds == pytest.approx(before + 0.5)


def test_asynchronous_worlds_advance_by_themselves(client):
    world = client.get_world()
    first = world.wait_for_tick()
    second = world.wait_for_tick()
    assert second.frame > first.frame
    assert 0.0 < second.timestamp.delta_seconds <= 0.1 + 1e-6


def test_settings_come_back_as_they_were_set(world):
    settings = world.get_settings()
    settings.max_substeps = 7
    settings.no_rendering_mode = True
    world.apply_settings(settings)
    assert world.get_settings() == settings


def test_weather_comes_back_as_it_was_set(world):
    world.set_weather(carla.WeatherParameters.HardRainNoon)
    world.tick()
    assert world.get_weather() == carla.WeatherParameters.HardRainNoon


def test_a_new_map_is_a_new_episode_without_the_old_actors(client, world):
    spawn_car(world)
    world.tick()
    old_id = world.id
    other = next(name for name in client.get_available_maps() if name.endswith("/Town01"))
    fresh = client.load_world(other, reset_settings=False)
    assert fresh.id != old_id
    assert fresh.get_map().name.endswith("Town01")
    assert len(fresh.get_actors().filter("vehicle.*")) == 0
    client.load_world("Town10HD_Opt", reset_settings=False)


def test_every_map_is_loaded_with_places_to_start_on_its_lanes(client):
    ids = [client.get_world().id]
    for path in client.get_available_maps():
        if path.endswith("_Opt"):
            continue
        world = client.load_world(path.rsplit("/", 1)[-1])
        town = world.get_map()
        assert path.endswith(town.name)
        ids.append(world.id)
        points = town.get_spawn_points()
        assert points
        for point in points[::9]:
            lane = town.get_waypoint(point.location)
            assert lane.transform.location.distance_2d(point.location) < 0.5
            assert lane.lane_type == carla.LaneType.Driving
    assert len(set(ids)) == len(ids) == 9


def test_a_car_of_the_world_before_is_dead_and_its_handle_sees_the_next_world(client, world):
    car = spawn_car(world)
    world.tick()
    client.load_world("Town01", reset_settings=False)
    assert not car.is_alive
    assert not car.destroy()
    assert world.get_map().name.endswith("Town01")
    assert car.id not in [actor.id for actor in world.get_actors()]
    client.load_world("Town10HD_Opt", reset_settings=False)


def test_an_unknown_map_is_named_in_the_error(client):
    with pytest.raises(RuntimeError, match="Map 'Town99' not found"):
        client.load_world("Town99")


def test_an_uploaded_map_is_loaded(client):
    text = client.get_world().get_map().to_opendrive()
    world = client.generate_opendrive_world(text)
    assert world.get_map().name.endswith("OpenDriveMap")
    assert world.get_map().to_opendrive() == text
    with pytest.raises(RuntimeError):
        client.generate_opendrive_world("<OpenDRIVE><road")


def test_two_clients_share_one_world_and_either_ticks(site, world):
    other = connect(site.carla_port).get_world()
    car = spawn_car(world)
    frame = other.tick()
    assert other.get_actor(car.id).type_id == car.type_id
    assert world.tick() == frame + 1


def test_the_spectator_stays_where_it_is_put(world):
    spectator = world.get_spectator()
    place = carla.Transform(carla.Location(10.0, -20.0, 30.0), carla.Rotation(-90.0, 45.0, 0.0))
    spectator.set_transform(place)
    world.tick()
    found = world.get_spectator().get_transform()
    assert found.location.distance(place.location) < 0.01
    assert found.rotation.pitch == pytest.approx(-90.0, abs=0.1)


def test_drawing_says_what_it_can(world):
    world.debug.draw_point(carla.Location(), life_time=1.0)
    world.debug.draw_string(carla.Location(), "here")
