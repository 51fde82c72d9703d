"""Worlds of the site's CARLA endpoint, each test with a fresh one."""

import contextlib
import queue
import time

import carla

STEP_SECS = 0.05
TIMEOUT_SECS = 60.0
MAP = "Town10HD_Opt"


# The client library sometimes ends the process when a client goes while its streams are open, so
# none ever goes.
_clients: list[carla.Client] = []
_first_of_port: dict[int, carla.Client] = {}


def connect(port: int, host: str = "127.0.0.1") -> carla.Client:
    """A further client."""
    client = carla.Client(host, port)
    client.set_timeout(TIMEOUT_SECS)
    _clients.append(client)
    return client


def fresh(port: int) -> carla.Client:
    """The first client of a site, with a new world on the usual map."""
    if port not in _first_of_port:
        _first_of_port[port] = connect(port)
    client = _first_of_port[port]
    client.load_world(MAP)
    return client


@contextlib.contextmanager
def synchronous(world: carla.World, step_secs: float = STEP_SECS):
    """The world waits for `tick()`; asynchronous again at the end, so that nobody hangs."""
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = step_secs
    world.apply_settings(settings)
    try:
        yield world
    finally:
        settings.synchronous_mode = False
        settings.fixed_delta_seconds = None
        world.apply_settings(settings)


def spawn_car(world: carla.World, index: int = 0, **attributes: str) -> carla.Vehicle:
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    for name, value in attributes.items():
        blueprint.set_attribute(name, value)
    return world.spawn_actor(blueprint, world.get_map().get_spawn_points()[index])


def spawn_at(world: carla.World, place: carla.Waypoint, **attributes: str) -> carla.Vehicle:
    """A car on a lane."""
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    for name, value in attributes.items():
        blueprint.set_attribute(name, value)
    pose = place.transform
    pose.location.z += 0.3
    return world.spawn_actor(blueprint, pose)


def ticks_until(world: carla.World, condition) -> None:
    """Ticks until that holds, or it is too late: the client does some things beside its frames."""
    deadline = time.monotonic() + TIMEOUT_SECS
    ticks(world, 2)
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
        ticks(world, 2)


def ticks(world: carla.World, count: int) -> int:
    frame = 0
    for _ in range(count):
        frame = world.tick()
    return frame


ROOF = carla.Transform(carla.Location(z=2.0))


def attach(
    world: carla.World,
    parent: carla.Actor | None,
    blueprint_id: str,
    place: carla.Transform = ROOF,
    **attributes: str,
) -> tuple[carla.Sensor, queue.Queue]:
    """A sensor on the roof, or where `place` says, and the queue of what it measures."""
    blueprint = world.get_blueprint_library().find(blueprint_id)
    for name, value in attributes.items():
        blueprint.set_attribute(name, value)
    sensor = world.spawn_actor(blueprint, place, attach_to=parent)
    measured = queue.Queue()
    sensor.listen(measured.put)
    return sensor, measured
