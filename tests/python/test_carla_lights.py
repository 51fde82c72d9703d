"""Traffic lights and signs through CARLA's own client: turns, times, look-ups and who is held."""

import queue
import xml.etree.ElementTree as xml

import carla
import numpy as np
import pytest

from carla_site import MAP, STEP_SECS, attach, connect, spawn_at, synchronous, ticks

LANE = '<lane id="{}" type="{}"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>'
LIGHT = (
    '<signal id="{}" s="{}" t="-5" zOffset="0" hOffset="{}" orientation="+" dynamic="{}"'
    ' country="OpenDRIVE" type="1000001" subtype="-1" value="-1"/>'
)
#: A road with a light for each direction, one of which the map does not call dynamic.
TWO_LIGHTS = f"""<?xml version="1.0"?>
<OpenDRIVE><header revMajor="1" revMinor="4" name="two lights"/>
<road name="" length="100" id="1" junction="-1">
<planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
<lanes><laneSection s="0">
<left>{LANE.format(1, "driving")}</left>
<center><lane id="0" type="none"/></center>
<right>{LANE.format(-1, "driving")}</right>
</laneSection></lanes>
<signals>{LIGHT.format(17, 50, 0, "no")}{LIGHT.format(5, 80, 3.14159, "yes")}</signals>
</road></OpenDRIVE>"""

GREEN, YELLOW, RED = (
    carla.TrafficLightState.Green,
    carla.TrafficLightState.Yellow,
    carla.TrafficLightState.Red,
)


def lights_of(world: carla.World) -> list[carla.TrafficLight]:
    return list(world.get_actors().filter("traffic.traffic_light*"))


@pytest.fixture
def light(world) -> carla.TrafficLight:
    """One whose turn is first in its group."""
    world.reset_all_traffic_lights()
    world.tick()
    return next(light for light in lights_of(world) if light.get_state() == GREEN)


def shown(world: carla.World, light: carla.TrafficLight, count: int) -> list[tuple]:
    """The colours of a light in the next ticks, each with how many ticks it lasts."""
    seen = []
    for _ in range(count):
        world.tick()
        colour = light.get_state()
        if seen and seen[-1][0] == colour:
            seen[-1] = (colour, seen[-1][1] + 1)
        else:
            seen.append((colour, 1))
    return seen


def outside(place: carla.Waypoint) -> carla.Waypoint:
    """A place before its junction."""
    while place.is_junction:
        place = place.previous(1.0)[0]
    return place


def test_states_have_carlas_values():
    names = ["Red", "Yellow", "Green", "Off", "Unknown"]
    assert [int(getattr(carla.TrafficLightState, name)) for name in names] == [0, 1, 2, 3, 4]


def test_there_is_a_light_for_every_signal_that_a_controller_turns(world):
    controlled = {
        control.get("signalId")
        for control in xml.fromstring(world.get_map().to_opendrive()).iterfind("controller/control")
    }
    world.tick()
    assert {light.get_opendrive_id() for light in lights_of(world)} == controlled


def test_a_light_shows_each_colour_as_long_as_it_was_told(world, light):
    for other in light.get_group_traffic_lights():
        other.set_green_time(1.0)
        other.set_yellow_time(0.5)
        other.set_red_time(0.25)
    light.reset_group()
    world.tick()
    times = (light.get_green_time(), light.get_yellow_time(), light.get_red_time())
    assert times == (1.0, 0.5, 0.25)
    seen = shown(world, light, 200)
    turns = [length for colour, length in seen[1:-1] if colour == GREEN]
    assert turns and all(abs(length - 1.0 / STEP_SECS) <= 1 for length in turns), seen
    yellows = [length for colour, length in seen[1:-1] if colour == YELLOW]
    assert yellows and all(abs(length - 0.5 / STEP_SECS) <= 1 for length in yellows), seen
    assert [colour for colour, _ in seen[:3]] == [GREEN, YELLOW, RED]


def test_a_light_may_stay_green_as_good_as_for_ever(world, light):
    light.set_green_time(1e6)
    world.tick()
    assert light.get_green_time() == 1e6
    assert shown(world, light, 260) == [(GREEN, 260)]


def test_elapsed_time_counts_from_the_last_change(world, light):
    elapsed = light.get_elapsed_time()
    ticks(world, 10)
    assert light.get_elapsed_time() == pytest.approx(elapsed + 10 * STEP_SECS, abs=1e-4)
    light.set_state(RED)
    world.tick()
    assert light.get_elapsed_time() <= STEP_SECS + 1e-4


def test_lights_of_a_group_take_turns(world, light):
    group = light.get_group_traffic_lights()
    assert len({other.id for other in group}) == len(group) > 1
    poles = [other.get_pole_index() for other in group]
    assert sorted(poles) == list(range(len(group)))
    for other in group:
        assert {one.id for one in other.get_group_traffic_lights()} == {one.id for one in group}
        other.set_green_time(0.5)
        other.set_yellow_time(0.2)
        other.set_red_time(0.2)
    light.reset_group()
    went = set()
    for _ in range(150):
        world.tick()
        # Lights of one controller stand at the same approach and have the turn together.
        going = frozenset(one.id for one in group if one.get_state() != RED)
        went.add(going)
    turns = [turn for turn in went if turn]
    assert set().union(*turns) == {one.id for one in group}
    assert sum(len(turn) for turn in turns) == len(group), "two turns at once"


def test_frozen_lights_keep_their_colour_and_go_on_afterwards(world, light):
    light.set_green_time(0.5)
    light.freeze(True)
    world.tick()
    # As with CARLA: one is frozen with all others.
    assert all(other.is_frozen() for other in lights_of(world))
    elapsed = light.get_elapsed_time()
    assert shown(world, light, 40) == [(GREEN, 40)]
    assert light.get_elapsed_time() == elapsed
    world.freeze_all_traffic_lights(False)
    assert YELLOW in [colour for colour, _ in shown(world, light, 20)]
    assert not light.is_frozen()


def test_a_reset_begins_all_turns_anew(world, light):
    before = {other.id: other.get_state() for other in lights_of(world)}
    ticks(world, 220)
    assert {other.id: other.get_state() for other in lights_of(world)} != before
    world.reset_all_traffic_lights()
    world.tick()
    assert {other.id: other.get_state() for other in lights_of(world)} == before


def test_a_light_is_found_by_all_that_belongs_to_it(world, light):
    town = world.get_map()
    signal = light.get_opendrive_id()
    assert world.get_traffic_light_from_opendrive_id(signal).id == light.id
    for landmark in town.get_all_landmarks_from_id(signal):
        assert world.get_traffic_light(landmark).id == light.id
        assert {mark.type for mark in town.get_landmark_group(landmark)} == {"1000001"}
    before = light.get_stop_waypoints()[0].previous(20.0)[0]
    assert light.id in [one.id for one in world.get_traffic_lights_from_waypoint(before, 50.0)]
    assert world.get_traffic_lights_from_waypoint(before, 5.0) == []
    junction = light.get_affected_lane_waypoints()[0].get_junction()
    found = {one.id for one in world.get_traffic_lights_in_junction(junction.id)}
    assert found == {one.id for one in light.get_group_traffic_lights()}


def test_lights_stop_traffic_before_the_junction_that_they_rule(world):
    world.tick()
    for light in lights_of(world):
        stops = light.get_stop_waypoints()
        assert stops and not any(stop.is_junction for stop in stops)
        ruled = light.get_affected_lane_waypoints()
        assert ruled and all(place.is_junction for place in ruled)
        led_to = {(place.road_id, place.lane_id) for stop in stops for place in stop.next(8.0)}
        assert led_to & {(place.road_id, place.lane_id) for place in ruled}
        # Whoever stops there is in the box of the light.
        volume = light.trigger_volume
        assert all(
            volume.contains(stop.transform.location, light.get_transform()) for stop in stops
        )


def test_a_light_has_its_lamps_above_its_foot_and_before_its_traffic(world):
    world.tick()
    for light in lights_of(world):
        housing, far = light.get_light_boxes()
        foot = light.get_transform()
        assert 2.0 < housing.location.z - foot.location.z < 6.0
        assert housing.location.distance_2d(foot.location) < 1.0
        assert max(housing.extent.x, housing.extent.y, housing.extent.z) < 1.0
        # It hangs on that side of the post from which the traffic comes.
        stop = light.get_stop_waypoints()[0].transform
        before = stop.get_forward_vector().dot(foot.location - housing.location)
        assert before > 0.1
        # The lamps beyond the junction are at the same height and face those who wait.
        assert far.location.z - foot.location.z == pytest.approx(3.3, abs=0.7)
        ahead = stop.get_forward_vector()
        assert ahead.dot(carla.Transform(far.location, far.rotation).get_forward_vector()) > 0.99
        assert 10.0 < ahead.dot(far.location - stop.location) < 60.0


def test_a_car_is_at_the_light_that_holds_its_lane(world, light):
    stop = light.get_stop_waypoints()[0]
    car = spawn_at(world, stop)
    world.tick()
    assert car.is_at_traffic_light()
    assert car.get_traffic_light().id == light.id
    for colour in (RED, YELLOW, GREEN):
        light.set_state(colour)
        world.tick()
        assert car.get_traffic_light_state() == colour == car.get_traffic_light().get_state()
    car.set_transform(outside(stop.previous(20.0)[0]).transform)
    world.tick()
    assert not car.is_at_traffic_light()
    assert car.get_traffic_light() is None
    assert car.get_traffic_light_state() == GREEN


def test_a_car_behind_a_speed_sign_has_its_limit(world):
    town = world.get_map()
    sign = town.get_all_landmarks_of_type(carla.LandmarkType.MaximumSpeed)[0]
    lane = sign.get_lane_validities()[0][0]
    place = town.get_waypoint_xodr(sign.road_id, lane, sign.s)
    car = spawn_at(world, place.next(3.0)[0])
    world.tick()
    assert car.get_speed_limit() == sign.value == float(sign.sub_type)
    actor = world.get_traffic_sign(sign)
    assert actor.type_id == f"traffic.speed_limit.{sign.sub_type}"
    assert isinstance(actor, carla.TrafficSign)
    before = place.previous(1.0)[0].transform.location
    assert actor.trigger_volume.contains(before, actor.get_transform())


def test_a_stop_sign_holds_a_car_for_two_seconds(client, site):
    from carla_site import synchronous

    with synchronous(client.load_world("Town04")) as world:
        town = world.get_map()
        sign = town.get_all_landmarks_of_type(carla.LandmarkType.StopSign)[0]
        lane = sign.get_lane_validities()[0][0]
        line = town.get_waypoint_xodr(sign.road_id, lane, sign.s)
        assert world.get_traffic_sign(sign).type_id == "traffic.stop"
        car = spawn_at(world, line)
        held = []
        for _ in range(60):
            world.tick()
            held.append(car.get_traffic_light_state() == RED)
            assert not car.is_at_traffic_light()
            assert car.get_traffic_light() is None
        assert held.count(True) == pytest.approx(2.0 / STEP_SECS, abs=1)
        assert held == sorted(held, reverse=True)


def camera_before(world: carla.World, light: carla.TrafficLight, away_m: float, which: int = 0):
    """The pictures of a narrow camera that looks straight at a light's lamps."""
    housing = light.get_light_boxes()[which]
    place = carla.Transform(housing.location, housing.rotation)
    place.location -= place.get_forward_vector() * away_m
    size = {"image_size_x": "120", "image_size_y": "120", "fov": "20"}
    return attach(world, None, "sensor.camera.rgb", place, **size)


def picture_of(pictures: queue.Queue, frame: int) -> carla.Image:
    image = pictures.get(timeout=30.0)
    while image.frame < frame:
        image = pictures.get(timeout=30.0)
    return image


def lit_lamps(image: carla.Image, away_m: float) -> list[str]:
    """The colours of the lamps that are lit, from the top; lamps are 0.34 m apart."""
    pixels = np.frombuffer(image.raw_data, np.uint8).reshape(120, 120, 4)
    apart_px = 0.34 / away_m * 60.0 / np.tan(np.radians(10.0))
    lit = []
    for lamp in (-1, 0, 1):
        blue, green, red, _ = (int(part) for part in pixels[round(60 + lamp * apart_px), 60])
        if max(blue, green, red) > 170:
            lit.append("yellow" if min(red, green) > 100 else "red" if red > green else "green")
    return lit


@pytest.mark.parametrize("which", [0, 1], ids=["near", "far"])
def test_a_camera_sees_each_light_in_the_colour_that_a_client_sets(world, which):
    states = {
        carla.TrafficLightState.Red: ["red"],
        carla.TrafficLightState.Yellow: ["yellow"],
        carla.TrafficLightState.Green: ["green"],
        carla.TrafficLightState.Off: [],
    }
    away_m = 3.0
    lights = lights_of(world)[:: len(lights_of(world)) // len(states)][: len(states)]
    world.freeze_all_traffic_lights(True)
    cameras = [camera_before(world, light, away_m, which) for light in lights]
    try:
        for turn in range(len(states)):
            wanted = [list(states)[(turn + at) % len(states)] for at in range(len(lights))]
            for light, state in zip(lights, wanted, strict=True):
                light.set_state(state)
            frame = ticks(world, 2)
            for (_, pictures), state in zip(cameras, wanted, strict=True):
                assert lit_lamps(picture_of(pictures, frame), away_m) == states[state], state
    finally:
        for camera, _ in cameras:
            camera.destroy()
        world.freeze_all_traffic_lights(False)


def test_who_waits_sees_the_lamps_whatever_the_lane(world):
    """Nothing stands before the lamps beyond the junction."""
    light = lights_of(world)[0]
    size = {"image_size_x": "640", "image_size_y": "360", "fov": "90"}
    for stop in light.get_stop_waypoints():
        eye = carla.Transform(stop.transform.location, stop.transform.rotation)
        eye.location.z += 1.5
        camera, pictures = attach(world, None, "sensor.camera.semantic_segmentation", eye, **size)
        image = picture_of(pictures, ticks(world, 2))
        tags = np.frombuffer(image.raw_data, np.uint8).reshape(360, 640, 4)[..., 2]
        far = light.get_light_boxes()[1].location - eye.location
        axes = eye.get_forward_vector(), eye.get_right_vector(), eye.get_up_vector()
        ahead, right, up = (axis.dot(far) for axis in axes)
        column, row = round(320 + 320 * right / ahead), round(180 - 320 * up / ahead)
        assert 0 <= column < 640 and 0 <= row < 360, stop
        assert tags[row, column] == int(carla.CityObjectLabel.TrafficLight), stop
        camera.destroy()


def test_a_camera_sees_the_lights_of_an_uploaded_map_too(site):
    client = connect(site.carla_port)
    try:
        with synchronous(client.generate_opendrive_world(TWO_LIGHTS)) as world:
            world.tick()
            world.freeze_all_traffic_lights(True)
            lights = {light.get_opendrive_id(): light for light in lights_of(world)}
            lights["17"].set_state(RED)
            lights["5"].set_state(GREEN)
            for id, wanted in (("17", ["red"]), ("5", ["green"])):
                camera, pictures = camera_before(world, lights[id], 5.0)
                frame = ticks(world, 2)
                assert lit_lamps(picture_of(pictures, frame), 5.0) == wanted
                camera.destroy()
    finally:
        client.load_world(MAP)
