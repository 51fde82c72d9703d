"""The client object itself: versions, files, maps and time-outs."""

import socket
import subprocess
import sys
import time

import carla
import pytest

from carla_site import MAP, connect, spawn_car, synchronous
from running_site import child, memory_kib


def test_switches_of_a_recorder_that_does_nothing_are_harmless(client):
    client.stop_recorder()
    client.stop_replayer(True)
    client.set_replayer_time_factor(1.0)
    client.set_replayer_ignore_hero(False)
    client.set_replayer_ignore_spectator(True)
    first = client.get_world().wait_for_tick()
    assert client.get_world().wait_for_tick().frame > first.frame


def test_files_come_from_the_maps_and_from_nowhere_else(client, tmp_path):
    client.set_files_base_folder(str(tmp_path))
    (name,) = client.get_required_files("Nav")
    assert client.get_required_files() == [name]
    assert client.get_required_files("TM") == []
    assert name.startswith("Carla/Maps/Nav/") and name.endswith(".bin")
    client.request_file(name)
    (saved,) = tmp_path.rglob("*.bin")
    assert saved.read_bytes()[:4] == b"TESM", "a navigation mesh"
    for path in ("../../../etc/passwd", "/etc/passwd", f"{name}/../../../../Cargo.toml"):
        with pytest.raises(RuntimeError, match="there is no file"):
            client.request_file(path)


def test_a_map_that_is_there_already_is_not_loaded_again(client):
    before = client.get_world()
    client.load_world_if_different(MAP)
    assert client.get_world().id == before.id
    client.load_world_if_different("Town02_Opt")
    after = client.get_world()
    assert after.id == before.id + 1 and after.get_map().name.endswith("Town02_Opt")


def test_what_is_refused_of_calls_that_nobody_waits_for_is_logged(start_site):
    site = start_site()
    world = connect(site.carla_port).get_world()
    with synchronous(world):
        car = spawn_car(world)
        world.tick()
        car.set_location(carla.Location(float("nan"), 0.0, 0.0))
        car.set_location(carla.Location(2e5, 0.0, 0.0))
        world.tick()
    log = site.log.read_text()
    assert "a call that nobody waits for is refused" in log
    assert "a command that nobody waits for is refused" in log


def test_collisions_of_what_has_no_body_are_switched_without_effect(world):
    camera = world.spawn_actor(
        world.get_blueprint_library().find("sensor.camera.rgb"), carla.Transform()
    )
    lights = world.get_actors().filter("traffic.traffic_light")
    for actor in (lights[0], camera, world.get_spectator()):
        actor.set_collisions(False)
        actor.set_collisions(True)


def test_a_client_without_server_waits_as_long_as_it_was_told():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(1.0)
    started = time.monotonic()
    with pytest.raises(
        RuntimeError,
        match="time-out of 1000ms while waiting for the simulator, make sure the simulator "
        f"is ready and connected to 127.0.0.1:{port}",
    ):
        client.get_server_version()
    assert 0.8 < time.monotonic() - started < 10.0


def test_a_name_is_as_good_as_an_address(site):
    world = connect(site.carla_port, "localhost").get_world()
    frame = world.wait_for_tick().frame
    assert world.wait_for_tick().frame > frame


def test_a_batch_answers_each_command_and_raises_for_none(client):
    with synchronous(client.get_world()) as world:
        car = spawn_car(world)
        world.tick()
        orders = carla.command
        answers = client.apply_batch_sync(
            [
                orders.ApplyVehicleControl(car.id, carla.VehicleControl(brake=1.0)),
                orders.DestroyActor(4_000_000_000),
                orders.SetSimulatePhysics(car, True),
            ],
            True,
        )
        assert [answer.actor_id for answer in answers][::2] == [car.id] * 2
        assert [answer.has_error() for answer in answers] == [False, True, False]
        assert answers[1].error == "unable to destroy actor: not found"


def at_rest(before_kib: list[int], after_kib: list[int]) -> bool:
    pairs = zip(before_kib, after_kib, strict=True)
    return all(after < 1.01 * before for before, after in pairs)


def test_a_thousand_worlds_leave_nothing_on_the_server(site):
    processes = [child(site, service) for service in ("gateway", "world")]
    # Each client asks once, and never again what it knows.
    program = (
        "import carla, os\n"
        f"clients = [carla.Client('127.0.0.1', {site.carla_port}) for _ in range(100)]\n"
        "for client in clients: client.set_timeout(60.0)\n"
        "ids = {client.get_world().id for client in clients for _ in range(10)}\n"
        "print(len(ids), flush=True)\n"
        "os._exit(0)"
    )

    def thousand() -> list[int]:
        """What each process holds after a thousand times."""
        run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
        assert run.stdout == "1\n", run.stderr
        return [memory_kib(process) for process in processes]

    # Memory is allocated for a while before it is used again; a leak would not come to rest.
    held_kib = [thousand(), thousand()]
    while not at_rest(*held_kib[-2:]):
        assert len(held_kib) < 12, held_kib
        held_kib.append(thousand())
