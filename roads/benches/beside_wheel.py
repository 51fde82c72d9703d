"""How much faster than CARLA's own client are the questions about a map?

Times carla.Map of the wheel `carla` 0.9.16 and the crate `roads` in one run: the same maps, the
same points. The wheel is called through Python, which costs time of its own; what reading one
attribute costs is measured and taken off every call. Its lists are made of Python objects, which
cannot be told apart from the work inside. Both sides compute the pose of every waypoint. A load is
of the text in memory, and ends when the map is dropped; spawn points and speed limits, which the
client's library does not work out, are not part of it.

    python roads/benches/beside_wheel.py [MAP.xodr ...]

Needs `pip install carla==0.9.16`. Without arguments: Town03 and Town10HD of CAUSEWAY_MAPS_DIR.
"""

import json
import os
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import carla

ROOT = Path(__file__).parent.parent.parent
QUESTIONS = 4000
ROUNDS = 7
STEP_M = 2.0
CALLS = ["load_s", "get_waypoint_s", "next_s", "generate_waypoints_s"]


def best(round_of_calls, calls: int) -> float:
    """Seconds per call in the fastest round."""
    seconds = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        round_of_calls()
        seconds.append(time.perf_counter() - started)
    return min(seconds) / calls


def resident_bytes() -> int:
    with open("/proc/self/status") as status:
        line = next(line for line in status if line.startswith("VmRSS:"))
    return int(line.split()[1]) * 1024


def points_of(world: carla.Map) -> list[carla.Location]:
    """Points on and beside lanes, all over the map."""
    pick = random.Random(7)
    places = world.generate_waypoints(STEP_M)
    points = []
    for _ in range(QUESTIONS):
        at = pick.choice(places).transform.location
        aside = (pick.uniform(-8.0, 8.0), pick.uniform(-8.0, 8.0))
        points.append(carla.Location(at.x + aside[0], at.y + aside[1], at.z + 0.3))
    return points


def wheel(path: Path) -> tuple[dict, list[carla.Location]]:
    text = path.read_text()
    before_bytes = resident_bytes()
    world = carla.Map("map", text)
    memory_bytes = resident_bytes() - before_bytes
    points = points_of(world)
    places = [world.get_waypoint(point) for point in points]
    python_s = best(lambda: [place.road_id for place in places], len(places))
    return {
        "load_s": best(lambda: carla.Map("map", text), 1),
        "get_waypoint_s": best(lambda: [world.get_waypoint(p) for p in points], len(points))
        - python_s,
        "next_s": best(lambda: [p.next(STEP_M) for p in places], len(places)) - python_s,
        "generate_waypoints_s": best(lambda: world.generate_waypoints(STEP_M), 1) - python_s,
        "memory_bytes": memory_bytes,
    }, points


def ours(path: Path, points: list[carla.Location]) -> dict:
    command = ["cargo", "run", "--release", "--locked", "--quiet", "-p", "roads"]
    command += ["--example", "beside_wheel", "--", str(path)]
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as questions:
        # The client mirrors y.
        questions.writelines(f"{p.x} {-p.y} {p.z}\n" for p in points)
        questions.flush()
        finished = subprocess.run(
            [*command, questions.name], cwd=ROOT, check=True, capture_output=True, text=True
        )
    return json.loads(finished.stdout)


def main() -> None:
    default = Path(os.environ.get("CAUSEWAY_MAPS_DIR", ROOT.parent / "shared" / "maps"))
    paths = [Path(argument) for argument in sys.argv[1:]]
    paths = paths or [default / "Town03.xodr", default / "Town10HD.xodr"]
    print("| map | question | wheel | Causeway | times faster |")
    print("|---|---|---|---|---|")
    for path in paths:
        theirs, points = wheel(path.resolve())
        own = ours(path.resolve(), points)
        for call in CALLS:
            times = theirs[call] / own[call]
            name = call.removesuffix("_s")
            shown = f"{theirs[call] * 1e6:.2f} µs | {own[call] * 1e6:.2f} µs"
            print(f"| {path.stem} | `{name}` | {shown} | {times:.1f} |")
        memory = [side["memory_bytes"] / 1e6 for side in (theirs, own)]
        shown = f"{memory[0]:.1f} MB | {memory[1]:.1f} MB | {memory[0] / memory[1]:.1f}"
        print(f"| {path.stem} | memory | {shown} |")


if __name__ == "__main__":
    main()
