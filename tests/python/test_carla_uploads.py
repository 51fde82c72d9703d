"""Maps that a client makes: from OpenStreetMap, and with its parameters of generation."""

import collections
import xml.etree.ElementTree as xml

import carla
import pytest

from carla_site import spawn_at, synchronous, ticks
from faulty_maps import document, road

#: Three streets across three others, some 220 m apart, as an extract of OpenStreetMap.
SIDE = range(3)


def extract() -> str:
    nodes = "".join(
        f'<node id="{10 * row + column + 1}" lat="{48.001 + 0.002 * row:.6f}" '
        f'lon="{11.001 + 0.003 * column:.6f}" version="1">'
        + ('<tag k="highway" v="traffic_signals"/>' if row == column == 1 else "")
        + "</node>"
        for row in SIDE
        for column in SIDE
    )
    return f'<osm version="0.6">{nodes}{ways("residential", True)}{ways("primary", False)}</osm>'


def ways(kind: str, along_rows: bool) -> str:
    def number(line: int, at: int) -> int:
        return 10 * line + at + 1 if along_rows else 10 * at + line + 1

    return "".join(
        f'<way id="{100 * (1 + along_rows) + line}" version="1">'
        + "".join(f'<nd ref="{number(line, at)}"/>' for at in SIDE)
        + f'<tag k="highway" v="{kind}"/><tag k="lanes" v="2"/></way>'
        for line in SIDE
    )


def converted(**settings) -> xml.Element:
    chosen = carla.Osm2OdrSettings()
    for name, value in settings.items():
        setattr(chosen, name, value)
    return xml.fromstring(carla.Osm2Odr.convert(extract(), chosen))


def lane_widths(roads: xml.Element) -> collections.Counter:
    driving = (lane for lane in roads.iter("lane") if lane.get("type") == "driving")
    return collections.Counter(float(lane.find("width").get("a")) for lane in driving)


def test_a_street_map_becomes_roads_on_which_a_car_drives(client):
    with synchronous(client.generate_opendrive_world(carla.Osm2Odr.convert(extract()))) as world:
        town = world.get_map()
        assert town.name.endswith("OpenDriveMap")
        lights = world.get_actors().filter("traffic.traffic_light")
        assert len(lights) == 4
        assert all(light.get_stop_waypoints() for light in lights)
        places = [town.get_waypoint(point.location) for point in town.get_spawn_points()]
        # Far from corners.
        place = next(one for one in places if len({way.road_id for way in one.next(60.0)}) == 1)
        blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
        pose = place.transform
        pose.location.z += 0.3
        car = world.spawn_actor(blueprint, pose)
        car.apply_control(carla.VehicleControl(throttle=0.6))
        ticks(world, 60)
        driven = town.get_waypoint(car.get_location())
        assert driven.road_id == place.road_id and driven.lane_id == place.lane_id
        assert car.get_location().distance(place.transform.location) > 5.0


def test_settings_of_the_conversion_have_their_effect():
    usual = converted()
    assert len(list(usual.iter("signal"))) == 4
    assert not list(converted(generate_traffic_lights=False).iter("signal"))
    assert len(list(converted(all_junctions_with_traffic_lights=True).iter("signal"))) > 4
    narrow = lane_widths(converted(default_lane_width=2.75))
    assert 2.75 in narrow and 2.75 not in lane_widths(usual)


def test_generation_parameters_are_taken_with_a_map(client):
    defaults = carla.OpendriveGenerationParameters()
    names = ("vertex_distance", "max_road_length", "wall_height", "additional_width")
    assert [getattr(defaults, name) for name in names] == [2.0, 50.0, 1.0, pytest.approx(0.6)]
    own = carla.OpendriveGenerationParameters(
        vertex_distance=1.0,
        max_road_length=500.0,
        wall_height=0.0,
        additional_width=0.2,
        smooth_junctions=False,
        enable_mesh_visibility=False,
        enable_pedestrian_navigation=False,
    )
    text = client.get_world().get_map().to_opendrive()
    assert client.generate_opendrive_world(text, own).get_map().to_opendrive() == text


def test_a_limit_of_a_roads_type_is_no_limit_of_vehicles(client):
    """CARLA tells 30 km/h until a sign is passed, and this road has none."""
    limit = '<type s="0" type="town"><speed max="55" unit="mph"/></type><planView>'
    text = document(road(length=200)).replace("<planView>", limit)
    with synchronous(client.generate_opendrive_world(text)) as world:
        place = world.get_map().get_waypoint_xodr(1, -1, 50.0)
        car = spawn_at(world, place)
        ticks(world, 10)
        assert car.get_speed_limit() == 30.0
