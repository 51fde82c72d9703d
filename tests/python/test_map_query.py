"""Maps without a site: `causeway map query` and `causeway.maps` say what CARLA's client says."""

import json
import subprocess

import carla
import numpy as np
import pytest
from causeway import maps

from running_site import binary

TOWN = "Town01"


@pytest.fixture(scope="module")
def town():
    with maps.Map(TOWN, program=str(binary())) as opened:
        yield opened


@pytest.fixture(scope="module")
def theirs(tmp_path_factory):
    """The same map in CARLA's client."""
    path = tmp_path_factory.mktemp("map") / f"{TOWN}.xodr"
    subprocess.run([binary(), "map", "export", TOWN, "-o", path], check=True)
    return carla.Map(TOWN, path.read_text())


def points(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-150.0, 150.0, size=(count, 3)) * (1, 1, 0)


def lane_key(waypoint) -> tuple[int, int, int]:
    return waypoint.road_id, waypoint.section_id, waypoint.lane_id


def assert_same(found: maps.Waypoints, index: int, wanted: carla.Waypoint) -> None:
    row, place = found.rows[index], wanted.transform
    assert (row["road"], row["section"], row["lane"]) == lane_key(wanted)
    for axis in "xyz":
        assert row[axis] == pytest.approx(getattr(place.location, axis), abs=1e-3)
    for angle in ("pitch", "yaw"):
        off = (row[angle] - getattr(place.rotation, angle) + 180.0) % 360.0 - 180.0
        assert abs(off) < 1e-2, angle
    assert row["s"] == pytest.approx(wanted.s, abs=1e-3)
    assert row["width"] == pytest.approx(wanted.lane_width, abs=1e-4)
    assert row["type"] == int(wanted.lane_type)
    assert row["lane_change"] == int(wanted.lane_change)
    assert row["junction"] == (wanted.junction_id if wanted.is_junction else -1)
    for side, beside in (("left", wanted.get_left_lane()), ("right", wanted.get_right_lane())):
        assert tuple(row[side]) == (lane_key(beside) if beside else (-1, -1, 0))
    for side, mark in (
        ("left_mark", wanted.left_lane_marking),
        ("right_mark", wanted.right_lane_marking),
    ):
        assert (row[side]["type"], row[side]["color"]) == (int(mark.type), int(mark.color))
    on = sorted(tuple(ident[:3]) for ident in found.next2[index])
    assert on == sorted({lane_key(one) for one in wanted.next(2.0)})
    back = sorted(tuple(ident[:3]) for ident in found.prev2[index])
    assert back == sorted({lane_key(one) for one in wanted.previous(2.0)})


def test_projected_points_are_the_waypoints_of_carlas_client(town, theirs):
    asked = points(300)
    found = town.project(asked)
    assert found.found.all() and len(found) == 300
    for index, (x, y, z) in enumerate(asked):
        assert_same(found, index, theirs.get_waypoint(carla.Location(x, y, z)))


def test_points_beside_the_lanes_are_inside_of_none(town, theirs):
    asked = points(300)
    found = town.inside(asked)
    for index, (x, y, z) in enumerate(asked):
        wanted = theirs.get_waypoint(carla.Location(x, y, z), project_to_road=False)
        assert found.found[index] == (wanted is not None)
        if wanted is None:
            assert (found["road"][index], found["lane"][index]) == (0, 0)
    assert 0 < found.found.sum() < 300


def test_other_lanes_are_found_when_asked_for(town, theirs):
    asked = points(50)
    found = town.project(asked, lanes=int(carla.LaneType.Sidewalk))
    for index, (x, y, z) in enumerate(asked):
        sidewalk = theirs.get_waypoint(carla.Location(x, y, z), lane_type=carla.LaneType.Sidewalk)
        assert_same(found, index, sidewalk)
    assert set(town.project(asked, lanes=maps.ANY)["type"]) > {maps.DRIVING}


def test_places_by_road_lane_and_s_are_found_or_not(town, theirs):
    every = town.generate(20.0)
    again = town.at(every["road"], every["lane"], every["s"])
    assert again.found.all()
    assert np.abs(again["x"] - every["x"]).max() < 1e-3
    for index in range(0, len(again), 17):
        row = again.rows[index]
        wanted = theirs.get_waypoint_xodr(int(row["road"]), int(row["lane"]), float(row["s"]))
        assert_same(again, index, wanted)
    assert not town.at(4_000_000, 1, 0.0).found.any()
    assert len(every) == len(theirs.generate_waypoints(20.0))


def test_the_topology_is_that_of_carlas_client(town, theirs):
    found = {(start[:3], end[:3]) for start, end in town.topology()}
    wanted = {(lane_key(start), lane_key(end)) for start, end in theirs.get_topology()}
    assert found == wanted


def test_many_points_are_one_question(town):
    found = town.project(points(20_000)[:, :2])
    assert found.found.all() and len(found) == 20_000


def test_what_cannot_be_asked_is_an_error_and_the_map_goes_on(town):
    for question in (
        lambda: town.project([[1.0, 2.0, 3.0, 4.0]]),
        lambda: town.project([[float("nan"), 0.0]]),
        lambda: town.generate(0.0),
        lambda: town.at(-1, 1, 0.0),
    ):
        with pytest.raises(ValueError):
            question()
    assert len(town.project([])) == 0
    assert town.project([[0.0, 0.0]]).found.all()


def test_a_map_that_is_not_there_is_told_with_those_that_are():
    with pytest.raises(ValueError, match=r"no map \"Atlantis\".*Town01"):
        maps.Map("Atlantis", program=str(binary()))
    with pytest.raises(FileNotFoundError, match="causeway-of-nobody"):
        maps.Map(TOWN, program="causeway-of-nobody")


def test_a_closed_map_says_so():
    opened = maps.Map(TOWN, program=str(binary()))
    opened.close()
    opened.close()
    with pytest.raises(ValueError, match="closed"):
        opened.topology()


def test_the_command_answers_lines_of_json():
    asked = '{"project": {"points": [[10, 20, 0]]}}\nnonsense\n'
    result = subprocess.run(
        [binary(), "map", "query", TOWN], input=asked, capture_output=True, text=True, check=True
    )
    answer, refusal = map(json.loads, result.stdout.splitlines())
    assert answer["columns"][:4] == ["road", "section", "lane", "s"] and len(answer["rows"]) == 1
    assert "error" in refusal
