"""What recording and replaying cost, through CARLA's own client.

Usage: recorder.py [--causeway PATH] [--port PORT] [--keep FOLDER]. Starts a site of its own and
prints one line per figure. Wants `pip install carla==0.9.16 msgpack`, and gzip and zstd on the
path.
"""

import argparse
import contextlib
import math
import os
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import carla
import msgpack
from wheel import (
    CIRCLES_TOWN,
    STEP_SECS,
    Site,
    connect,
    drive_in_circles,
    spawn,
    synchronous,
    tell,
)

CARS = 100
# Ticks of one round; with and without a recording take turns.
TICKS = 50
# How long threads may take for the beginning of a recording: maps and snapshots of a journal.
BEGIN_SECS = 0.2
ROUNDS = 40
HOUR_FRAMES = round(3_600 / STEP_SECS)


class Measured:
    """Ticks of one kind: how long each took, and how long processors worked for them."""

    def __init__(self, site: Site):
        self.site, self.took, self.worked = site, [], 0.0

    def tick(self, world: carla.World) -> None:
        worked = cpu_secs(self.site)
        for _ in range(TICKS):
            begun = time.perf_counter()
            world.tick()
            self.took.append(time.perf_counter() - begun)
        self.worked += cpu_secs(self.site) - worked


def cpu_secs(site: Site) -> float:
    """Of all threads of a site that are there now."""
    command = ["pgrep", "--parent", str(site.process.pid)]
    services = subprocess.run(
        command, capture_output=True, text=True, check=True
    ).stdout
    total_nanos = 0
    for pid in services.split():
        for thread in Path(f"/proc/{pid}/task").iterdir():
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                total_nanos += int((thread / "schedstat").read_text().split()[0])
    return total_nanos / 1e9


def cost(site: Site, client: carla.Client, world: carla.World, folder: Path) -> None:
    """Rounds with and without a recording take turns."""
    for has_additional in (False, True):
        path = folder / f"cost-{has_additional}.log"
        plain, recorded, begun = Measured(site), Measured(site), 0.0
        for _ in range(ROUNDS):
            plain.tick(world)
            worked = cpu_secs(site)
            client.start_recorder(str(path), has_additional)
            # The first frame has every actor.
            world.tick()
            time.sleep(BEGIN_SECS)
            begun += cpu_secs(site) - worked
            recorded.tick(world)
            client.stop_recorder()
            client.show_recorder_actors_blocked(str(path), 1e9, 0.0)
        what = "with" if has_additional else "without"
        longer = statistics.median(recorded.took) / statistics.median(plain.took) - 1.0
        tell(f"recording {what} additional data", 100.0 * longer, "% of a tick, median")
        worked = recorded.worked / plain.worked - 1.0
        tell("  work of all processors", 100.0 * worked, "% of a tick")
        tell("  work for its beginning, once", 1_000.0 * begun / ROUNDS, "ms")
        tell(
            "  a tick without recording", 1_000.0 * statistics.median(plain.took), "ms"
        )


def sizes(client: carla.Client, world: carla.World, folder: Path) -> Path:
    """Of an hour, from a minute; at rest as gzip -6 and zstd -3 have it."""
    path = folder / "minute.log"
    for has_additional in (True, False):
        client.start_recorder(str(path), has_additional)
        for _ in range(round(60 / STEP_SECS)):
            world.tick()
        client.stop_recorder()
        client.show_recorder_actors_blocked(str(path), 1e9, 0.0)
        frames = 60 / STEP_SECS
        what = "with" if has_additional else "without"
        hour = HOUR_FRAMES / frames / 1e6
        tell(f"an hour {what} additional data", path.stat().st_size * hour, "MB")
        for command in (["gzip", "-6", "-c"], ["zstd", "-3", "-q", "-c"]):
            packed = subprocess.run(
                [*command, str(path)], capture_output=True, check=True
            ).stdout
            tell(f"  {command[0]} {command[1]}", len(packed) * hour, "MB")
    return path


def replays(
    client: carla.Client, world: carla.World, path: Path, cars: list[int]
) -> None:
    """How fast, and how near to what was recorded."""
    recorded = client.show_recorder_file_info(str(path), True)
    places = poses(recorded)
    client.replay_file(str(path), 0.0, 0.0, 0)
    count = round(60 / STEP_SECS)
    begun = time.perf_counter()
    for _ in range(count - 1):
        world.tick()
    took = time.perf_counter() - begun
    tell("replay, a client listening", 60.0 / took, "times real time")
    client.replay_file(str(path), 0.0, 0.0, 0)
    apart, turned = 0.0, 0.0
    for number in range(1, 200):
        frame = world.tick()
        snapshot = world.get_snapshot()
        while snapshot.frame < frame:
            snapshot = world.get_snapshot()
        for id_ in cars:
            (x, y, z), angles = places[number][id_]
            pose = snapshot.find(id_).get_transform()
            place, turn = pose.location, pose.rotation
            apart = max(apart, math.dist((x, y, z), (place.x, place.y, place.z)))
            turns = zip(angles, (turn.roll, turn.pitch, turn.yaw), strict=True)
            turned = max(turned, *(abs((a - b + 180) % 360 - 180) for a, b in turns))
    tell("replayed poses are off by at most", 1_000.0 * apart, "mm")
    tell("", 1_000.0 * turned, "thousandths of a degree")
    client.stop_replayer(True)


class Calls:
    """Calls of CARLA's protocol without its library, which listens to every frame."""

    def __init__(self, port: int):
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=60.0)
        self.answers = msgpack.Unpacker()

    def ask(self, method: str, *arguments: object) -> object:
        call = [0, 1, method, [[False], *arguments]]
        self.socket.sendall(msgpack.packb(call))
        while True:
            for _, _, error, result in self.answers:
                assert not error, error
                return result
            self.answers.feed(self.socket.recv(65_536))


def unheard_replay(program: str, path: Path) -> float:
    """How much faster than real time a replay is to which nobody listens."""
    site = Site(program, 0, "--recordings", str(path.parent / "unheard"))
    try:
        # The client that makes it synchronous goes before the replay.
        prepare = [sys.executable, __file__, "--prepare", "--port", str(site.port)]
        subprocess.run(prepare, check=True)
        calls = Calls(site.port)
        count = round(60 / STEP_SECS) - 1
        offset = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
        said = calls.ask("replay_file", str(path), 0.0, 0.0, 0, False, offset)
        assert "Replaying from" in str(said), said
        begun = time.perf_counter()
        for _ in range(count):
            calls.ask("tick_cue")
        # Answered when the last tick is done.
        calls.ask("get_actors_by_id", [])
        return count * STEP_SECS / (time.perf_counter() - begun)
    finally:
        site.stop()


def prepare(port: int) -> None:
    """A synchronous world for `unheard_replay`."""
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    synchronous(client.load_world(CIRCLES_TOWN)).tick()


def poses(text: str) -> list[dict]:
    """Place in metres and roll, pitch and yaw in degrees of each actor, by frame."""
    frames = []
    for line in text.splitlines():
        if line.startswith("Frame "):
            frames.append({})
        elif " Location: (" in line and " Rotation: (" in line:
            words = line.replace("(", "").replace(")", "").replace(",", "").split()
            numbers = [float(word) for word in (*words[3:6], *words[7:10])]
            place = tuple(number / 100.0 for number in numbers[:3])
            frames[-1][int(words[1])] = (place, numbers[3:])
    return frames


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--causeway", default=os.environ.get("CAUSEWAY_BIN", "causeway")
    )
    parser.add_argument("--port", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="a folder for the recordings")
    parser.add_argument("--prepare", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.prepare:
        prepare(asked.port)
        os._exit(0)
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with tempfile.TemporaryDirectory() as temporary:
        # Where journals go beside logs of other folders.
        site = Site(asked.causeway, asked.port, "--recordings", f"{temporary}/site")
        folder = asked.keep or Path(temporary)
        try:
            client = connect(site)
            world = synchronous(client.load_world(CIRCLES_TOWN))
            cars = spawn(client, world, CARS)
            drive_in_circles(client, cars)
            world.tick()
            cost(site, client, world, folder)
            path = sizes(client, world, folder)
            replays(client, world, path, cars)
            factor = unheard_replay(asked.causeway, path)
            tell("replay, nobody listening", factor, "times real time")
        finally:
            site.stop()
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main()
