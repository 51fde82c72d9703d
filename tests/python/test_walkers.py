"""Goal: CARLA's own client loads our navigation files, and steers walkers sensibly with them.

Method: a server with one map and nothing but walkers, and the client in a process of its own, since
a fault in a file can end the process. The client finds the ways and moves the walkers; what it does
is held against the sidewalks and crossings of the map as the client itself sees them.
"""

import itertools
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from mini_server import STEP_SECS, MiniServer
from running_site import CACHE

pytest.importorskip("carla", reason="the client is not installed")

ROOT = Path(__file__).parent.parent.parent
NAMES = [f"Town0{number}" for number in range(1, 8)] + ["Town10HD"]
KERB_M = 0.15
WALKER_RADIUS_M = 0.3
SPEED_MPS = 1.4
# Time between two places of a track.
SAMPLE_SECS = 5 * STEP_SECS

# Draws places, starts walkers and prints where they are every five ticks. Arguments: port, folder
# for files, walkers, ticks, share of walkers that may cross roads, and where they are sent:
# anywhere, or over the street, as near to a crossing or as far from any as can be.
CLIENT = """
import json, os, sys, carla

port, folder, walkers, ticks, crossing, sent = sys.argv[1:]
client = carla.Client("127.0.0.1", int(port))
client.set_timeout(60.0)
client.set_files_base_folder(folder)
world = client.get_world()
world.set_pedestrians_seed(7)
world.set_pedestrians_cross_factor(float(crossing))
town = world.get_map()

def beside(at):
    # Distance from the middle of the nearest sidewalk, its width, and the height above its lane.
    lane = town.get_waypoint(at, lane_type=carla.LaneType.Sidewalk)
    middle = lane.transform.location
    apart = ((at.x - middle.x) ** 2 + (at.y - middle.y) ** 2) ** 0.5
    return [at.x, at.y, at.z, apart, lane.lane_width, at.z - middle.z]

draws = [world.get_random_location_from_navigation() for _ in range(300)]
places = [None if at is None else beside(at) for at in draws]
corners = town.get_crosswalks()

def over_the_street():
    # Pairs of places with nothing but a street between them, and how far from any crossing.
    for start in draws:
        for goal in draws:
            middle = (start + goal) / 2.0
            if not 8.0 < start.distance(goal) < 20.0 or start.x + start.y > goal.x + goal.y:
                continue
            if town.get_waypoint(middle, project_to_road=False) and town.get_waypoint(
                middle + (goal - start) / 8.0, project_to_road=False
            ):
                yield min(middle.distance(corner) for corner in corners), start, goal

if sent == "anywhere":
    ways = list(zip(draws, reversed(draws)))
else:
    order = -1.0 if sent == "far" else 1.0
    ways = [way[1:] for way in sorted(over_the_street(), key=lambda way: order * way[0])]
library = world.get_blueprint_library()
tracks, goals, controllers = [], [], []
for start, goal in ways[:int(walkers)]:
    start = carla.Transform(start + carla.Location(z=0.9))
    walker = world.spawn_actor(library.find("walker.pedestrian.0001"), start)
    world.tick()
    brain = world.spawn_actor(library.find("controller.ai.walker"), carla.Transform(), walker)
    world.tick()
    brain.start()
    brain.go_to_location(goal)
    brain.set_max_speed(1.4)
    goals.append([goal.x, goal.y])
    controllers.append((walker, brain))
    tracks.append([])
for tick in range(int(ticks)):
    world.tick()
    if tick % 5:
        continue
    for track, (walker, _) in zip(tracks, controllers):
        at = walker.get_location()
        track.append(beside(carla.Location(at.x, at.y, at.z - 0.9)))
corners = [[corner.x, corner.y] for corner in corners]
told = {"places": places, "tracks": tracks, "goals": goals, "crosswalks": corners}
print(json.dumps(told), flush=True)
# The client library may end the process when it is taken down in order.
os._exit(0)
"""


@pytest.fixture(scope="module")
def example():
    """Runs an example of the crate `roads` and returns what it prints."""
    target = os.environ.get("CARGO_TARGET_DIR", str(CACHE / "target"))

    def run(name: str, *arguments: str) -> str:
        command = ["cargo", "run", "--release", "--quiet", "-p", "roads", "--example", name]
        finished = subprocess.run(
            [*command, "--", *arguments],
            cwd=ROOT,
            env=os.environ | {"CARGO_TARGET_DIR": target},
            capture_output=True,
            check=True,
            text=True,
            timeout=900,
        )
        return finished.stdout

    return run


@pytest.fixture
def walk(example, tmp_path):
    """Lets the client walk in a town; `tiles` cuts the file into that many along each side."""

    def run(name, *, walkers=0, ticks=0, crossing=0.0, tiles=None, sent="anywhere") -> dict:
        served = tmp_path / "served"
        words = [name, str(served)] + ([] if tiles is None else [str(tiles)])
        path = example("nav", *words).strip()
        server = MiniServer(
            map_name=name,
            opendrive=example("print_town", name),
            nav_path=path,
            nav=(served / path).read_bytes(),
        )
        options = [str(server.port), str(tmp_path / "files"), str(walkers), str(ticks)]
        try:
            finished = subprocess.run(
                [sys.executable, "-c", CLIENT, *options, str(crossing), sent],
                capture_output=True,
                text=True,
                timeout=600,
            )
        finally:
            server.close()
        assert finished.returncode == 0, f"{name} ended the client: {finished.stderr[-2000:]}"
        return json.loads(finished.stdout.splitlines()[-1])

    return run


def crosswalks(seen: dict) -> list[list]:
    """The outlines in the client's flat list of corners, each of which ends where it began."""
    outlines, outline = [], []
    for corner in seen["crosswalks"]:
        outline.append(corner)
        if len(outline) > 1 and math.dist(outline[0], corner) < 1e-3:
            outlines.append(outline)
            outline = []
    return outlines


def is_inside(outline: list, x: float, y: float, margin_m: float) -> bool:
    """Whether a place lies in a convex outline, or not further out than the margin."""
    sides = []
    for (x0, y0), (x1, y1) in itertools.pairwise(outline):
        cross = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
        sides.append(cross / math.dist((x0, y0), (x1, y1)))
    return min(sides) >= -margin_m or max(sides) <= margin_m


def on_sidewalk(place: list, margin_m: float) -> bool:
    return place[3] <= place[4] / 2 + margin_m


@pytest.mark.parametrize("name", NAMES)
def test_random_places_of_the_client_lie_on_sidewalks_of_every_town(name, walk):
    places = walk(name)["places"]

    assert None not in places
    assert len({tuple(place) for place in places}) == len(places)
    for place in places:
        # On bends the client's nearest lane point lies some decimetres further on.
        assert on_sidewalk(place, -WALKER_RADIUS_M + 0.3), place
        assert abs(place[5] - KERB_M) < 0.1, place
    # Degenerate polygons would collect them at their edges.
    middles = [place for place in places if place[3] < place[4] / 4]
    assert len(middles) > len(places) / 4


@pytest.mark.parametrize("name", ["Town10HD", "Town03", "Town02"])
def test_walkers_of_the_client_keep_to_sidewalks_and_crossings_and_get_on(name, walk):
    walkers = 12
    seen = walk(name, walkers=walkers, ticks=1200)
    assert_walked(seen, walkers)
    assert off_road_share(seen) > 0.995


def test_walkers_of_the_client_cross_streets_at_crossings(walk):
    seen = walk("Town02", walkers=8, ticks=900, sent="near")
    assert off_road_share(seen) > 0.995
    assert arrived(seen) == 8
    outlines = crosswalks(seen)
    for track in seen["tracks"]:
        assert any(is_inside(line, *place[:2], 0.0) for place in track for line in outlines)


def test_walkers_cross_streets_anywhere_only_if_they_may(walk):
    there = walk("Town01", walkers=8, ticks=900, crossing=1.0, sent="far")
    around = walk("Town01", walkers=8, ticks=400, sent="far")
    # On the road the client's steering may lead past the goal.
    assert arrived(there) >= 4
    assert off_road_share(there) < 0.95
    assert arrived(around) == 0
    assert off_road_share(around) > 0.995


def test_walkers_pass_from_tile_to_tile(walk):
    seen = walk("Town10HD", walkers=12, ticks=1200, tiles=4)
    assert_walked(seen, 12)


def arrived(seen: dict) -> int:
    """How many walkers were at their goals; the client then sends them elsewhere."""
    tracks = zip(seen["tracks"], seen["goals"], strict=True)
    return sum(min(math.dist(place[:2], goal) for place in track) < 2.0 for track, goal in tracks)


def off_road_share(seen: dict) -> float:
    """The share of places on a sidewalk or a crossing."""
    outlines = crosswalks(seen)
    good = [
        on_sidewalk(place, 0.35) or any(is_inside(line, *place[:2], 0.7) for line in outlines)
        for track in seen["tracks"]
        for place in track
    ]
    return sum(good) / len(good)


def assert_walked(seen: dict, walkers: int) -> None:
    nearer = 0
    for track, goal in zip(seen["tracks"], seen["goals"], strict=True):
        steps = [math.dist(a[:2], b[:2]) for a, b in itertools.pairwise(track)]
        assert max(steps) < 1.5 * SPEED_MPS * SAMPLE_SECS, max(steps)
        assert all(-0.1 < place[5] < KERB_M + 0.1 for place in track)
        # Waiting for vehicles at a crossing is all that may hold a walker up; there are none.
        away_m = [math.dist(place[:2], goal) for place in (track[0], track[-1])]
        assert sum(steps) > 30.0 or away_m[1] < 3.0, (sum(steps), away_m)
        nearer += away_m[1] < away_m[0]
    assert nearer >= walkers / 3
