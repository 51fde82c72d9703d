"""A client of CARLA in a process of its own, to be killed in mid-work.

Usage: client_session.py PORT PHASE [FPS]. Says "ready" once it is in the phase, and stays in it.
"""

import statistics
import sys
import time

import carla

STEP_SECS = 0.05
#: Ticks of an overloaded world take so many of their periods.
OVERLOAD = 10
TICKS_LOOKED_AT = 20
LIDARS_MAX = 600


def connected(client: carla.Client) -> None:
    client.get_world()
    say_ready()
    time.sleep(600.0)


def spawning(client: carla.Client) -> None:
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.audi.tt")
    places = world.get_map().get_spawn_points()
    say_ready()
    while True:
        command = carla.command
        spawn = [command.SpawnActor(blueprint, place) for place in places[:20]]
        cars = [one.actor_id for one in client.apply_batch_sync(spawn) if not one.error]
        client.apply_batch_sync([command.DestroyActor(car) for car in cars])


def ticking(client: carla.Client) -> None:
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = STEP_SECS
    world.apply_settings(settings)
    world.tick()
    say_ready()
    while True:
        world.tick()


def standing(client: carla.Client) -> None:
    """Leaves the world in synchronous mode and ticks no more."""
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    world.apply_settings(settings)
    say_ready()
    time.sleep(600.0)


def streaming(client: carla.Client) -> None:
    world = client.get_world()
    library = world.get_blueprint_library()
    car = world.spawn_actor(library.find("vehicle.audi.tt"), world.get_map().get_spawn_points()[30])
    lidar = library.find("sensor.lidar.ray_cast")
    sensor = world.spawn_actor(lidar, carla.Transform(carla.Location(z=2.0)), attach_to=car)
    sensor.listen(lambda _: None)
    world.wait_for_tick()
    say_ready()
    while True:
        world.wait_for_tick()


def measuring(client: carla.Client) -> None:
    """Six lidars that have much to do."""
    world = client.get_world()
    _sensors = add_lidars(world)
    say_ready()
    time.sleep(600.0)


def overloading(client: carla.Client) -> None:
    """So many lidars that ticks take many times longer than their period, on this machine."""
    period_secs = 1.0 / float(sys.argv[3])
    world = client.get_world()
    sensors = []
    while tick_secs(world) < OVERLOAD * period_secs:
        assert len(sensors) < LIDARS_MAX, "this machine has no end"
        sensors += add_lidars(world)
    say_ready()
    time.sleep(600.0)


def add_lidars(world: carla.World) -> list[carla.Sensor]:
    """Six more, which measure as long as they are kept."""
    lidar = world.get_blueprint_library().find("sensor.lidar.ray_cast")
    lidar.set_attribute("points_per_second", "1300000")
    lidar.set_attribute("rotation_frequency", "30")
    lidar.set_attribute("channels", "64")
    sensors = []
    for place in world.get_map().get_spawn_points()[:6]:
        place.location.z += 2.0
        sensors.append(world.spawn_actor(lidar, place))
        sensors[-1].listen(lambda _: None)
    return sensors


def tick_secs(world: carla.World) -> float:
    """What a tick takes at the world's own pace, its waiting included."""
    return statistics.median(world.wait_for_tick().delta_seconds for _ in range(TICKS_LOOKED_AT))


def say_ready() -> None:
    print("ready", flush=True)


ALL = (connected, spawning, ticking, standing, streaming, measuring, overloading)
PHASES = {phase.__name__: phase for phase in ALL}

if __name__ == "__main__":
    own = carla.Client("127.0.0.1", int(sys.argv[1]))
    own.set_timeout(60.0)
    PHASES[sys.argv[2]](own)
