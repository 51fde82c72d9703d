"""Measures what docs/benchmarks.md says of a shared site.

Usage, with CAUSEWAY_BIN naming the program and `agents/python/src` on PYTHONPATH:

    python tests/python/measure_site.py [resets] [metrics] [placement] [container] [pictures]

All of them unless some are named. `container` wants an engine with the image `--image`, `pictures`
wants root, as its renderers run as another user so that no shortcut leads past the bus.
"""

import argparse
import contextlib
import http.client
import itertools
import multiprocessing
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import causeway

from containers import wait_until_healthy
from running_site import binary, start, stop, two_free_ports
from watched import Service, bus, figures, services

CLIENTS = 8
LOOK_SECS = 5.0
REQUESTS = 200
CONTAINERS = 5
PICTURES, ROUNDS = 100, 5
#: Sessions on three world services, and those that come when there is a fourth.
PLACED, PLACED_LATER = 300, 100
#: Cars of their worlds, in turn.
WEIGHTS = (0, 2, 8)
SETTLE_SECS = 30.0


def told(name: str, secs: list[float]) -> None:
    ordered = sorted(secs)
    p99 = ordered[int(0.99 * (len(ordered) - 1))]
    print(f"{name}: p50 {1e3 * statistics.median(ordered):.2f} ms, p99 {1e3 * p99:.2f} ms")


@contextlib.contextmanager
def site(*flags: str):
    with tempfile.TemporaryDirectory() as folder:
        running = start(Path(folder) / "log", *flags)
        try:
            yield running
        finally:
            stop(running)


def reset_on(url: str, until: float) -> list[float]:
    """How long each reset of one client takes."""
    taken = []
    with causeway.Session(url) as session:
        while time.time() < until:
            begun = time.monotonic()
            session.reset("trolley_saves", seed=1)
            taken.append(time.monotonic() - begun)
    return taken


def resets() -> None:
    """Resets of one scenario service."""
    with site("--no-render") as running, multiprocessing.Pool(CLIENTS) as pool:
        begun = time.time()
        work = [(running.base_url, begun + LOOK_SECS)] * CLIENTS
        taken = [secs for one in pool.starmap(reset_on, work) for secs in one]
        print(f"resets: {len(taken) / (time.time() - begun):.0f} per second, {CLIENTS} clients")
        told("a reset", taken)


def asked(address: str, path: str, keep: bool) -> tuple[list[float], bytes]:
    """How long answers of a process take, by one connection or by one each."""
    taken, connection = [], http.client.HTTPConnection(address)
    for _ in range(REQUESTS):
        begun = time.monotonic()
        connection.request("GET", path)
        body = connection.getresponse().read()
        taken.append(time.monotonic() - begun)
        if not keep:
            connection.close()
    connection.close()
    return taken, body


def spin() -> None:
    while True:
        pass


def metrics() -> None:
    """Scrapes, and probes with all processors busy."""
    port = two_free_ports()
    with site("--no-render", "--admin", f"127.0.0.1:{port}") as running:
        address = f"127.0.0.1:{port + 2}"
        with causeway.Session(running.base_url) as session:
            session.reset("trolley_saves", seed=1)
            session.step()
            taken, body = asked(address, "/metrics", keep=False)
            series = [line for line in body.splitlines() if line and not line.startswith(b"#")]
            told(f"scrape of a scenario service, {len(series)} series", taken)
        busy = [multiprocessing.Process(target=spin) for _ in range(2 * (os.cpu_count() or 1))]
        for process in busy:
            process.start()
        try:
            for keep in (True, False):
                how = "one connection" if keep else "a new connection each"
                told(
                    f"/livez, {len(busy)} busy processes, {how}", asked(address, "/livez", keep)[0]
                )
        finally:
            for process in busy:
                process.kill()


def placement() -> None:
    """How evenly worlds of several weights are spread, and what a world service that joins gets."""
    with (
        tempfile.TemporaryDirectory() as name,
        bus(Path(name)) as begin,
        contextlib.ExitStack() as sessions,
        ThreadPoolExecutor(CLIENTS) as pool,
    ):
        hosts = [ready(begin("world")) for _ in range(3)]
        faces = [begin("scenario", "--http", "127.0.0.1:0") for _ in range(2)]
        urls = [
            "http://" + ready(face).find(r"OpenEnv face listens address=(\S+)") for face in faces
        ]
        numbers = itertools.count()

        def opened(_) -> causeway.Session:
            number = next(numbers)
            session = sessions.enter_context(causeway.Session(urls[number % 2]))
            config = {"num_npc_vehicles": WEIGHTS[number % len(WEIGHTS)]}
            session.reset("free_roam", scenario_config=config, seed=number)
            return session

        def counts() -> list[int]:
            return [int(figures(host.admin)["causeway_world_worlds"]) for host in hosts]

        playing = list(pool.map(opened, range(PLACED)))
        until, spent = time.monotonic() + SETTLE_SECS, [0.0] * len(hosts)
        while time.monotonic() < until:
            before = [processor_secs(host) for host in hosts]
            list(pool.map(lambda session: session.step(), playing))
            for index, host in enumerate(hosts):
                spent[index] += processor_secs(host) - before[index]
        print(f"worlds by service {counts()}, most / mean {uneven(counts()):.2f}")
        print(f"processor time, most / mean {uneven(spent):.2f}")
        hosts.append(ready(begin("world")))
        playing += pool.map(opened, range(PLACED_LATER))
        print(f"of the next {PLACED_LATER} worlds one that joins has {counts()[-1]}")


def ready(service: Service) -> Service:
    service.until("/readyz", 200)
    return service


def processor_secs(service: Service) -> float:
    """What it has used since it began."""
    return figures(service.admin)["process_cpu_seconds_total"]


def uneven(amounts: list[float]) -> float:
    """The largest beside the mean."""
    return max(amounts) / statistics.mean(amounts)


def container(image: str) -> None:
    """From `docker run` to the first reset."""
    taken = []
    for _ in range(CONTAINERS):
        port = two_free_ports()
        begun = time.monotonic()
        command = ["docker", "run", "--detach", "--rm", "-p", f"127.0.0.1:{port}:8000", image]
        started = subprocess.run(command, check=True, capture_output=True, text=True)
        # Whoever listens for the container accepts before anybody serves in it.
        wait_until_healthy(f"http://127.0.0.1:{port}")
        with causeway.Session(f"http://127.0.0.1:{port}") as session:
            session.reset("trolley_saves", seed=1)
        taken.append(time.monotonic() - begun)
        subprocess.run(["docker", "kill", started.stdout.strip()], capture_output=True, check=True)
    told(f"docker run to the first reset, {CONTAINERS} times", taken)


def pictures() -> None:
    """A tick with a picture of 640 x 360 whose bytes travel on the bus, without and with TLS."""
    from networks import AS_NOBODY
    from test_bus_security import certificates

    with tempfile.TemporaryDirectory() as name, contextlib.ExitStack() as stack:
        folder = Path(name)
        folder.chmod(0o755)
        shutil.copy(binary(), folder / "causeway")
        roles = ("router=127.0.0.1", "world", "render", "face")
        pki = certificates(folder / "pki", *(f"causeway-{role}" for role in roles))
        pki.chmod(0o755)
        (pki / "causeway-render.key").chmod(0o644)
        begin = stack.enter_context(services(folder))
        watch = {way: seen_by_camera(begin, way, folder, AS_NOBODY) for way in ("tcp", "tls")}
        taken: dict[str, list[float]] = {way: [] for way in watch}
        for _ in range(ROUNDS):
            for way, look in watch.items():
                taken[way] += look()
        for way, secs in taken.items():
            told(f"tick and picture over {way}", secs)


def seen_by_camera(begin, way: str, folder: Path, another: tuple):
    """A site on a bus of its own, and how its pictures are looked at."""
    from carla_site import attach, connect, spawn_car, ticks_until

    address = f"{way}/127.0.0.1:{two_free_ports()}"

    def run(service: str, role: str, *flags: str, **options):
        files = {"ca": "ca.crt", "cert": f"causeway-{role}.crt", "key": f"causeway-{role}.key"}
        pki = [
            word
            for name, file in files.items()
            for word in (f"--bus-{name}", f"{folder}/pki/{file}")
        ]
        started = begin(service, *flags, *(pki if way == "tls" else []), **options)
        started.until("/startupz", 200)
        return started

    run("router", "router", "--listen", address)
    run("world", "world", "--connect", address)
    draws = run("render", "render", "--connect", address, by=another, program=folder / "causeway")
    draws.until("/readyz", 200)
    port = two_free_ports()
    run("gateway", "face", "--connect", address, "--port", str(port)).until("/readyz", 200)
    world = connect(port).get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    size = {"image_size_x": "640", "image_size_y": "360"}
    camera, seen = attach(world, spawn_car(world), "sensor.camera.rgb", **size)
    ticks_until(world, lambda: not seen.empty())
    time.sleep(1.0)

    def look() -> list[float]:
        # One that nobody names any more stops listening.
        assert camera.is_listening()
        taken = []
        while not seen.empty():
            seen.get()
        for _ in range(PICTURES):
            begun = time.monotonic()
            frame = world.tick()
            while seen.get(timeout=60.0).frame != frame:
                pass
            taken.append(time.monotonic() - begun)
        return taken

    return look


def main() -> None:
    rows = {
        "resets": resets,
        "metrics": metrics,
        "placement": placement,
        "container": container,
        "pictures": pictures,
    }
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("rows", nargs="*", choices=[*rows, []], metavar="ROW", help=", ".join(rows))
    parser.add_argument("--image", default="causeway", help="of `container`")
    options = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for name in options.rows or rows:
        rows[name](*([options.image] if name == "container" else []))
    sys.stdout.flush()
    # CARLA's client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main()
