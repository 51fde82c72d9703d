"""The light manager and its lamps through CARLA's own client."""

import time

import carla
import pytest

from carla_site import connect, ticks

STREET = carla.LightGroup.Street
SOON_SECS = 10.0


@pytest.fixture
def lamps(world):
    """The manager by night, all lamps burning."""
    weather = world.get_weather()
    weather.sun_altitude_angle = -30.0
    world.set_weather(weather)
    manager = world.get_lightmanager()
    ticks(world, 3)
    assert all(manager.is_active(manager.get_all_lights()))
    # Nobody else switches them.
    manager.set_day_night_cycle(False)
    ticks(world, 2)
    return manager


def colours(found: list[carla.Color]) -> list[tuple[int, int, int]]:
    return [(one.r, one.g, one.b) for one in found]


def test_lamps_are_on_poles_and_belong_to_the_street(world, lamps):
    lights = lamps.get_all_lights(STREET)
    poles = world.get_environment_objects(carla.CityObjectLabel.Poles)
    assert len(lights) == len(lamps.get_all_lights()) == len(poles) > 20
    assert len({light.id for light in lights}) == len(lights)
    for light in lights[:20]:
        nearest = min(pole.transform.location.distance_2d(light.location) for pole in poles)
        assert nearest < 3.0 and light.location.z > 3.0
    assert not lamps.get_all_lights(carla.LightGroup.Building)


def test_what_is_switched_off_is_listed_and_comes_on_again(world, lamps):
    few = lamps.get_all_lights(STREET)[:3]
    total = len(lamps.get_all_lights())
    lamps.turn_off(few)
    ticks(world, 2)
    off = lamps.get_turned_off_lights(STREET)
    assert sorted(one.id for one in off) == sorted(one.id for one in few)
    assert len(lamps.get_turned_on_lights(STREET)) == total - 3
    assert lamps.is_active(few) == [False] * 3
    few[0].turn_on()
    lamps.set_active(few[1:], [True, False])
    ticks(world, 2)
    assert lamps.is_active(few) == [True, True, False]
    assert [one.is_on for one in few] == [True, True, False]


def test_colour_intensity_and_group_come_back(world, lamps):
    few = lamps.get_all_lights(STREET)[:2]
    lamps.set_color(few, carla.Color(1, 2, 3))
    lamps.set_intensity(few, 123.0)
    lamps.set_light_group(few, carla.LightGroup.Building)
    ticks(world, 2)
    assert colours(lamps.get_color(few)) == [(1, 2, 3)] * 2
    assert lamps.get_intensity(few) == [123.0] * 2
    assert lamps.get_light_group(few) == [carla.LightGroup.Building] * 2
    assert len(lamps.get_all_lights(carla.LightGroup.Building)) == 2
    lamps.set_colors(few, [carla.Color(4, 5, 6), carla.Color(7, 8, 9)])
    lamps.set_intensities(few, [10.0, 20.0])
    lamps.set_light_groups(few, [STREET, carla.LightGroup.Other])
    ticks(world, 2)
    assert colours(lamps.get_color(few)) == [(4, 5, 6), (7, 8, 9)]
    assert lamps.get_intensity(few) == [10.0, 20.0]
    assert lamps.get_light_group(few) == [STREET, carla.LightGroup.Other]


def test_a_state_sets_everything_at_once(world, lamps):
    light, other = lamps.get_all_lights(STREET)[:2]
    light.set_light_state(
        carla.LightState(50.0, carla.Color(9, 8, 7), carla.LightGroup.Street, False)
    )
    lamps.set_light_states(
        [other], [carla.LightState(60.0, carla.Color(1, 1, 1), carla.LightGroup.Street, True)]
    )
    ticks(world, 2)
    found = lamps.get_light_state([light, other])
    assert [state.intensity for state in found] == [50.0, 60.0]
    assert [state.active for state in found] == [False, True]
    assert colours([state.color for state in found]) == [(9, 8, 7), (1, 1, 1)]
    assert [state.group for state in found] == [STREET] * 2
    light.set_color(carla.Color(3, 3, 3))
    light.set_intensity(70.0)
    light.set_light_group(carla.LightGroup.Vehicle)
    ticks(world, 2)
    assert (light.intensity, light.light_group) == (70.0, carla.LightGroup.Vehicle)
    assert colours([light.color]) == [(3, 3, 3)]


def test_another_client_sees_the_same_lamps(site, world, lamps):
    other = connect(site.carla_port).get_world()
    theirs = other.get_lightmanager()
    world.tick()
    few = lamps.get_all_lights(STREET)[:2]
    ids = {one.id for one in few}
    lamps.turn_off(few)
    lamps.set_intensity(few, 42.0)
    deadline, dark = time.monotonic() + SOON_SECS, set()
    while dark != ids and time.monotonic() < deadline:
        ticks(world, 2)
        dark = {one.id for one in theirs.get_turned_off_lights(STREET)}
    assert dark == ids
    assert [one.intensity for one in theirs.get_all_lights() if one.id in ids] == [42.0] * 2


def test_the_cycle_of_day_and_night_switches_what_was_switched(world, lamps):
    lamps.turn_off(lamps.get_all_lights())
    ticks(world, 2)
    assert not lamps.get_turned_on_lights(STREET)
    lamps.set_day_night_cycle(True)
    weather = world.get_weather()
    for altitude_deg, burn in ((45.0, False), (-30.0, True)):
        weather.sun_altitude_angle = altitude_deg
        world.set_weather(weather)
        ticks(world, 4)
        assert {one.is_on for one in lamps.get_all_lights()} == {burn}
