"""Many clients of CARLA at once, clients that die, and worlds that die."""

import contextlib
import os
import re
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import carla
import pytest

from carla_site import connect, fresh, spawn_car, synchronous, ticks
from running_site import binary, child, memory_kib, two_free_ports

SESSION = Path(__file__).parent / "client_session.py"
CLIENTS = 32
FRAMES = 100
SOON_SECS = 60.0
#: How long thirty-two clients watch a world that ticks by itself.
WATCH_SECS = int(os.environ.get("CAUSEWAY_WATCH_SECS", "10"))


@contextlib.contextmanager
def another_client(port: int, phase: str, *more: str):
    """A client in a process of its own, in the phase it says; killed at the end."""
    process = subprocess.Popen(
        [sys.executable, SESSION, str(port), phase, *more], stdout=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout.readline() == "ready\n", phase
        yield process
    finally:
        process.kill()
        process.wait()


def eventually(act):
    """What `act` returns once it no longer raises."""
    deadline = time.monotonic() + SOON_SECS
    while True:
        try:
            return act()
        except (RuntimeError, ConnectionError):
            if time.monotonic() > deadline:
                raise
            time.sleep(0.1)


def until(condition) -> None:
    """Waits until that holds, or it is too late."""
    deadline = time.monotonic() + SOON_SECS
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.05)


def see(world: carla.World) -> int:
    return world.get_snapshot().frame


def test_thirty_two_clients_see_every_tick(site):
    with synchronous(fresh(site.carla_port).get_world()) as world:
        others = [connect(site.carla_port).get_world() for _ in range(CLIENTS - 1)]
        # Whoever comes is told the newest frame, and then each.
        until(lambda: all(see(other) == see(world) for other in others))
        seen = [[] for _ in others]
        callbacks = [
            other.on_tick(lambda snapshot, frames=frames: frames.append(snapshot.frame))
            for other, frames in zip(others, seen, strict=True)
        ]
        first = world.tick()
        last = ticks(world, FRAMES)
        wanted = list(range(first, last + 1))
        until(lambda: all(frames[-1:] == [last] for frames in seen))
        for other, callback in zip(others, callbacks, strict=True):
            other.remove_on_tick(callback)
        assert [[frame for frame in frames if frame >= first] for frames in seen] == [
            wanted for _ in others
        ]


def test_thirty_two_clients_at_the_worlds_own_pace_miss_no_frame(start_site):
    """Ten seconds at 20 frames per second, or as many as CAUSEWAY_WATCH_SECS says; some time after
    the first five the gateway grows no more."""
    site = start_site("--no-render", "--fps", "20")
    gateway = child(site, "gateway")
    worlds = [connect(site.carla_port).get_world() for _ in range(CLIENTS)]
    seen = [[] for _ in worlds]
    for world, frames in zip(worlds, seen, strict=True):
        world.on_tick(lambda snapshot, frames=frames: frames.append(snapshot.frame))
    wanted, counts = 20 * WATCH_SECS, []
    while len(counts) < wanted // 100 or counts[-1] - counts[-2] >= 2_000:
        assert len(counts) < wanted // 100 + 4, counts
        deadline = time.monotonic() + SOON_SECS
        while min(map(len, seen)) < 100 * (len(counts) + 1):
            assert time.monotonic() < deadline, [len(frames) for frames in seen]
            assert len(worlds[0].get_actors()) > 0
            time.sleep(0.05)
        counts.append(memory_kib(gateway))
    for frames in seen:
        frames = frames[:wanted]
        assert frames == list(range(frames[0], frames[0] + wanted))


def test_a_server_that_does_not_answer_is_told_after_the_time_that_was_set(start_site):
    text = (
        "time-out of 1000ms while waiting for the simulator, "
        "make sure the simulator is ready and connected to 127.0.0.1"
    )
    site = start_site("--no-render")
    client = connect(site.carla_port)
    assert client.get_available_maps()
    client.set_timeout(1.0)
    nobody = carla.Client("127.0.0.1", two_free_ports())
    nobody.set_timeout(1.0)
    os.kill(child(site, "gateway"), signal.SIGSTOP)
    try:
        for unanswered in (client, nobody):
            began = time.monotonic()
            with pytest.raises(RuntimeError, match=text):
                unanswered.get_available_maps()
            assert 0.8 < time.monotonic() - began < SOON_SECS
    finally:
        os.kill(child(site, "gateway"), signal.SIGCONT)
    assert eventually(client.get_available_maps)


@pytest.mark.parametrize("phase", ["connected", "spawning", "ticking", "streaming"])
def test_a_client_that_is_killed_harms_nobody(site, phase):
    client = fresh(site.carla_port)
    with another_client(site.carla_port, phase):
        time.sleep(0.3)
    with synchronous(client.get_world()) as world:
        before = world.tick()
        assert ticks(world, 20) == before + 20
        for car in world.get_actors().filter("vehicle.*"):
            assert car.destroy()
        car = spawn_car(world)
        ticks(world, 2)
        assert car.is_alive


def test_two_clients_tick_one_world(site):
    with synchronous(fresh(site.carla_port).get_world()) as world:
        with another_client(site.carla_port, "ticking"):
            frames = [world.tick() for _ in range(200)]
        assert frames == sorted(set(frames)), "a frame came twice or went back"
        assert frames[-1] - frames[0] > 199, "the other client did not tick"


def stands_still(world: carla.World) -> bool:
    before = see(world)
    time.sleep(1.0)
    return see(world) == before


def test_a_world_waits_for_a_client_that_is_gone(site):
    world = fresh(site.carla_port).get_world()
    with another_client(site.carla_port, "standing"):
        pass
    # Frames from before may still be on their way.
    until(lambda: stands_still(world))
    before = see(world)
    assert stands_still(world)
    with synchronous(world):
        assert world.tick() > before
    assert world.wait_for_tick().frame > before


def test_a_lease_ends_the_waiting(start_site, tmp_path):
    site = start_site("--no-render")
    port = two_free_ports()
    flags = ["--connect", site.endpoint, "--port", str(port), "--sync-lease", "3", "--id", "leased"]
    with (tmp_path / "gateway").open("wb") as log:
        gateway = subprocess.Popen([binary(), "gateway", *flags], stdout=log, stderr=log)
        try:
            eventually(lambda: socket.create_connection(("127.0.0.1", port)).close())
            world = connect(port).get_world()
            with another_client(port, "standing"):
                assert world.get_settings().synchronous_mode
            until(lambda: not world.get_settings().synchronous_mode)
            first = world.wait_for_tick().frame
            assert world.wait_for_tick().frame > first
        finally:
            gateway.send_signal(signal.SIGTERM)
            assert gateway.wait(SOON_SECS) == 0


def test_every_client_has_the_map_that_one_of_them_loads(start_site):
    site = start_site("--no-render")
    client, other = connect(site.carla_port), connect(site.carla_port)
    world = client.get_world()
    for name in ("Town02", "Town01", "Town10HD_Opt"):
        loaded = other.load_world(name)
        frame = loaded.wait_for_tick().frame
        while world.wait_for_tick().frame < frame:
            pass
        town = world.get_map()
        assert town.name.endswith(name)
        assert len(town.get_spawn_points()) == len(loaded.get_map().get_spawn_points())


#: No world is made again when its service is gone.
FORGETFUL = {"CAUSEWAY_RECOVERY_MIB": "0"}


def test_a_lost_world_raises_and_comes_back(start_site):
    site = start_site("--no-render", **FORGETFUL)
    client = connect(site.carla_port)
    world = client.get_world()
    with synchronous(world):
        car = spawn_car(world)
        world.tick()
        subprocess.run(["kill", "-9", str(child(site, "world"))], check=True)
        with pytest.raises(RuntimeError) as error:
            for _ in range(100):
                world.tick()
                car.get_physics_control()
        assert re.search("world is gone|time-out|no answer|nobody", str(error.value))
        fresh_world = eventually(client.reload_world)
        assert fresh_world.id != world.id
        # Loading has made it asynchronous.
        with synchronous(fresh_world):
            before = fresh_world.tick()
            assert ticks(fresh_world, 5) == before + 5
        assert spawn_car(fresh_world).is_alive


def test_the_tick_that_finds_its_world_dead_shows_the_last_frame_once_more(start_site):
    site = start_site("--no-render", **FORGETFUL)
    client = connect(site.carla_port)
    world = client.get_world()
    with synchronous(world):
        car = spawn_car(world)
        before = ticks(world, 5)
        last = world.get_snapshot()
        subprocess.run(["kill", "-9", str(child(site, "world"))], check=True)
        assert world.tick() == before + 1
        again = world.get_snapshot()
        assert again.frame == before + 1
        assert again.timestamp.elapsed_seconds == last.timestamp.elapsed_seconds
        assert (last.timestamp.delta_seconds > 0.0, again.timestamp.delta_seconds) == (True, 0.0)
        assert again.find(car.id).get_transform() == last.find(car.id).get_transform()
        with pytest.raises(RuntimeError, match="world is gone"):
            world.tick()
        assert world.get_snapshot().frame == before + 1
        eventually(client.reload_world)


def test_who_comes_after_the_loss_finds_a_new_world(start_site):
    site = start_site("--no-render", **FORGETFUL)
    old = connect(site.carla_port).get_world()
    old.wait_for_tick()
    subprocess.run(["kill", "-9", str(child(site, "world"))], check=True)
    time.sleep(0.5)
    world = eventually(lambda: connect(site.carla_port).get_world())
    assert world.id != old.id
    frame = world.wait_for_tick().frame
    assert world.wait_for_tick().frame > frame


def test_who_is_spawned_while_nobody_ticks_is_seen_at_once(site):
    """Walker controllers that start a walker they do not see yet end the client's process.

    Frames and answers come on two connections, so that a busy client may see one that came first
    last; it does not see most of them so.
    """
    client = fresh(site.carla_port)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
    places = world.get_map().get_spawn_points()

    def is_at(car: carla.Actor, place: carla.Transform) -> bool:
        return car.get_location().distance(place.location) < 1.0

    world.wait_for_tick()
    at_once = 0
    for place in places[:10]:
        car = world.spawn_actor(blueprint, place)
        world.get_actors()
        at_once += is_at(car, place)
        until(lambda car=car, place=place: is_at(car, place))
        assert is_at(car, place)
    assert at_once >= 5
    spawn = [carla.command.SpawnActor(blueprint, place) for place in places[10:20]]
    cars = world.get_actors([one.actor_id for one in client.apply_batch_sync(spawn)])
    assert len(cars) == 10
    for car, place in zip(cars, places[10:20], strict=True):
        until(lambda car=car, place=place: is_at(car, place))
        assert is_at(car, place)


def test_twenty_walkers_walk_at_the_clients_hand(site):
    client = fresh(site.carla_port)
    with synchronous(client.get_world()) as world:
        world.set_pedestrians_seed(7)
        library = world.get_blueprint_library()
        walkers, brains = [], []
        while len(walkers) < 20:
            at = world.get_random_location_from_navigation()
            blueprint = library.filter("walker.pedestrian.*")[len(walkers)]
            walker = world.try_spawn_actor(blueprint, carla.Transform(at))
            if walker is not None:
                walkers.append(walker)
        world.tick()
        for walker in walkers:
            brain = world.spawn_actor(
                library.find("controller.ai.walker"), carla.Transform(), walker
            )
            brains.append(brain)
        world.tick()
        for brain in brains:
            brain.start()
            brain.go_to_location(world.get_random_location_from_navigation())
            brain.set_max_speed(1.4)
        ways_m, last = [0.0] * 20, [walker.get_location() for walker in walkers]
        for tick in range(500):
            world.tick()
            if tick % 10 == 9:
                now = [walker.get_location() for walker in walkers]
                ways_m = [way + a.distance(b) for way, a, b in zip(ways_m, last, now, strict=True)]
                last = now
        for brain in brains:
            brain.stop()
        assert min(ways_m) > 10.0, sorted(ways_m)


class Remover:
    """As Bench2Drive's scenarios: what it put into the world goes when it is collected."""

    def __init__(self, actor: carla.Actor):
        self.actor = actor
        self.outcome = None

    def remove(self):
        try:
            self.outcome = self.actor.destroy()
        except RuntimeError as error:
            self.outcome = error


def spawn_prop(world: carla.World) -> carla.Actor:
    blueprint = world.get_blueprint_library().find("static.prop.streetbarrier")
    return world.spawn_actor(blueprint, carla.Transform(carla.Location(z=50.0)))


def test_what_is_left_of_an_old_world_does_nothing_to_the_new_one(client):
    seen = {actor.id for actor in client.get_world().get_actors()}
    removers = []
    for load in (client.reload_world, lambda: client.load_world("Town02"), client.reload_world):
        world = client.get_world()
        with synchronous(world):
            old = [spawn_prop(world) for _ in range(3)] + [spawn_car(world, 1)]
            world.tick()
            light = world.get_actors().filter("traffic.traffic_light")[0]
            seen |= {actor.id for actor in world.get_actors()}
        removers += [Remover(actor) for actor in old]
        fresh = load()
        with synchronous(fresh):
            new = [spawn_prop(fresh) for _ in range(3)] + [spawn_car(fresh)]
            fresh.tick()
            present = {actor.id for actor in fresh.get_actors()}
            assert not present & seen, "ids are given again"
            before = {one.id: one.get_transform() for one in fresh.get_snapshot()}
            for remover in removers:
                remover.remove()
                assert remover.outcome is not True
            old[-1].set_transform(carla.Transform(carla.Location(z=99.0)))
            light.set_state(carla.TrafficLightState.Green)
            fresh.tick()
            after = fresh.get_snapshot()
            assert {one.id for one in after} == present
            assert all(after.find(prop.id).get_transform() == before[prop.id] for prop in new[:3])
            assert new[-1].get_location().z < 10.0
            with pytest.raises(RuntimeError, match=f"not be found in the registry.*{old[-1].id}"):
                old[-1].get_physics_control()
        seen |= present
