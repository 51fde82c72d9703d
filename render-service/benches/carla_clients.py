"""Pictures a second that CARLA's clients get of one site, each of a world of its own.

    python render-service/benches/carla_clients.py --clients 1 4 16 --program causeway

Starts a site with a CARLA port for each client. A client ticks its world synchronously, with 20
cars that stand about and a camera on one of them, and waits for every picture. Wants the official
`carla` wheel; `--adapter cpu` has processors draw.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import queue
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing.synchronize import Barrier

import carla

#: Pictures before those that are counted.
WARM_UP = 20
CARS = 20
#: A site that is not up by then is none.
SITE_SECS = 30.0


def main() -> int:
    options = parse_arguments()
    print("| clients | pictures a second | each client's | slowest picture, ms |")
    print("|---|---|---|---|")
    for clients in options.clients:
        ports = free_ports(clients)
        with site(ports, options):
            rates = measure(ports, options)
        total, slowest = sum(rate for rate, _ in rates), max(slow for _, slow in rates)
        each = total / clients
        print(f"| {clients} | {total:.0f} | {each:.1f} | {slowest * 1e3:.0f} |", flush=True)
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clients", type=int, nargs="+", default=[1, 4], help="default: 1 4")
    parser.add_argument("--secs", type=float, default=5.0, help="default: %(default)s")
    parser.add_argument("--size", default="640x360", help="default: %(default)s")
    parser.add_argument("--adapter", default="", help="what draws; default: a GPU, else processors")
    parser.add_argument("--program", default="causeway", help="default: %(default)s")
    return parser.parse_args()


def free_ports(count: int) -> list[int]:
    """Ports of which the next one is free, too, as far as can be told now."""
    found: list[int] = []
    candidate = 21_000
    while len(found) < count:
        candidate += 10
        with contextlib.suppress(OSError):
            for port in (candidate, candidate + 1):
                with socket.socket() as listener:
                    listener.bind(("127.0.0.1", port))
            found.append(candidate)
    return found


@contextlib.contextmanager
def site(ports: list[int], options: argparse.Namespace) -> Iterator[None]:
    command = [options.program, "up", "--http", "0", "--bus", "tcp/127.0.0.1:0"]
    for port in ports:
        command += ["--carla", str(port)]
    if options.adapter:
        command += ["--adapter", options.adapter]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        process.terminate()
        process.wait(20)


def measure(ports: list[int], options: argparse.Namespace) -> list[tuple[float, float]]:
    """Of each client, pictures a second and the slowest one's seconds."""
    start = multiprocessing.Barrier(len(ports))
    with multiprocessing.Pool(len(ports), initializer=share, initargs=(start,)) as pool:
        return pool.starmap(drive, [(port, options.size, options.secs) for port in ports], 1)


def share(start: Barrier) -> None:
    global together
    together = start


def drive(port: int, size: str, secs: float) -> tuple[float, float]:
    world = connect(port).get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    library, points = world.get_blueprint_library(), world.get_map().get_spawn_points()
    blueprint = library.find("vehicle.tesla.model3")
    cars = [world.try_spawn_actor(blueprint, point) for point in points[:CARS]]
    camera_blueprint = library.find("sensor.camera.rgb")
    for name, value in zip(("image_size_x", "image_size_y"), size.split("x"), strict=True):
        camera_blueprint.set_attribute(name, value)
    ahead = carla.Transform(carla.Location(x=1.5, z=1.6))
    camera = world.spawn_actor(camera_blueprint, ahead, attach_to=next(filter(None, cars)))
    pictures: queue.Queue[carla.Image] = queue.Queue()
    camera.listen(pictures.put)

    def picture() -> float:
        asked = time.perf_counter()
        frame = world.tick()
        while pictures.get(timeout=20.0).frame != frame:
            pass
        return time.perf_counter() - asked

    for _ in range(WARM_UP):
        picture()
    together.wait()
    begun = time.perf_counter()
    took = [picture()]
    while time.perf_counter() - begun < secs:
        took.append(picture())
    rate, slowest = len(took) / (time.perf_counter() - begun), max(took)
    camera.stop()
    camera.destroy()
    return rate, slowest


def connect(port: int) -> carla.Client:
    until = time.monotonic() + SITE_SECS
    while True:
        client = carla.Client("127.0.0.1", port)
        client.set_timeout(5.0)
        try:
            client.get_server_version()
        except RuntimeError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)
        else:
            client.set_timeout(30.0)
            return client


if __name__ == "__main__":
    sys.exit(main())
