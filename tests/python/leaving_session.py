"""Cars of a Traffic Manager destroyed one by one, run in a process of its own.

Usage: leaving_session.py PORT TM_PORT. Each car drives in synchronous mode, then world and Traffic
Manager go on by themselves and the car is destroyed at once, as many programs end. Prints how many
cars were destroyed.
"""

import os
import sys

import carla

from traffic_session import synchronous

ROUNDS = 12
TICKS = 5


def main(port: str, tm_port: str) -> None:
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(60.0)
    world = client.load_world("Town10HD_Opt")
    manager = client.get_trafficmanager(int(tm_port))
    free = world.get_settings()
    model = world.get_blueprint_library().find("vehicle.tesla.model3")
    places = world.get_map().get_spawn_points()
    destroyed = 0
    for place in places[:ROUNDS]:
        synchronous(world)
        manager.set_synchronous_mode(True)
        car = world.spawn_actor(model, place)
        car.set_autopilot(True, int(tm_port))
        for _ in range(TICKS):
            world.tick()
        world.apply_settings(free)
        manager.set_synchronous_mode(False)
        destroyed += car.destroy()
    print(destroyed, flush=True)
    # Ending in good order is not what this is about.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
