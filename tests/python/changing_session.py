"""One Traffic Manager through several towns, run in a process of its own.

Usage: changing_session.py PORT TM_PORT MODE. Prints, for each town, its name, how far
the car that went farthest is from its start, and the farthest that one was from the middle of its
lane, in metres, as one line of JSON.
"""

import json
import os
import sys

import carla

from traffic_session import spawn, synchronous

TOWNS = ("Town02", "Town10HD_Opt", "Town10HD_Opt", "Town01")
CARS = 10
TICKS = 120
#: Cars are looked at when they have started.
STARTED_TICKS = 20


def astray_m(car: carla.Vehicle, town: carla.Map) -> float:
    at = car.get_location()
    middle = town.get_waypoint(at).transform.location
    return at.distance_squared_2d(middle) ** 0.5


def drive(client: carla.Client, world: carla.World, tm_port: int, mode: str) -> dict:
    if mode == "synchronous":
        synchronous(world)
    advance = world.tick if mode == "synchronous" else world.wait_for_tick
    town = world.get_map()
    cars = spawn(client, world, CARS, tm_port)
    starts = [car.get_location() for car in cars]
    farthest_m = 0.0
    for tick in range(TICKS):
        advance()
        if tick >= STARTED_TICKS and tick % 5 == 0:
            farthest_m = max(farthest_m, *(astray_m(car, town) for car in cars))
    ways_m = [car.get_location().distance(start) for car, start in zip(cars, starts, strict=True)]
    return {"town": town.name, "longest_way_m": max(ways_m), "farthest_m": farthest_m}


def main(port: str, tm_port: str, mode: str) -> None:
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(60.0)
    world = client.load_world("Town03")
    manager = client.get_trafficmanager(int(tm_port))
    manager.set_synchronous_mode(mode == "synchronous")
    seen = []
    for name in TOWNS:
        world = client.load_world(name, reset_settings=mode != "synchronous")
        seen.append(drive(client, world, int(tm_port), mode))
    if mode == "synchronous":
        client.reload_world()
    print(json.dumps(seen), flush=True)
    # Ending in good order is not what this is about.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
