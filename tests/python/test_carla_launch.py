"""A site that was started as CARLA is, and clients that come from elsewhere."""

import contextlib
import os
import queue
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import carla
import causeway
import pytest

from carla_site import connect, synchronous
from running_site import binary, child, two_free_ports
from watched import bus

LAUNCHERS = Path(__file__).parents[2] / "deploy" / "carla"
WAIT_SECS = 30.0


def own_address() -> str:
    """An address of this machine that is not the loopback; nothing is sent."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        with contextlib.suppress(OSError):
            probe.connect(("192.0.2.1", 9))
            return probe.getsockname()[0]
    pytest.skip("this machine has no address but the loopback")


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
    port = two_free_ports()
    flags = ["-RenderOffScreen", "-quality-level=Low", "-nosound", "-fps=20", "-something-else"]
    site = start_site(f"-carla-rpc-port={port}", *flags, "Town02", CARLA_MODE="mock")
    assert site.carla_port == port
    world = connect(port).get_world()
    assert world.get_map().name.endswith("Town02")
    # A busy machine is often late, and never early.
    shortest_secs = min(world.wait_for_tick().delta_seconds for _ in range(40))
    deadline = time.monotonic() + WAIT_SECS
    while shortest_secs > 0.06 and time.monotonic() < deadline:
        shortest_secs = min(shortest_secs, world.wait_for_tick().delta_seconds)
    assert shortest_secs == pytest.approx(0.05, rel=0.2)
    said = site.said()
    assert "something-else" in said and "quality-level" not in said


def test_a_site_without_a_gpu_is_drawn_by_processors(start_site):
    site = start_site("-nullrhi")
    with causeway.Session(site.base_url) as session:
        session.reset("trolley_saves", seed=1)
        assert session.capture().startswith(b"\xff\xd8"), "no JPEG"
    mapped = Path(f"/proc/{child(site, 'render')}/maps").read_text()
    assert "libvulkan" not in mapped and "nvidia" not in mapped


@contextlib.contextmanager
def launched(script: str, *flags: str, says_to: int | None = None, **environment: str):
    """A site that one of CARLA's launchers started."""
    command = [LAUNCHERS / script, *flags]
    places = {"CAUSEWAY_BIN": str(binary()), **environment}
    process = subprocess.Popen(
        command,
        env={**os.environ, **places},
        stdin=subprocess.DEVNULL,
        stdout=says_to,
        stderr=says_to,
    )
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT_SECS) == 0


def frame_of(port: int) -> int:
    """Of a snapshot, which comes by the port of streams; the client tries to connect once."""
    eventually(lambda: socket.create_connection(("127.0.0.1", port), 5.0).close())
    return connect(port).get_world().wait_for_tick().frame


def test_carlas_launchers_start_sites_side_by_side():
    ports, streams = two_free_ports(), two_free_ports()
    flags = ["-RenderOffScreen", "-nullrhi", "-nosound", f"-carla-streaming-port={streams}"]
    other = two_free_ports()
    with launched("CarlaUE4.sh", *flags, f"-carla-rpc-port={ports}"):
        with launched("CarlaUnreal.sh", "-nosound", CARLA_PORT=str(other)):
            assert frame_of(ports) > 0
            assert frame_of(other) > 0
            with pytest.raises(ConnectionRefusedError):
                socket.create_connection(("127.0.0.1", ports + 1), 5.0)
            socket.create_connection(("127.0.0.1", streams), 5.0).close()


def test_nobody_need_read_what_a_site_says():
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with contextlib.suppress(BlockingIOError):
        while True:
            os.write(writer, b".")
    os.set_blocking(writer, True)
    port = two_free_ports()
    with launched("CarlaUE4.sh", f"-carla-rpc-port={port}", says_to=writer):
        assert frame_of(port) > 0
        assert connect(port).load_world("Town02").get_map().name.endswith("Town02")
    os.close(writer)
    os.close(reader)


@pytest.mark.parametrize("game", ["CarlaUE4", "CarlaUnreal"])
@pytest.mark.parametrize("itself", [False, True], ids=["script", "program"])
def test_who_ends_servers_by_name_finds_a_launched_site(game, itself):
    port, program = two_free_ports(), f"{game}-Linux-Shipping"
    script = f"{game}/Binaries/Linux/{program}" if itself else f"{game}.sh"
    flags = [game] if itself else []
    flags += ["-nosound", "--ros2", "--resx=800", "-carla-rpc-port", "3", f"-carla-rpc-port={port}"]
    with launched(script, *flags) as process:

        def is_named_so():
            name = Path(f"/proc/{process.pid}/comm").read_text().strip()
            if name != program[:15]:
                raise ConnectionError(name)

        eventually(is_named_so)
        # As `pkill -f` reads it.
        line = Path(f"/proc/{process.pid}/cmdline").read_text().replace("\0", " ")
        assert f"{program} {game} -nosound" in line
        # A process has its name before it knows what to do when it is to end.
        assert frame_of(port) > 0


def test_pictures_reach_clients_that_come_by_another_address(start_site, tmp_path):
    address = own_address()
    site, port = start_site(), two_free_ports()
    flags = ["--connect", site.endpoint, "--port", str(port), "--host", "0.0.0.0", "--id", "open"]
    with (tmp_path / "gateway").open("wb") as log:
        gateway = subprocess.Popen([binary(), "gateway", *flags], stdout=log, stderr=log)
    try:
        eventually(lambda: socket.create_connection((address, port)).close())
        with synchronous(connect(port, address).get_world()) as world:
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


def test_a_gateway_whose_map_is_not_there_says_so_and_blames_no_version(tmp_path):
    with bus(tmp_path) as start:
        start("world").until("/readyz", 200)
        port = two_free_ports()
        recordings = ("--recordings", str(tmp_path / "recordings"))
        gateway = start("gateway", "--port", str(port), "--map", "Nowhere", *recordings)
        gateway.until("/readyz", 200)
        look = f"import carla; carla.Client('127.0.0.1', {port}).get_world()"
        looked = subprocess.run([sys.executable, "-c", look], capture_output=True, timeout=60)
        assert b"Map 'Nowhere' not found" in looked.stderr
        gateway.find(r"a client gets no world (refusal=.*'Nowhere' not found)")
        time.sleep(0.5)
        assert "ended before it had its world" not in gateway.said()
