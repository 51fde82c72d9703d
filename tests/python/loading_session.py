"""One of several clients that load towns while a Traffic Manager drives in each.

Usage: loading_session.py PORT TM_PORT SEED. Prints the number of its loads.
"""

import os
import random
import sys
import time

import carla

TOWNS = ("Town01", "Town02", "Town03", "Town10HD_Opt")
LOADS = 4
CARS = 5


def main(port: str, tm_port: str, seed: str) -> None:
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(60.0)
    client.get_trafficmanager(int(tm_port))
    chance = random.Random(seed)
    for _ in range(LOADS):
        world = client.load_world(chance.choice(TOWNS))
        blueprint = world.get_blueprint_library().find("vehicle.tesla.model3")
        for point in world.get_map().get_spawn_points()[:CARS]:
            # The other client may have loaded another town meanwhile.
            car = world.try_spawn_actor(blueprint, point)
            if car is not None:
                car.set_autopilot(True, int(tm_port))
        time.sleep(chance.uniform(0.2, 0.8))
    print(LOADS, flush=True)
    # Ending in good order is not what this is about.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
