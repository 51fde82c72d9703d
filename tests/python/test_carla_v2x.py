"""V2X sensors as CARLA's client hears them."""

import contextlib
import queue

import carla
import pytest

ROOF = carla.Transform(carla.Location(z=2.0))
WAIT_SECS = 30.0
# What is heard comes within milliseconds of the tick or not at all.
SOON_SECS = 0.3


@pytest.fixture
def pair(world: carla.World) -> list[carla.Vehicle]:
    """Two cars in sight of each other, 12 m apart."""
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    first = world.get_map().get_spawn_points()[0]
    second = carla.Transform(
        first.location + first.get_forward_vector() * 12.0 + carla.Location(z=0.2), first.rotation
    )
    return [world.spawn_actor(blueprint, place) for place in (first, second)]


def radios(
    world: carla.World, cars: list[carla.Vehicle], kind: str, **attributes: str
) -> list[tuple[carla.Sensor, queue.Queue]]:
    """A sensor on each car and what it hears."""
    blueprint = world.get_blueprint_library().find(kind)
    for name, value in attributes.items():
        blueprint.set_attribute(name, value)
    placed = []
    for car in cars:
        heard: queue.Queue = queue.Queue()
        sensor = world.spawn_actor(blueprint, ROOF, attach_to=car)
        sensor.listen(heard.put)
        placed.append((sensor, heard))
    return placed


def test_cars_hear_awareness_messages_of_each_other(
    world: carla.World, pair: list[carla.Vehicle]
) -> None:
    pair[0].set_light_state(carla.VehicleLightState.LowBeam)
    world.tick()
    placed = radios(world, pair, "sensor.other.v2x", fixed_rate="true")
    _, heard = placed[1]
    for _ in range(20):
        world.tick()
    # Every 0.1 s, which are two ticks; the first of them may come before somebody listens.
    events = [heard.get(timeout=WAIT_SECS) for _ in range(8)]
    with contextlib.suppress(queue.Empty):
        while True:
            events.append(heard.get(timeout=SOON_SECS))
    assert len(events) <= 11
    messages = [message for event in events for message in event]
    assert all(event.get_message_count() == 1 for event in events)
    assert all(-99.0 < message.power < 31.5 for message in messages)
    told = messages[0].get()["Message"]
    assert told["Header"]["Station ID"] == pair[0].id
    basic = told["Message"]["CAM Parameters"]["Basic Container"]
    assert basic["Station Type"] == "Passenger Car"
    place = world.get_map().transform_to_geolocation(pair[0].get_location())
    assert basic["Reference Position"]["Latitude"] == pytest.approx(place.latitude * 1e7, abs=100)


def test_texts_reach_the_other_car(world: carla.World, pair: list[carla.Vehicle]) -> None:
    kind = "sensor.other.v2x_custom"
    placed = radios(world, pair, kind, use_etsi_fading="false")
    (sender, own), (_, heard) = placed
    world.tick()
    for text in ("hello", "x" * 100):
        sender.send(text)
    for _ in range(3):
        world.tick()
    event = heard.get(timeout=WAIT_SECS)
    assert event.get_message_count() == 2
    texts = [message.get()["Message"] for message in event]
    assert all(text["Header"]["Station ID"] == pair[0].id for text in texts)
    assert [text["Message"] for text in texts] == ["hello", "x" * 100]
    assert own.empty()
    assert heard.empty()


def test_a_text_that_is_too_long_takes_nothing_with_it(
    world: carla.World, pair: list[carla.Vehicle]
) -> None:
    (sender, _), _ = radios(world, pair, "sensor.other.v2x_custom")
    world.tick()
    pair[1].apply_control(carla.VehicleControl(throttle=0.8))
    sender.send("x" * 200)
    pair[1].set_light_state(carla.VehicleLightState.LowBeam)
    for _ in range(20):
        world.tick()
    assert pair[1].get_velocity().length() > 1.0
    assert pair[1].get_light_state() == carla.VehicleLightState.LowBeam
