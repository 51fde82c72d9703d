"""The light manager and its lamps through CARLA's own client."""

import time

import carla
import pytest

from carla_site import connect, fresh, ticks, ticks_until

STREET = carla.LightGroup.Street
SOON_SECS = 30.0


@pytest.fixture
def client(site):
    """One of its own: the manager of a client keeps the lamps of every map that it has seen."""
    fresh(site.carla_port)
    return connect(site.carla_port)


@pytest.fixture
def lamps(world):
    """The manager by night, all lamps burning."""
    weather = world.get_weather()
    weather.sun_altitude_angle = -30.0
    world.set_weather(weather)
    manager = world.get_lightmanager()
    ticks_until(world, lambda: all(manager.is_active(manager.get_all_lights())))
    assert all(manager.is_active(manager.get_all_lights()))
    # Nobody else switches them.
    manager.set_day_night_cycle(False)
    ticks(world, 2)
    return manager


@pytest.fixture
def seen(site, world, lamps):
    """Intensity, colour, group and whether they burn, of some lamps, as another client hears."""
    manager = connect(site.carla_port).get_world().get_lightmanager()

    def told(light: carla.Light) -> tuple:
        colour = light.color.r, light.color.g, light.color.b
        return light.intensity, colour, light.light_group, light.is_on

    def look(own: list[carla.Light], wanted: list[tuple]) -> list[tuple]:
        """Once they are as wanted, or it is too late; each client tells its own lights itself."""
        deadline = time.monotonic() + SOON_SECS
        while True:
            ticks(world, 2)
            theirs = {light.id: light for light in manager.get_all_lights()}
            found = [told(theirs[light.id]) for light in own]
            if found == wanted or time.monotonic() > deadline:
                return found
            time.sleep(0.02)

    return look


def test_lamps_are_off_in_the_default_weather_which_is_the_day_of_the_map(world):
    manager = world.get_lightmanager()
    lights = manager.get_all_lights()
    night, default = carla.WeatherParameters.ClearNight, carla.WeatherParameters.Default
    for weather, burn in ((night, True), (default, False)):
        world.set_weather(weather)
        ticks_until(world, lambda burn=burn: set(manager.is_active(lights)) == {burn})
        assert set(manager.is_active(lights)) == {burn}
        assert world.get_weather() == weather


def test_lamps_are_on_poles_and_belong_to_the_street(world, lamps):
    lights = lamps.get_all_lights(STREET)
    poles = world.get_environment_objects(carla.CityObjectLabel.Poles)
    poles = [pole for pole in poles if pole.name.startswith("StreetLamp")]
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
    ticks_until(world, lambda: len(lamps.get_turned_off_lights(STREET)) == len(few))
    off = lamps.get_turned_off_lights(STREET)
    assert sorted(one.id for one in off) == sorted(one.id for one in few)
    assert len(lamps.get_turned_on_lights(STREET)) == total - 3
    assert lamps.is_active(few) == [False] * 3
    few[0].turn_on()
    lamps.set_active(few[1:], [True, False])
    ticks_until(world, lambda: lamps.is_active(few) == [True, True, False])
    assert lamps.is_active(few) == [True, True, False]
    assert [one.is_on for one in few] == [True, True, False]


def test_colour_intensity_and_group_are_told_to_others(lamps, seen):
    few = lamps.get_all_lights(STREET)[:2]
    lamps.set_color(few, carla.Color(1, 2, 3))
    lamps.set_intensity(few, 123.0)
    lamps.set_light_group(few, carla.LightGroup.Building)
    wanted = [(123.0, (1, 2, 3), carla.LightGroup.Building, True)] * 2
    assert seen(few, wanted) == wanted
    assert len(lamps.get_all_lights(carla.LightGroup.Building)) == 2
    lamps.set_colors(few, [carla.Color(4, 5, 6), carla.Color(7, 8, 9)])
    lamps.set_intensities(few, [10.0, 20.0])
    lamps.set_light_groups(few, [STREET, carla.LightGroup.Other])
    wanted = [(10.0, (4, 5, 6), STREET, True), (20.0, (7, 8, 9), carla.LightGroup.Other, True)]
    assert seen(few, wanted) == wanted
    assert lamps.get_intensity(few) == [10.0, 20.0]
    assert lamps.get_light_group(few) == [STREET, carla.LightGroup.Other]


def test_a_state_sets_everything_at_once(lamps, seen):
    light, other = lamps.get_all_lights(STREET)[:2]
    light.set_light_state(carla.LightState(50.0, carla.Color(9, 8, 7), STREET, False))
    lamps.set_light_states([other], [carla.LightState(60.0, carla.Color(1, 1, 1), STREET, True)])
    wanted = [(50.0, (9, 8, 7), STREET, False), (60.0, (1, 1, 1), STREET, True)]
    assert seen([light, other], wanted) == wanted
    light.set_color(carla.Color(3, 3, 3))
    light.set_intensity(70.0)
    light.set_light_group(carla.LightGroup.Vehicle)
    wanted[0] = 70.0, (3, 3, 3), carla.LightGroup.Vehicle, False
    assert seen([light, other], wanted) == wanted


def test_what_one_client_switches_off_is_off_for_another(lamps, seen):
    few = lamps.get_all_lights(STREET)[:2]
    intensity, light = few[0].intensity, few[0].color
    colour = light.r, light.g, light.b

    def burning(*on: bool) -> list[tuple]:
        return [(intensity, colour, STREET, burns) for burns in on]

    lamps.turn_off(few)
    assert seen(few, burning(False, False)) == burning(False, False)
    few[0].turn_on()
    assert seen(few, burning(True, False)) == burning(True, False)


def test_what_was_switched_before_stays_so_when_others_are(site, world, lamps):
    first, second = lamps.get_all_lights(STREET)[:2]
    total = len(lamps.get_all_lights())
    for light in (first, second):
        light.turn_off()
        ticks(world, 2)
    theirs = connect(site.carla_port).get_world().get_lightmanager()
    ticks_until(world, lambda: len(theirs.get_turned_off_lights(STREET)) == 2)
    assert {one.id for one in theirs.get_turned_off_lights(STREET)} == {first.id, second.id}
    assert len(theirs.get_all_lights()) == total


def test_the_cycle_of_day_and_night_switches_what_was_switched(world, lamps):

    def all_are(burn: bool) -> bool:
        return {one.is_on for one in lamps.get_all_lights()} == {burn}

    lamps.turn_off(lamps.get_all_lights())
    ticks_until(world, lambda: not lamps.get_turned_on_lights(STREET))
    assert not lamps.get_turned_on_lights(STREET)
    lamps.set_day_night_cycle(True)
    weather = world.get_weather()
    for altitude_deg, burn in ((45.0, False), (-30.0, True)):
        weather.sun_altitude_angle = altitude_deg
        world.set_weather(weather)
        ticks_until(world, lambda burn=burn: all_are(burn))
        assert all_are(burn)
