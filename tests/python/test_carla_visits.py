"""Clients of CARLA in the world of an OpenEnv session: both see and do things there."""

import itertools
import os
import queue
import re
import signal
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import carla
import pytest
from causeway.openenv import Session

from carla_site import MAP, connect, fresh, synchronous
from running_site import binary, child, two_free_ports

ALONE = {"open_to_carla": True, "num_npc_vehicles": 0, "num_pedestrians": 0}
WAIT_SECS = 30.0
#: How long a session waits for clients in synchronous mode, in seconds.
LEASE_SECS = 5.0


@contextmanager
def visited(site, scenario="free_roam", **settings):
    """A session, what its reset told, and a client of CARLA in its world."""
    with Session(site.base_url) as session:
        made = session.reset(scenario, scenario_config={**ALONE, **settings}, seed=7)
        client = fresh(site.carla_port)
        client.load_world(made.metadata["carla_world"])
        try:
            yield session, made, client
        finally:
            client.load_world(MAP)


def until(condition):
    deadline = time.monotonic() + WAIT_SECS
    while not condition():
        assert time.monotonic() < deadline, "it does not come"
        time.sleep(0.01)


def ticks_of(snapshots):
    """When time was another: a world that stands still is shown now and then."""
    return sorted({told.timestamp.elapsed_seconds for told in snapshots})


def ego_of(world):
    (ego,) = world.get_actors().filter("vehicle.*")
    return ego


def test_a_client_follows_the_session_and_measures_in_its_world(site):
    with visited(site) as (session, made, client):
        world = client.get_world()
        assert world.get_map().name.endswith(made.metadata["sim"]["map"])
        settings = world.get_settings()
        assert settings.fixed_delta_seconds == pytest.approx(made.metadata["sim"]["dt"])
        assert not settings.synchronous_mode
        ego = ego_of(world)
        library, frames = world.get_blueprint_library(), []
        sensors = {}
        for name in ("other.imu", "other.gnss", "camera.rgb"):
            blueprint = library.find(f"sensor.{name}")
            sensor = world.spawn_actor(blueprint, carla.Transform(), attach_to=ego)
            sensors[name] = (sensor, queue.Queue())
            sensor.listen(sensors[name][1].put)
        world.on_tick(frames.append)
        until(lambda: frames)
        for _ in range(20):
            step = session.step("control", throttle=0.6)
        until(lambda: len(ticks_of(frames)) >= 21)
        assert len(ticks_of(frames)) == 21, "each tick is a frame"
        numbers = [told.frame for told in frames]
        assert numbers == sorted(set(numbers))
        for sensor, told in sensors.values():
            assert told.get(timeout=WAIT_SECS).frame in numbers
            sensor.stop()
        place = ego.get_location()
        seen = step.observation["location"]
        assert [place.x, place.y, place.z] == pytest.approx(seen, abs=0.02)
        speed_kmh = 3.6 * ego.get_velocity().length()
        assert speed_kmh == pytest.approx(step.observation["speed_kmh"], abs=0.1) and speed_kmh > 5


def test_what_a_client_brings_is_there_for_the_session_and_goes_with_it(site):
    with visited(site) as (session, _, client):
        world = client.get_world()
        ego = ego_of(world)
        ahead = world.get_map().get_waypoint(ego.get_location()).next(15.0)[0].transform
        ahead.location.z += 0.3
        car = world.spawn_actor(world.get_blueprint_library().find("vehicle.tesla.model3"), ahead)
        step = session.step("observe")
        (near,) = step.observation["nearby_actors"]
        assert near["type"] == car.type_id
        assert near["distance"] == pytest.approx(15.0, abs=1.5)
        car.apply_control(carla.VehicleControl(throttle=1.0))
        for _ in range(60):
            step = session.step("observe")
        (near,) = step.observation["nearby_actors"]
        assert near["distance"] > 18.0, "it drives away"
        client.load_world(MAP)
        assert session.step("observe").observation["nearby_actors"] == []


def test_a_client_in_synchronous_mode_ticks_together_with_the_session(site):
    with visited(site) as (session, _, client), ThreadPoolExecutor(1) as beside:
        with synchronous(client.get_world()) as world:
            for _ in range(3):
                stepping = beside.submit(session.step, "control", throttle=0.5)
                time.sleep(0.2)
                assert not stepping.done(), "the client has not ticked"
                frame = world.tick()
                step = stepping.result(timeout=WAIT_SECS)
                assert world.get_snapshot().frame == frame
                place = ego_of(world).get_location()
                assert [place.x, place.y] == pytest.approx(
                    step.observation["location"][:2], abs=0.02
                )
            # The session may be late as well.
            ticking = beside.submit(world.tick)
            time.sleep(0.2)
            assert not ticking.done(), "the session has not stepped"
            session.step("observe")
            assert ticking.result(timeout=WAIT_SECS) == frame + 1


def test_the_same_actions_and_controls_give_the_same_states(site):
    hashes = []
    for _ in range(2):
        with visited(site) as (session, _, client), ThreadPoolExecutor(1) as beside:
            with synchronous(client.get_world()) as world:
                ego = ego_of(world)
                side = world.get_map().get_waypoint(ego.get_location()).next(25.0)[0].transform
                side.location.z += 0.3
                car = world.spawn_actor(world.get_blueprint_library().find("vehicle.audi.tt"), side)
                for tick in range(40):
                    car.apply_control(carla.VehicleControl(throttle=0.5, steer=0.01 * (tick % 5)))
                    stepping = beside.submit(session.step, "control", throttle=0.4)
                    world.tick()
                    step = stepping.result(timeout=WAIT_SECS)
                hashes.append(step.metadata["sim"]["state_hash"])
    assert hashes[0] == hashes[1]


def test_a_session_waits_once_for_a_client_that_does_not_tick(site):
    with visited(site) as (session, _, client), synchronous(client.get_world()) as world:
        began = time.monotonic()
        session.step("observe")
        assert time.monotonic() - began > LEASE_SECS / 2
        began = time.monotonic()
        for _ in range(10):
            step = session.step("observe")
        assert time.monotonic() - began < LEASE_SECS
        with ThreadPoolExecutor(1) as beside:
            ticking = beside.submit(world.tick)
            time.sleep(0.5)
            after = session.step("observe")
            ticking.result(timeout=WAIT_SECS)
        assert after.metadata["sim"]["tick"] == step.metadata["sim"]["tick"] + 1


def test_several_ticks_of_a_step_are_as_many_frames(site):
    with visited(site, ticks_per_step=5) as (session, _, client):
        frames = []
        client.get_world().on_tick(frames.append)
        until(lambda: frames)
        session.step("observe")
        until(lambda: len(ticks_of(frames)) >= 6)
        assert len(ticks_of(frames)) == 6


def test_time_goes_on_for_clients_while_a_session_in_real_time_thinks(site):
    with visited(site, realtime=True) as (session, _, client):
        frames = []
        client.get_world().on_tick(frames.append)
        until(lambda: len(ticks_of(frames)) >= 20)
        step = session.step("control", throttle=0.5)
        assert step.metadata["sim"]["tick"] >= 20
        assert step.metadata["events"][0].endswith(" s passed before this action")
        seconds = ticks_of(frames)
        leaps = [after - before for before, after in itertools.pairwise(seconds)]
        assert leaps == pytest.approx([0.05] * len(leaps), abs=1e-4), "each tick is a frame"
        with synchronous(client.get_world()) as world:
            numbers = [world.tick() for _ in range(20)]
        assert numbers == list(range(numbers[0], numbers[0] + 20))


def test_a_client_is_told_when_the_session_ends_and_goes_on_elsewhere(site):
    with visited(site) as (session, _, client):
        world = client.get_world()
        ego = ego_of(world)
        session.close()

        def is_gone():
            try:
                world.get_actors()
                ego.apply_control(carla.VehicleControl())
                world.get_random_location_from_navigation()
                world.cast_ray(carla.Location(), carla.Location(1.0, 0.0, 0.0))
            except RuntimeError as error:
                return "gone" in str(error)
            return False

        until(is_gone)


def test_two_sessions_and_a_client_are_in_one_world(site):
    with visited(site, num_egos=2) as (first, made, client), Session(site.base_url) as second:
        second.reset(join=made.metadata["world_id"])
        world = client.get_world()
        assert len(world.get_actors().filter("vehicle.*")) == 2
        frames = []
        world.on_tick(frames.append)
        until(lambda: frames)
        with ThreadPoolExecutor(2) as both:
            for _ in range(10):
                steps = [both.submit(one.step, "control", throttle=0.5) for one in (first, second)]
                steps = [step.result(timeout=WAIT_SECS) for step in steps]
        assert len({step.metadata["sim"]["state_hash"] for step in steps}) == 1
        assert steps[0].metadata["carla_world"] == made.metadata["carla_world"]
        until(lambda: len(ticks_of(frames)) >= 11)
        speeds_kmh = [
            3.6 * car.get_velocity().length() for car in world.get_actors().filter("veh*")
        ]
        told_kmh = [step.observation["speed_kmh"] for step in steps]
        assert sorted(speeds_kmh) == pytest.approx(sorted(told_kmh), abs=0.1)


def test_a_session_goes_on_when_the_gateway_of_its_visitors_dies(start_site):
    site = start_site("--no-render")
    with Session(site.base_url) as session:
        made = session.reset("free_roam", scenario_config=ALONE, seed=7)
        client = connect(site.carla_port)
        client.load_world(made.metadata["carla_world"])
        session.step("observe")
        os.kill(child(site, "gateway"), signal.SIGKILL)
        for _ in range(20):
            step = session.step("control", throttle=0.5)
        assert step.metadata["sim"]["tick"] == 21 and step.observation["speed_kmh"] > 1.0


def test_an_open_world_that_nobody_visits_is_made_again(start_site):
    site = start_site("--no-render")
    with Session(site.base_url) as session:
        made = session.reset("free_roam", scenario_config=ALONE, seed=7)
        client = connect(site.carla_port)
        session.step("observe")
        os.kill(child(site, "world"), signal.SIGKILL)
        step = session.step("observe")
        assert step.metadata["sim"]["tick"] == 2
        assert step.metadata["carla_world"] != made.metadata["carla_world"]
        client.load_world(step.metadata["carla_world"])
        assert len(client.get_world().get_actors().filter("vehicle.*")) == 1


def test_nothing_is_replayed_in_the_world_of_a_session(site):
    with visited(site) as (session, _, client):
        with pytest.raises(RuntimeError, match="in the world of a session"):
            client.replay_file("nothing.log", 0.0, 0.0, 0)
        assert session.step("observe").metadata["sim"]["tick"] == 1


def test_steps_are_the_sessions(site, capfd):
    with visited(site) as (session, made, client):
        world = client.get_world()
        settings = world.get_settings()
        settings.fixed_delta_seconds = 0.1
        with pytest.raises(RuntimeError, match="its own step"):
            world.apply_settings(settings)
        for synchronous_mode in (True, False):
            settings.synchronous_mode = synchronous_mode
            settings.fixed_delta_seconds = made.metadata["sim"]["dt"]
            world.apply_settings(settings)
        assert session.step("observe").metadata["sim"]["tick"] == 1, "settings take no time"
    said = capfd.readouterr()
    assert "not correctly set" not in said.out + said.err


def test_a_traffic_manager_drives_in_the_world_of_a_session(site):
    with visited(site) as (session, _, client), ThreadPoolExecutor(1) as beside:
        manager = client.get_trafficmanager(two_free_ports())
        with synchronous(client.get_world()) as world:
            manager.set_synchronous_mode(True)
            blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
            places = world.get_map().get_spawn_points()[:6]
            cars = [world.try_spawn_actor(blueprint, place) for place in places]
            cars = [car for car in cars if car is not None]
            for car in cars:
                car.set_autopilot(True, manager.get_port())
            for _ in range(100):
                stepping = beside.submit(session.step, "control", throttle=0.3)
                world.tick()
                stepping.result(timeout=WAIT_SECS)
            speeds = [car.get_velocity().length() for car in cars]
            for car in cars:
                car.set_autopilot(False, manager.get_port())
            manager.set_synchronous_mode(False)
        manager.shut_down()
        assert min(speeds) > 3.0, speeds


@pytest.mark.parametrize("wanted", ["world-1", "closed"])
def test_a_world_that_is_not_open_is_refused_and_notices_nothing(site, wanted):
    with Session(site.base_url) as session:
        session.reset("free_roam", scenario_config={**ALONE, "open_to_carla": False}, seed=7)
        client = fresh(site.carla_port)
        before = client.get_world().id
        if wanted == "closed":
            listing = [binary(), "record", "worlds", "--connect", site.endpoint]
            told = subprocess.check_output(listing, text=True)
            worlds = [int(number) for number in re.findall(r"\b\d{12,}\b", told)]
            wanted = f"world-{max(worlds)}"
        with pytest.raises(RuntimeError, match="open_to_carla"):
            client.load_world(wanted)
        assert client.get_world().id == before
        assert session.step("observe").metadata["sim"]["tick"] == 1
