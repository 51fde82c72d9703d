"""Lights and signs that CARLA's own client destroys or hides."""

import carla
import numpy as np
import pytest

from carla_site import attach, spawn_at, ticks
from running_site import two_free_ports

RED = carla.TrafficLightState.Red
LIGHT, SIGN = carla.CityObjectLabel.TrafficLight, carla.CityObjectLabel.TrafficSigns
POLE = carla.CityObjectLabel.Poles


def lights_of(world: carla.World) -> list[carla.TrafficLight]:
    return list(world.get_actors().filter("traffic.traffic_light*"))


def waiting_car(world: carla.World, light: carla.TrafficLight) -> carla.Vehicle:
    """A car that stands before a red light, with all lights frozen."""
    light.set_state(RED)
    world.freeze_all_traffic_lights(True)
    car = spawn_at(world, light.get_stop_waypoints()[0].previous(1.0)[0])
    car.apply_control(carla.VehicleControl(brake=1.0))
    ticks(world, 20)
    assert car.is_at_traffic_light() and car.get_traffic_light_state() == RED
    return car


def seen_before(world: carla.World, light: carla.TrafficLight):
    """A camera that looks at a light's lamps, and a function that counts their pixels in it."""
    housing = light.get_light_boxes()[0]
    place = carla.Transform(housing.location, housing.rotation)
    place.location -= place.get_forward_vector() * 3.0
    size = {"image_size_x": "120", "image_size_y": "120", "fov": "40"}
    camera, pictures = attach(world, None, "sensor.camera.semantic_segmentation", place, **size)

    def count() -> int:
        frame = ticks(world, 2)
        image = pictures.get(timeout=30.0)
        while image.frame < frame:
            image = pictures.get(timeout=30.0)
        tags = np.frombuffer(image.raw_data, np.uint8).reshape(120, 120, 4)[..., 2]
        return int((tags == int(LIGHT)).sum())

    return camera, count


def test_boxes_of_lights_in_the_level_are_those_of_their_lamps(world):
    def corners(boxes):
        return [(box.actor_id, round(box.location.x, 2), round(box.extent.z, 2)) for box in boxes]

    lamps = [box for light in lights_of(world) for box in light.get_light_boxes()]
    assert sorted(corners(world.get_level_bbs(LIGHT))) == sorted(corners(lamps))
    objects = [one.bounding_box for one in world.get_environment_objects(LIGHT)]
    assert sorted(corners(objects)) == sorted(corners(lamps))
    of_signs = {box.actor_id for box in world.get_level_bbs(SIGN)}
    assert of_signs and of_signs <= {one.id for one in world.get_actors().filter("traffic.*")}


def test_posts_of_lights_and_signs_are_poles_in_the_level(world):
    signals = {one.id: one for one in world.get_actors().filter("traffic.*")}
    boxes = [box for box in world.get_level_bbs(POLE) if box.actor_id in signals]
    assert {box.actor_id for box in boxes} == {one.id for one in lights_of(world)} | {
        box.actor_id for box in world.get_level_bbs(SIGN)
    }
    met = 0
    for box in boxes[:20]:
        assert box.extent.x < 0.1 and box.extent.z > 0.5
        start = box.location + carla.Location(x=2.0)
        hit = world.project_point(start, carla.Vector3D(x=-1.0), 4.0)
        met += hit is not None and hit.label == POLE
        lamps = [top for top in world.get_level_bbs() if top.actor_id == box.actor_id]
        assert any(top.location.distance_2d(box.location) < 0.5 for top in lamps if top != box)
    assert met > 10, "others stand behind something"
    light, *_ = lights_of(world)
    own = sum(box.actor_id == light.id for box in boxes)
    assert own and light.destroy()
    world.tick()
    left = [box for box in world.get_level_bbs(POLE) if box.actor_id in signals]
    assert len(left) == len(boxes) - own


def test_a_destroyed_light_is_gone_for_everyone(world):
    light, *_ = lights_of(world)
    partner = next(one for one in light.get_group_traffic_lights() if one.id != light.id)
    count, boxes = len(lights_of(world)), len(world.get_level_bbs(LIGHT))
    _camera, lamps = seen_before(world, light)
    before = lamps()
    assert before > 500
    own_boxes = len(light.get_light_boxes())
    assert light.destroy()
    assert lamps() < 0.05 * before, "others are far away"
    assert len(lights_of(world)) == count - 1 and not light.is_alive
    assert light.id not in [one.id for one in partner.get_group_traffic_lights()]
    assert len(world.get_level_bbs(LIGHT)) == boxes - own_boxes


def test_who_waited_at_a_destroyed_light_is_at_none(world):
    light, *_ = lights_of(world)
    car = waiting_car(world, light)
    assert light.destroy()
    world.tick()
    assert not car.is_at_traffic_light() and car.get_traffic_light() is None


def test_the_traffic_manager_drives_past_a_destroyed_light(client, world):
    light, *_ = lights_of(world)
    car = waiting_car(world, light)
    manager = client.get_trafficmanager(two_free_ports())
    manager.set_synchronous_mode(True)
    car.set_autopilot(True, manager.get_port())
    start = car.get_location()
    ticks(world, 60)
    assert car.get_location().distance(start) < 3.0
    assert light.destroy()
    ticks(world, 160)
    assert car.get_location().distance(start) > 15.0
    car.set_autopilot(False, manager.get_port())
    manager.shut_down()


def test_a_batch_destroys_all_lights_and_signs_and_a_new_world_has_them(client, world):
    signals = list(world.get_actors().filter("traffic.*"))
    signs = [one for one in signals if not one.type_id.startswith("traffic.traffic_light")]
    assert len(signals) > len(signs) > 0
    batch = [carla.command.DestroyActor(one) for one in signals]
    assert not any(answer.error for answer in client.apply_batch_sync(batch, True))
    assert list(world.get_actors().filter("traffic.*")) == []
    assert len(world.get_level_bbs(LIGHT)) == 0
    world = client.reload_world(False)
    assert len(world.get_actors().filter("traffic.*")) == len(signals)


@pytest.mark.parametrize("label", [LIGHT, SIGN, POLE], ids=str)
def test_hidden_lights_signs_and_poles_come_back(world, label):
    light, *_ = lights_of(world)
    car = waiting_car(world, light)
    _camera, lamps = seen_before(world, light)
    objects = {one.id for one in world.get_environment_objects(label)}
    before = lamps()
    world.enable_environment_objects(objects, False)
    assert (lamps() == 0) == (label == LIGHT)
    assert car.is_at_traffic_light(), "it is there all the same"
    assert {one.id for one in world.get_environment_objects(label)} == objects
    world.enable_environment_objects(objects, True)
    assert lamps() == before
