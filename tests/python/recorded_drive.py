"""Cars that drive, what was seen of them, and the log of it."""

import math
import time

import carla

import carla_log
from carla_log import POSITION
from carla_site import spawn_car

WAIT_SECS = 30.0
# What the format keeps.
NEAR_M = 0.01
NEAR_DEG = 0.1


def finished(client: carla.Client, path) -> carla_log.Log:
    """The log after `stop_recorder`: nobody waits for that call, but questions do for the file."""
    client.stop_recorder()
    client.show_recorder_file_info(str(path), False)
    return carla_log.read(path)


def is_near(recorded: tuple, transform: carla.Transform) -> bool:
    x, y, z, roll, pitch, yaw = recorded
    place, turn = transform.location, transform.rotation
    apart = math.dist((x / 100, y / 100, z / 100), (place.x, place.y, place.z))
    turned = [(roll, turn.roll), (pitch, turn.pitch), (yaw, turn.yaw)]
    return apart <= NEAR_M and all(abs((a - b + 180) % 360 - 180) <= NEAR_DEG for a, b in turned)


def seen(world: carla.World, frame: int) -> dict[int, carla.Transform]:
    """Where all are in the snapshot of a frame."""
    deadline = time.monotonic() + WAIT_SECS
    snapshot = world.get_snapshot()
    while snapshot.frame < frame and time.monotonic() < deadline:
        snapshot = world.get_snapshot()
    assert snapshot.frame == frame
    return {actor.id: actor.get_transform() for actor in snapshot}


def shows(world: carla.World, frame: carla_log.Frame, ids: list[int]) -> bool:
    """Whether the world is now as a recorded frame, under the recorded ids."""
    now = seen(world, world.get_snapshot().frame)
    places = frame.by_actor(POSITION)
    return all(id_ in now and is_near(places[id_], now[id_]) for id_ in ids)


def drive(world: carla.World, count: int = 2) -> list[carla.Vehicle]:
    """Cars that set off from places of their own."""
    cars = [spawn_car(world, index) for index in range(count)]
    for car in cars:
        car.apply_control(carla.VehicleControl(throttle=0.7, steer=0.1))
    return cars
