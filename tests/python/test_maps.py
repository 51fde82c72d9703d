"""Goal: CARLA's own client reads every generated town, and sees the same lanes as we do.

Method: give it the text in a process of its own, since a fault in a map can end the process.
"""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest

from faulty_maps import MAPS
from running_site import CACHE, binary

pytest.importorskip("carla", reason="the client is not installed")

ROOT = Path(__file__).parent.parent.parent
STEP_M = 2.0
NAMES = [f"Town0{number}" for number in range(1, 8)] + ["Town10HD"]

# Reads a map from standard input and prints what the client makes of it.
CLIENT = """
import json, sys, carla

name, graph = sys.argv[1:]
world = carla.Map(name, sys.stdin.read())
world.cook_in_memory_map(graph)
places = world.generate_waypoints(2.0)
rows = []
for place in places:
    at = place.transform
    rows.append(
        (place.road_id, place.section_id, place.lane_id, place.s)
        + (at.location.x, at.location.y, at.location.z, at.rotation.yaw, at.rotation.pitch)
    )
landmarks = world.get_all_landmarks()
print(json.dumps({
    "places": rows,
    "topology": len(world.get_topology()),
    "dead_ends": [row[:4] for row, place in zip(rows, places) if not place.next(60.0)],
    "lights": sorted({mark.id for mark in landmarks if mark.type == "1000001"}),
    "signs": sorted({mark.type for mark in landmarks}),
    "crosswalk_corners": len(world.get_crosswalks()),
}))
"""


@pytest.fixture(scope="module")
def print_town():
    """Runs the example `print_town` of the crate `roads`."""
    target = os.environ.get("CARGO_TARGET_DIR", str(CACHE / "target"))
    command = ["cargo", "run", "--release", "--quiet", "-p", "roads", "--example", "print_town"]

    def run(*arguments: str) -> str:
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


def read_by_client(name: str, text: str, graph: Path) -> dict:
    finished = subprocess.run(
        [sys.executable, "-c", CLIENT, name, str(graph)],
        input=text,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert finished.returncode == 0, f"{name} ended the client: {finished.stderr}"
    complaints = [line for line in finished.stderr.splitlines() if line.strip()]
    assert not complaints, f"{name}: {complaints[:5]}"
    lines = finished.stdout.splitlines()
    assert len(lines) == 1, f"{name}: {lines[:5]}"
    return json.loads(lines[0])


def test_every_town_is_listed_under_both_names(print_town):
    listed = set(print_town().split())
    assert listed == set(NAMES) | {f"{name}_Opt" for name in NAMES}


#: Some ways through junctions there are arcs of 10 to 45 kilometres' radius. The client adds and
#: takes away that radius in numbers of four bytes, which are one to four millimetres apart.
FAR_ARCS_M = {"Town03": 8e-3, "Town04": 8e-3, "Town05": 8e-3, "Town07": 4e-3, "Town10HD": 4e-3}


@pytest.mark.parametrize("name", NAMES)
def test_the_client_reads_a_town_and_sees_the_same_lanes(name, print_town, tmp_path):
    seen = read_by_client(name, print_town(name), tmp_path / "graph")

    assert seen["dead_ends"] == []
    assert seen["topology"] > 80
    assert seen["crosswalk_corners"] % 5 == 0
    assert "274" in seen["signs"]
    if name == "Town07":
        assert {"205", "206"} <= set(seen["signs"])
    else:
        assert len(seen["lights"]) >= 12
    assert (tmp_path / "graph").stat().st_size > 10_000

    ours = [[float(word) for word in row.split()] for row in print_town(name, "2.0").splitlines()]
    assert len(ours) == len(seen["places"]) > 1000
    ours.sort(key=lambda row: row[:4])
    theirs = sorted(seen["places"], key=lambda row: row[:4])
    limit_m = FAR_ARCS_M.get(name, 1e-3)
    for our, their in zip(ours, theirs, strict=True):
        assert our[:3] == their[:3]
        assert math.isclose(our[3], their[3], abs_tol=1e-6)
        x, y, z, heading_rad, pitch_rad = our[4:]
        yaw, pitch = their[7:]
        assert math.dist((x, -y, z), their[4:7]) < limit_m, (our, their)
        assert same_angle(-math.degrees(heading_rad), yaw), (our, their)
        assert same_angle(math.degrees(pitch_rad), pitch), (our, their)


def same_angle(one_deg: float, other_deg: float) -> bool:
    return abs((one_deg - other_deg + 180.0) % 360.0 - 180.0) < 0.05


@pytest.mark.parametrize("name", NAMES)
def test_the_client_reads_a_town_under_its_second_name(name, print_town, tmp_path):
    seen = read_by_client(f"{name}_Opt", print_town(f"{name}_Opt"), tmp_path / "graph")
    assert seen["dead_ends"] == []


# Reads a map from standard input and goes along all its driving lanes, from where each begins and
# from every 2 m, as route planners do; prints what raised.
WALKER = """
import json, sys, carla

town = carla.Map("town", sys.stdin.read())
# The client looks for the start of a lane behind it, on all ways that lead to it: from a kilometre
# of road that takes minutes.
BACK_MAX_M = 150.0
starts = [place for pair in town.get_topology() for place in pair] + town.generate_waypoints(2.0)
lengths_m = {}
for place in starts:
    lengths_m[place.road_id] = max(place.s, lengths_m.get(place.road_id, 0.0))
raised, asked = [], 0

def ask(place, name, *arguments):
    global asked
    try:
        found = getattr(place, name)(*arguments)
    except RuntimeError as error:
        raised.append([place.road_id, place.section_id, place.lane_id, place.s, name, str(error)])
        return None
    asked += 1
    return found

for place in starts:
    for step, to_the_end in [
        ("next", "next_until_lane_end"), ("previous", "previous_until_lane_start")
    ]:
        reached = ask(place, step, 2.0)
        # The client has no answer where not even the first step stays on the road.
        if not reached or len(reached) > 1 or reached[0].road_id != place.road_id:
            continue
        if step == "next" or lengths_m[place.road_id] < BACK_MAX_M:
            ask(place, to_the_end, 2.0)
    ask(place, "get_left_lane"), ask(place, "get_right_lane")
print(json.dumps({"asked": asked, "raised": raised}))
"""


@pytest.mark.parametrize("name", NAMES)
def test_the_client_gets_to_the_end_of_every_lane_of_a_town(name, print_town):
    finished = subprocess.run(
        [sys.executable, "-c", WALKER],
        input=print_town(name),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert finished.returncode == 0, f"{name} ended the client: {finished.stderr}"
    seen = json.loads(finished.stdout)
    assert seen["asked"] > 5000
    assert seen["raised"] == [], f"{name}: {len(seen['raised'])} raised"


# Reads a map from standard input and asks what scripts ask; ends in words only when all went well.
SURVIVOR = """
import math, sys, carla

town = carla.Map("map", sys.stdin.read())
places = town.generate_waypoints(2.0)
for place in places:
    place.next(2.0), place.previous(2.0), place.get_left_lane(), place.get_right_lane()
    place.get_landmarks(50.0)
    assert math.isfinite(place.transform.location.x)
town.get_topology(), town.get_all_landmarks(), town.get_crosswalks()
town.get_waypoint(carla.Location(1.0, 1.0, 0.0))
town.cook_in_memory_map(sys.argv[1])
print("survived")
"""


@pytest.mark.parametrize("fault", MAPS)
def test_a_map_is_said_to_break_the_client_exactly_if_it_does(fault, tmp_path):
    path = tmp_path / "Map.xodr"
    path.write_text(MAPS[fault])
    checked = subprocess.run(
        [binary(), "map", "check", path], capture_output=True, text=True, timeout=300
    )
    said = "does not survive" not in checked.stdout
    assert (checked.returncode == 0) == said, checked.stdout + checked.stderr
    asked = subprocess.run(
        [sys.executable, "-c", SURVIVOR, str(tmp_path / "graph")],
        input=MAPS[fault],
        capture_output=True,
        text=True,
        timeout=300,
    )
    survived = asked.returncode == 0 and "survived" in asked.stdout
    assert said == survived, (
        f"{checked.stdout}; the client: {asked.returncode} {asked.stderr[-300:]}"
    )
