"""Goal: the world of a session outlives its service with the clients of CARLA that are in it.

Method: the same session and client on a quiet site and on one whose world service is killed now and
then, compared by the hash of every state; a service that drains; a bus that is closed by
certificates.
"""

import os
import signal
import subprocess
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import causeway
import pytest

from carla_site import MAP, connect, synchronous
from documents import ROOT
from running_site import child, two_free_ports
from watched import bus, eventually

carla = pytest.importorskip("carla", reason="the client is not installed")

ALONE = {"open_to_carla": True, "num_npc_vehicles": 0, "num_pedestrians": 0}
TICKS = 60
#: Ticks before which the world service is killed.
KILLED_BEFORE = (3, 30, 31)
WAIT_SECS = 60.0
AUDI = "vehicle.audi.tt"


@contextmanager
def visited(base_url, carla_port, **settings):
    """A session, and a client of CARLA in its world."""
    with causeway.Session(base_url) as session:
        made = session.reset("free_roam", scenario_config={**ALONE, **settings}, seed=7)
        client = connect(carla_port)
        client.load_world(made.metadata["carla_world"])
        yield session, client, made


def place_ahead(world, metres):
    (ego, *_) = world.get_actors().filter("vehicle.*")
    ahead = world.get_map().get_waypoint(ego.get_location()).next(metres)[0].transform
    ahead.location.z += 0.3
    return ahead


def spawn_ahead(world, metres):
    return world.spawn_actor(world.get_blueprint_library().find(AUDI), place_ahead(world, metres))


def until_seen(world, *actors):
    """A client that does not tick sees them with a later frame."""
    wanted = {actor.id for actor in actors}
    eventually("actors", lambda: wanted <= {actor.id for actor in world.get_actors()})


def kill(site):
    os.kill(child(site, "world"), signal.SIGKILL)


def drive(site, before_tick=lambda tick: None):
    """What is seen of a session and a client in synchronous mode, tick by tick."""
    trace = []
    with (
        visited(site.base_url, site.carla_port) as (session, client, _),
        ThreadPoolExecutor(1) as beside,
        synchronous(client.get_world()) as world,
    ):
        cars = [spawn_ahead(world, 25.0)]
        for tick in range(TICKS):
            if tick == 30:
                # Nobody has stepped since when the service is killed.
                cars.append(spawn_ahead(world, 60.0))
            before_tick(tick)
            for car in cars:
                car.apply_control(carla.VehicleControl(throttle=0.5, steer=0.01 * (tick % 5)))
            stepping = beside.submit(session.step, "control", throttle=0.4)
            frame = world.tick()
            step = stepping.result(timeout=WAIT_SECS)
            assert world.get_snapshot().frame == frame
            places = [car.get_location() for car in cars]
            told = [(place.x, place.y, place.z) for place in places]
            trace.append((step.metadata["sim"]["state_hash"], [car.id for car in cars], told))
    return trace


def test_nobody_sees_that_the_world_service_was_killed(site, start_site):
    disturbed = start_site("--no-render")

    def kill_now_and_then(tick):
        if tick in KILLED_BEFORE:
            kill(disturbed)

    wanted = drive(site)
    assert drive(disturbed, kill_now_and_then) == wanted
    said = disturbed.log.read_text(errors="replace")
    assert said.count("follow session") == len(KILLED_BEFORE)


def test_a_client_finds_what_it_did_though_the_session_thinks(start_site):
    site = start_site("--no-render")
    with visited(site.base_url, site.carla_port) as (session, client, made):
        world = client.get_world()
        session.step("observe")
        car = spawn_ahead(world, 25.0)
        car.apply_control(carla.VehicleControl(throttle=1.0))
        kill(site)
        # Nobody steps until these are answered.
        until_seen(world, car)
        assert len(world.get_actors().filter("vehicle.audi.*")) == 1
        for _ in range(40):
            step = session.step("observe")
        assert step.metadata["sim"]["tick"] == 41
        eventually("speed", lambda: car.get_velocity().length() > 2.0)
        # The name of the world of before leads there.
        client.load_world(made.metadata["carla_world"])
        assert session.step("observe").metadata["sim"]["tick"] == 42


def test_what_a_client_did_who_came_and_went_between_two_steps_is_kept(start_site):
    site = start_site("--no-render")
    with causeway.Session(site.base_url) as session:
        made = session.reset("free_roam", scenario_config=ALONE, seed=7)
        client = connect(site.carla_port)
        session.step("observe")
        world = client.load_world(made.metadata["carla_world"])
        weather = world.get_weather()
        weather.fog_density = 77.0
        world.set_weather(weather)
        spawn_ahead(world, 25.0)
        client.load_world(MAP)
        for _ in range(3):
            session.step("observe")
        kill(site)
        step = session.step("observe")
        assert step.metadata["sim"]["tick"] == 5
        world = client.load_world(step.metadata["carla_world"])
        assert world.get_weather().fog_density == 77.0
        assert len(world.get_actors().filter("vehicle.*")) == 1


def test_a_step_of_many_ticks_is_begun_anew(start_site):
    site = start_site("--no-render")
    with (
        visited(site.base_url, site.carla_port, ticks_per_step=40) as (session, client, _),
        ThreadPoolExecutor(1) as beside,
        synchronous(client.get_world()) as world,
    ):
        car = spawn_ahead(world, 25.0)
        stepping = beside.submit(session.step, "observe")
        for _ in range(20):
            world.tick()
        kill(site)
        for _ in range(40):
            assert not stepping.done(), "a tick passed without the client"
            world.tick()
        assert stepping.result(timeout=WAIT_SECS).metadata["sim"]["tick"] == 40
        assert car.is_alive and car.id in {actor.id for actor in world.get_actors()}


def test_a_world_that_does_not_come_back_is_told_to_who_is_in_it(start_site):
    site = start_site("--no-render", CAUSEWAY_RECOVERY_MIB="0")
    with visited(site.base_url, site.carla_port) as (session, client, _):
        world = client.get_world()
        session.step("observe")
        kill(site)
        with pytest.raises(causeway.SessionError, match="reset to start a new episode"):
            session.step("observe")

        def is_told():
            try:
                world.cast_ray(carla.Location(), carla.Location(1.0, 0.0, 0.0))
            except RuntimeError as error:
                return "the world is gone" in str(error)
            return False

        eventually("word that it is gone", is_told)


@pytest.mark.parametrize("num_egos", [1, 2])
def test_a_session_with_visitors_moves_off_a_service_that_drains(tmp_path, num_egos):
    with bus(tmp_path) as start:
        hosts = [start("world", "--id", "world-a", "--drain-secs", "600")]
        hosts[0].until("/readyz", 200)
        face = start("scenario", "--http", "127.0.0.1:0")
        port = two_free_ports()
        recordings = ("--recordings", str(tmp_path / "recordings"))
        gateway = start("gateway", "--port", str(port), *recordings)
        for service in (face, gateway):
            service.until("/readyz", 200)
        url = "http://" + face.find(r"OpenEnv face listens address=(\S+)")
        settings = {"num_egos": num_egos, "join_timeout_secs": 0.1}
        with visited(url, port, **settings) as (session, client, _):
            world = client.get_world()
            session.step("observe")
            car = spawn_ahead(world, 25.0)
            car.apply_control(carla.VehicleControl(throttle=1.0))
            hosts.append(start("world", "--id", "world-b"))
            hosts[1].until("/readyz", 200)
            hosts[0].terminate()
            assert hosts[0].ended() == 0
            assert "lost=0" in hosts[0].said()
            until_seen(world, car)
            for _ in range(40):
                step = session.step("observe")
            assert step.metadata["sim"]["tick"] == 41
            eventually("speed", lambda: car.get_velocity().length() > 2.0)


def test_clients_visit_over_a_bus_that_is_closed_by_certificates(tmp_path, start_site):
    names = ("causeway-world=127.0.0.1", "causeway-render", "causeway-face")
    script = ROOT / "deploy" / "bus" / "certificates.sh"
    subprocess.run([script, tmp_path / "pki", *names], check=True, capture_output=True)
    port = two_free_ports()
    flags = ("--no-render", "--bus-pki", tmp_path / "pki", "--bus", f"tls/127.0.0.1:{port}")
    site = start_site(*flags)
    with visited(site.base_url, site.carla_port) as (session, client, _):
        world = client.get_world()
        car = spawn_ahead(world, 25.0)
        step = session.step("observe")
        (near,) = step.observation["nearby_actors"]
        assert near["type"] == AUDI
        kill(site)
        assert session.step("observe").metadata["sim"]["tick"] == 2
        until_seen(world, car)
