"""A site that was started as CARLA is, and clients that come from elsewhere."""

import contextlib
import queue
import signal
import socket
import subprocess
import time

import carla
import pytest

from carla_site import connect, synchronous
from running_site import binary

WAIT_SECS = 30.0


def own_address() -> str:
    """An address of this machine that is not the loopback; nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        with contextlib.suppress(OSError):
            probe.connect(("192.0.2.1", 9))
            return probe.getsockname()[0]
    pytest.skip("this machine has no address but the loopback")


def free_port() -> int:
    """A port that is free, as is the next one."""
    while True:
        with socket.socket() as first, socket.socket() as second:
            first.bind(("127.0.0.1", 0))
            port = first.getsockname()[1]
            with contextlib.suppress(OSError, OverflowError):
                second.bind(("127.0.0.1", port + 1))
                return port


def eventually(act) -> None:
    deadline = time.monotonic() + WAIT_SECS
    while True:
        try:
            return act()
        except ConnectionError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.05)


def test_flags_of_carlas_launcher_are_taken(start_site):
    port = free_port()
    flags = ["-RenderOffScreen", "-quality-level=Low", "-nosound", "-fps=20", "-something-else"]
    site = start_site(f"-carla-rpc-port={port}", *flags, "Town02")
    assert site.carla_port == port
    world = connect(port).get_world()
    assert world.get_map().name.endswith("Town02")
    first = world.wait_for_tick().timestamp
    last = [world.wait_for_tick() for _ in range(20)][-1].timestamp
    steps = last.frame - first.frame
    assert (last.elapsed_seconds - first.elapsed_seconds) / steps == pytest.approx(0.05, rel=0.2)
    assert "something-else" in site.said()


def test_pictures_reach_clients_that_come_by_another_address(start_site, tmp_path):
    address = own_address()
    site, port = start_site(), free_port()
    flags = ["--connect", site.endpoint, "--port", str(port), "--host", "0.0.0.0", "--id", "open"]
    with (tmp_path / "gateway").open("wb") as log:
        gateway = subprocess.Popen([binary(), "gateway", *flags], stdout=log, stderr=log)
    try:
        eventually(lambda: socket.create_connection((address, port)).close())
        client = carla.Client(address, port)
        client.set_timeout(WAIT_SECS)
        with synchronous(client.get_world()) as world:
            blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
            blueprint.set_attribute("image_size_x", "64")
            blueprint.set_attribute("image_size_y", "48")
            above = carla.Transform(carla.Location(z=30.0))
            camera = world.spawn_actor(blueprint, above)
            pictures = queue.Queue()
            camera.listen(pictures.put)
            frame = world.tick()
            assert pictures.get(timeout=WAIT_SECS).frame == frame
            camera.destroy()
    finally:
        gateway.send_signal(signal.SIGTERM)
        gateway.wait(WAIT_SECS)
