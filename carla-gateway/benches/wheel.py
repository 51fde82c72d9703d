"""How fast CARLA's own client gets on with a gateway.

Usage: wheel.py [--causeway PATH] [--port PORT] [PART...]; parts are those of PARTS, by default all.
Starts a site of its own and prints one line per figure. Wants `pip install carla==0.9.16`.
"""

import argparse
import functools
import os
import queue
import re
import signal
import socket
import statistics
import subprocess
import sys
import time

import carla

STEP_SECS = 0.05
CIRCLES_TOWN = "Town03"
TOWNS = [f"Town0{number}" for number in range(1, 8)] + ["Town10HD"]


class Site:
    """`causeway up` with an endpoint for CARLA."""

    def __init__(self, program: str, port: int, *more: str):
        flags = [
            "--http",
            "127.0.0.1:0",
            "--bus",
            "tcp/127.0.0.1:0",
            "--carla",
            str(port),
            *more,
        ]
        self.process = subprocess.Popen(
            [program, "up", *flags],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        line = ""
        while "CARLA" not in line:
            line = self.process.stdout.readline()
        self.port = int(re.search(r":(\d+)", line).group(1))
        # The client library tries only once.
        while not is_open(self.port):
            time.sleep(0.001)

    def stop(self) -> None:
        self.process.send_signal(signal.SIGTERM)
        self.process.wait()


def is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def connect(site: Site) -> carla.Client:
    client = carla.Client("127.0.0.1", site.port)
    client.set_timeout(60.0)
    return client


def synchronous(world: carla.World) -> carla.World:
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = STEP_SECS
    world.apply_settings(settings)
    return world


def tell(what: str, value: float, unit: str) -> None:
    print(f"{what:<58} {value:>10,.1f} {unit}", flush=True)


def rate(act, count: int, rounds: int = 5) -> float:
    """The best of some rounds, in calls per second: the others had company."""
    best = 0.0
    for _ in range(rounds):
        begun = time.perf_counter()
        for _ in range(count):
            act()
        best = max(best, count / (time.perf_counter() - begun))
    return best


def millis(act, rounds: int = 5) -> float:
    """The median of some rounds."""
    took = []
    for _ in range(rounds):
        begun = time.perf_counter()
        act()
        took.append(1_000.0 * (time.perf_counter() - begun))
    return statistics.median(took)


def start(site: Site) -> None:
    """From the start of the program to the first answered call."""
    took = []
    for _ in range(5):
        begun = time.perf_counter()
        another = Site(site.process.args[0], 0)
        connect(another).get_world()
        took.append(1_000.0 * (time.perf_counter() - begun))
        another.stop()
    tell("start to first world", statistics.median(took), "ms")


def calls(site: Site) -> None:
    client = connect(site)
    client.get_world()
    tell("get_server_version()", rate(client.get_server_version, 2_000), "calls/s")
    tell("get_world() of a new client", millis(lambda: connect(site).get_world()), "ms")


def ticks(site: Site) -> None:
    client = connect(site)
    world = synchronous(client.load_world(CIRCLES_TOWN))
    tell("world.tick(), empty world", rate(world.tick, 2_000), "ticks/s")
    cars = spawn(client, world, 100)
    tell("world.tick(), 100 cars that stand", rate(world.tick, 500), "ticks/s")
    drive_in_circles(client, cars)
    tell("world.tick(), 100 cars that drive", rate(world.tick, 200, 3), "ticks/s")
    snapshot = world.get_snapshot()
    driving = [
        car for car in cars if snapshot.find(car).get_velocity().length() > 1.0
    ]
    tell("  of which drive at the end", len(driving), "cars")


def spawn(client: carla.Client, world: carla.World, count: int) -> list[int]:
    """Cars all over the town."""
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    places = world.get_map().get_spawn_points()
    places = places[:: max(len(places) // count, 1)][:count]
    batch = [carla.command.SpawnActor(blueprint, place) for place in places]
    return [one.actor_id for one in client.apply_batch_sync(batch) if not one.error]


def drive_in_circles(client: carla.Client, cars: list[int]) -> None:
    """At full lock to the left, where Town03 has room for most of them."""
    control = carla.VehicleControl(throttle=0.3, steer=-1.0)
    client.apply_batch_sync(
        [carla.command.ApplyVehicleControl(car, control) for car in cars]
    )


def batch(site: Site) -> None:
    client = connect(site)
    world = synchronous(client.load_world("Town03"))
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    places = world.get_map().get_spawn_points()[:200]
    spawns = [carla.command.SpawnActor(blueprint, place) for place in places]
    took, cars = [], []
    for _ in range(5):
        begun = time.perf_counter()
        responses = client.apply_batch_sync(spawns)
        took.append(1_000.0 * (time.perf_counter() - begun))
        cars = [one.actor_id for one in responses if not one.error]
        client.apply_batch_sync([carla.command.DestroyActor(car) for car in cars])
        world.tick()
    tell(f"apply_batch_sync() of {len(cars)} spawns", statistics.median(took), "ms")


def loads(site: Site) -> None:
    client = connect(site)
    for name in TOWNS:
        first, again = (
            millis(functools.partial(client.load_world, name), 1) for _ in range(2)
        )
        tell(f"load_world({name}), first", first, "ms")
        tell(f"load_world({name}), again", again, "ms")


def camera(site: Site) -> None:
    """Ticks with a camera of few pixels and with one of 640 x 360."""
    client = connect(site)
    world = synchronous(client.load_world("Town10HD_Opt"))
    for width, height in ((8, 8), (640, 360)):
        blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
        blueprint.set_attribute("image_size_x", str(width))
        blueprint.set_attribute("image_size_y", str(height))
        sensor = world.spawn_actor(blueprint, carla.Transform(carla.Location(z=20.0)))
        images = queue.Queue()
        sensor.listen(images.put)

        def shoot(images=images):
            world.tick()
            images.get(timeout=60.0)

        shoot()
        tell(f"tick and picture, {width} x {height}", millis(shoot, 40), "ms")
        sensor.stop()
        time.sleep(0.2)
        sensor.destroy()


def lidar(site: Site) -> None:
    """1.3 million points a second at 20 Hz, all of them received."""
    client = connect(site)
    world = synchronous(client.load_world("Town10HD_Opt"))
    (car,) = spawn(client, world, 1)
    blueprint = world.get_blueprint_library().find("sensor.lidar.ray_cast")
    for name, value in {
        "channels": 64,
        "points_per_second": 1_300_000,
        "rotation_frequency": 20,
        "range": 100,
        "dropoff_general_rate": 0.0,
    }.items():
        blueprint.set_attribute(name, str(value))
    place = carla.Transform(carla.Location(z=2.4))
    sensor = world.spawn_actor(blueprint, place, attach_to=world.get_actor(car))
    scans = queue.Queue()
    sensor.listen(lambda scan: scans.put((scan.frame, len(scan))))
    seen = []

    def turn():
        frame = world.tick()
        seen.append((frame, scans.get(timeout=60.0)))

    tell("tick and lidar scan of 65,000 rays", millis(turn, 60), "ms")
    lost = sum(frame != scan[0] for frame, scan in seen)
    tell("lidar scans lost", lost, f"of {len(seen)}")
    tell("points in a scan", statistics.mean(scan[1] for _, scan in seen), "")
    sensor.stop()
    time.sleep(0.2)


PARTS = {
    part.__name__: part for part in (start, calls, ticks, batch, loads, camera, lidar)
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--causeway", default=os.environ.get("CAUSEWAY_BIN", "causeway")
    )
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("parts", nargs="*", help=", ".join(PARTS))
    asked = parser.parse_args()
    site = Site(asked.causeway, asked.port)
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    try:
        for name in asked.parts or PARTS:
            PARTS[name](site)
            sys.stdout.flush()
    finally:
        site.stop()
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main()
