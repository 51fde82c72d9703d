"""Map, waypoints, junctions and landmarks of CARLA's own client, beside the OpenDRIVE text."""

import collections
import itertools
import math
import re
import xml.etree.ElementTree as xml

import carla
import pytest

from faulty_maps import document, road

DRIVING = carla.LaneType.Driving
#: OpenDRIVE's numbers of the signs that our towns have.
SIGNS = {"StopSign": "206", "YieldSign": "205", "MaximumSpeed": "274"}


@pytest.fixture(scope="module")
def town(site) -> carla.Map:
    """A town with lights, signs, junctions and roads of several lanes."""
    from carla_site import fresh

    return fresh(site.carla_port).get_world().get_map()


@pytest.fixture(scope="module")
def text(town) -> xml.Element:
    return xml.fromstring(town.to_opendrive())


@pytest.fixture(scope="module")
def places(town) -> list[carla.Waypoint]:
    return town.generate_waypoints(7.0)


def lane_element(text: xml.Element, place: carla.Waypoint) -> xml.Element:
    sections = text.findall(f"road[@id='{place.road_id}']/lanes/laneSection")
    section = [one for one in sections if float(one.get("s")) <= place.s + 1e-6][-1]
    (lane,) = (one for one in section.iter("lane") if int(one.get("id")) == place.lane_id)
    return lane


def in_force(records: list[xml.Element], offset_m: float) -> xml.Element:
    return [one for one in records if float(one.get("sOffset")) <= offset_m + 1e-6][-1]


def section_start(text: xml.Element, place: carla.Waypoint) -> float:
    sections = text.findall(f"road[@id='{place.road_id}']/lanes/laneSection")
    return max(float(one.get("s")) for one in sections if float(one.get("s")) <= place.s + 1e-6)


def has_bends(text: xml.Element, place: carla.Waypoint) -> bool:
    pieces = text.findall(f"road[@id='{place.road_id}']/planView/geometry")
    return any(piece.find("line") is None for piece in pieces)


def key(place: carla.Waypoint) -> tuple:
    return (place.road_id, place.section_id, place.lane_id)


def test_lanes_have_the_width_and_type_that_the_map_says(town, text, places):
    for place in places:
        lane = lane_element(text, place)
        assert lane.get("type") == "driving" and place.lane_type == DRIVING
        offset_m = place.s - section_start(text, place)
        width = in_force(lane.findall("width"), offset_m)
        at = offset_m - float(width.get("sOffset"))
        wanted = sum(float(width.get(name)) * at**power for power, name in enumerate("abcd"))
        assert place.lane_width == pytest.approx(wanted, abs=1e-3)


def test_markings_are_those_of_the_lanes_outer_border(text, places):
    types = collections.Counter()
    for place in places:
        lane = lane_element(text, place)
        offset_m = place.s - section_start(text, place)
        mark = in_force(lane.findall("roadMark"), offset_m)
        seen = place.right_lane_marking
        assert str(seen.type).replace("NONE", "none").lower() == mark.get("type").replace(" ", "")
        assert str(seen.color).lower() == mark.get("color")
        if mark.get("type") != "none":
            assert seen.width == pytest.approx(float(mark.get("width")), abs=1e-6)
        allowed = {"none": "NONE", "both": "Both", "increase": "Left", "decrease": "Right"}
        assert str(seen.lane_change) == allowed[mark.get("laneChange", "both")]
        types[str(seen.type)] += 1
    assert len(types) > 1, types


def test_next_and_previous_are_as_far_along_the_road_as_asked_for(places):
    checked = 0
    for place in places[::5]:
        here = place.transform.location
        for ahead in place.next(3.0):
            if ahead.road_id == place.road_id:
                checked += 1
                assert abs(ahead.s - place.s) == pytest.approx(3.0, abs=1e-3)
            assert min(one.transform.location.distance(here) for one in ahead.previous(3.0)) < 0.05
    assert checked > 20


def test_steps_to_the_lanes_ends_stay_on_the_road(places):
    checked = 0
    for place in places[::11]:
        try:
            ahead, back = place.next_until_lane_end(2.0), place.previous_until_lane_start(2.0)
        except RuntimeError:
            # The client refuses where the way to the end is a multiple of the step.
            continue
        checked += 1
        assert {one.road_id for one in ahead[:-1] + back[:-1]} <= {place.road_id}
        for steps in (ahead[:-1], back[:-1]):
            apart = [abs(one.s - other.s) for one, other in itertools.pairwise(steps)]
            assert apart == pytest.approx([2.0] * len(apart), abs=1e-3)
    assert checked > 20


def test_neighbours_are_symmetric_and_a_lane_width_apart(places):
    pairs = 0
    for place in places:
        right = place.get_right_lane()
        if right is None or right.lane_type != DRIVING:
            continue
        assert right.lane_id * place.lane_id > 0
        left = right.get_left_lane()
        assert key(left) == key(place)
        apart = right.transform.location.distance(place.transform.location)
        assert apart == pytest.approx((right.lane_width + place.lane_width) / 2.0, rel=0.02)
        pairs += 1
    assert pairs > 20


def test_lanes_may_be_changed_where_the_line_between_them_allows_it(places):
    kinds = collections.Counter()
    for place in places:
        right = place.right_lane_marking.lane_change
        change = place.lane_change
        towards = {carla.LaneChange.Both, carla.LaneChange.Right}
        if place.lane_id < 0:
            assert bool(change & carla.LaneChange.Right) == (right in towards)
        kinds[str(change)] += 1
    assert len(kinds) > 1, kinds


def test_a_place_is_found_on_its_lane_and_not_beside_the_road(town, text, places):
    inner = [one for one in places if not one.is_junction and one.s > 3.0]
    for place in inner[::7]:
        again = town.get_waypoint(place.transform.location)
        assert key(again) == key(place)
        # The client measures bends along their chords.
        if not has_bends(text, place):
            assert again.s == pytest.approx(place.s, abs=1e-3)
        by_number = town.get_waypoint_xodr(place.road_id, place.lane_id, place.s)
        assert by_number.transform.location.distance(place.transform.location) < 1e-3
        assert place.is_rht
    far = carla.Location(5000.0, 5000.0, 0.0)
    assert town.get_waypoint(far, project_to_road=False) is None
    assert town.get_waypoint(far) is not None
    assert town.get_waypoint_xodr(999_999, 1, 0.0) is None
    sidewalk = town.get_waypoint(places[0].transform.location, lane_type=carla.LaneType.Sidewalk)
    assert sidewalk.lane_type == carla.LaneType.Sidewalk


def test_every_lane_of_the_topology_leads_to_another(town):
    topology = town.get_topology()
    begins = {key(begin) for begin, _ in topology}
    for begin, end in topology:
        assert (begin.road_id, begin.lane_id) == (end.road_id, end.lane_id) or begin.next(0.5)
        assert any(key(after) in begins for after in end.next(2.0)), key(end)


def test_a_junction_holds_its_ways_and_pairs_their_ends(town, text, places):
    inside = [place for place in places if place.is_junction]
    ids = {int(one.get("id")) for one in text.iterfind("junction")}
    for place in inside[::9]:
        junction = place.get_junction()
        assert junction.id == place.junction_id and junction.id in ids and place.is_intersection
        box = junction.bounding_box
        at = place.transform.location
        assert abs(at.x - box.location.x) <= box.extent.x + 1.0
        assert abs(at.y - box.location.y) <= box.extent.y + 1.0
        for begin, end in junction.get_waypoints(DRIVING):
            assert begin.road_id == end.road_id and begin.lane_id == end.lane_id
            assert begin.junction_id == end.junction_id == junction.id
    assert all(
        place.junction_id == -1 and place.get_junction() is None
        for place in places
        if not place.is_junction
    )


def test_crosswalks_are_closed_polygons(town):
    corners = town.get_crosswalks()
    count = 0
    while corners:
        first, rest = corners[0], corners[1:]
        end = next(at for at, corner in enumerate(rest) if corner.distance(first) < 0.01)
        assert end >= 3
        corners = rest[end + 1 :]
        count += 1
    assert count > 10


def test_geographic_places_come_back(town, text):
    reference = text.find("header/geoReference").text
    origin = [
        float(re.search(rf"\+{name}=(\S+)", reference).group(1)) for name in ("lat_0", "lon_0")
    ]
    zero = town.transform_to_geolocation(carla.Location())
    assert (zero.latitude, zero.longitude) == pytest.approx(origin, abs=1e-6)
    for place in (carla.Location(120.0, -80.0, 7.0), carla.Location(-333.0, 250.0, 0.0)):
        geo = town.transform_to_geolocation(place)
        assert town.geolocation_to_transform(geo).distance(place) < 0.01
        assert geo.altitude == pytest.approx(place.z)
        east_m = math.radians(geo.longitude - zero.longitude) * 6_378_137.0
        assert east_m * math.cos(math.radians(zero.latitude)) == pytest.approx(place.x, rel=0.01)


def test_landmarks_are_the_signals_of_the_map(town, text):
    signals = {one.get("id"): one for one in text.iter("signal")}
    marks = town.get_all_landmarks()
    by_type = collections.Counter(one.get("type") for one in text.iter("signal"))
    for kind, count in by_type.items():
        of_type = town.get_all_landmarks_of_type(kind)
        assert len({mark.id for mark in of_type}) == count
    assert {mark.id for mark in marks} == set(signals)
    for mark in marks:
        signal = signals[mark.id]
        assert (mark.name, mark.type, mark.country) == tuple(
            signal.get(name) for name in ("name", "type", "country")
        )
        assert mark.sub_type == signal.get("subtype") and mark.text == signal.get("text", "")
        for name in ("value", "height", "width"):
            assert getattr(mark, name) == pytest.approx(float(signal.get(name)), abs=1e-6)
        assert mark.z_offset == pytest.approx(float(signal.get("zOffset")), abs=1e-6)
        assert mark.is_dynamic == (signal.get("dynamic") == "yes")
        assert mark.unit == signal.get("unit", "")
        assert all(first <= last for first, last in mark.get_lane_validities())


def test_landmarks_ahead_are_as_far_as_the_way_to_them(town):
    sign = town.get_all_landmarks_of_type(SIGNS["MaximumSpeed"])[0]
    lane = sign.get_lane_validities()[0][0]
    at = town.get_waypoint_xodr(sign.road_id, lane, sign.s)
    before = at.previous(12.0)[0]
    seen = {mark.id: mark for mark in before.get_landmarks(20.0)}
    assert seen[sign.id].distance == pytest.approx(12.0, abs=0.1)
    assert seen[sign.id].waypoint.transform.location.distance(at.transform.location) < 0.1
    assert sign.id not in [mark.id for mark in before.get_landmarks(5.0)]
    of_type = before.get_landmarks_of_type(20.0, SIGNS["MaximumSpeed"])
    assert {mark.type for mark in of_type} == {SIGNS["MaximumSpeed"]}


def test_stencils_of_an_uploaded_map_are_its_road_marks(client):
    marks = [("STOP", 10.0), ("ArrowType2L", 30.0), ("STOP", 40.0)]
    stencil = (
        '<object id="{at:.0f}" name="Stencil_{kind}" s="{at}" t="-1.5" zOffset="0" hdg="0" '
        'roll="0" pitch="0" orientation="-" type="-1" width="2" length="1"/>'
    )
    stencils = "".join(stencil.format(kind=kind, at=at) for kind, at in marks)
    uploaded = document(road(length=50, extra=f"<objects>{stencils}</objects>"))
    town = client.generate_opendrive_world(uploaded).get_map()
    found = town.get_all_road_marks()
    assert sorted((mark.type, mark.s) for mark in found) == sorted(marks)
    assert len(town.get_all_road_marks_of_type("STOP")) == 2
    assert [mark.name for mark in town.get_road_marks_from_id("30")] == ["Stencil_ArrowType2L"]
    assert all(mark.road_id == 1 and mark.t == -1.5 and mark.width == 2.0 for mark in found)


def test_the_map_is_written_as_it_was_read(town, tmp_path):
    path = tmp_path / "town.xodr"
    town.save_to_disk(str(path))
    assert path.read_text().rstrip("\n") == town.to_opendrive().rstrip("\n")
    town.cook_in_memory_map(str(tmp_path / "graph"))
    assert (tmp_path / "graph").stat().st_size > 10_000


def test_numbers_of_signs_and_lanes_are_carlas():
    numbers = {name: getattr(carla.LandmarkType, name) for name in SIGNS}
    assert numbers == SIGNS
    assert len([name for name in dir(carla.LandmarkType) if name[0].isupper()]) == 35
    bits = {str(kind): int(value) for value, kind in carla.LaneType.values.items()}
    assert bits["Driving"] == 2 and bits["Sidewalk"] == 32 and bits["Any"] == -2
    changes = [int(getattr(carla.LaneChange, name)) for name in ("NONE", "Right", "Left", "Both")]
    assert changes == [0, 1, 2, 3]
