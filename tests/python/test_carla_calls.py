"""The client object itself: versions, files, maps, time-outs, and what the recorder answers."""

import socket
import time

import carla
import pytest

from carla_site import MAP, connect, spawn_car, synchronous


def test_the_recorder_says_that_it_is_not_yet_available(client):
    for attempt in (
        lambda: client.start_recorder("drive.log"),
        lambda: client.start_recorder("drive.log", True),
        lambda: client.show_recorder_file_info("drive.log", False),
        lambda: client.show_recorder_collisions("drive.log", "v", "a"),
        lambda: client.show_recorder_actors_blocked("drive.log", 30.0, 10.0),
        lambda: client.replay_file("drive.log", 0.0, 0.0, 0),
        lambda: client.replay_file("drive.log", 0.0, 0.0, 0, False),
    ):
        with pytest.raises(RuntimeError, match="recorder is not yet available"):
            attempt()


def test_switches_of_the_recorder_change_nothing(client):
    client.stop_recorder()
    client.stop_replayer(True)
    client.set_replayer_time_factor(2.0)
    client.set_replayer_ignore_hero(True)
    client.set_replayer_ignore_spectator(False)
    first = client.get_world().wait_for_tick()
    assert client.get_world().wait_for_tick().frame > first.frame


def test_files_come_from_the_maps_and_from_nowhere_else(client, tmp_path):
    client.set_files_base_folder(str(tmp_path))
    (name,) = client.get_required_files("Nav")
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
    assert time.monotonic() - started == pytest.approx(1.0, abs=0.3)


def test_a_name_is_as_good_as_an_address(site):
    client = carla.Client("localhost", site.carla_port)
    client.set_timeout(10.0)
    world = client.get_world()
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


def test_a_thousand_worlds_leave_nothing_on_the_server(site):
    client = connect(site.carla_port)
    ids = {client.get_world().id for _ in range(1000)}
    assert len(ids) == 1
    started = time.monotonic()
    client.get_world()
    assert time.monotonic() - started < 0.2
