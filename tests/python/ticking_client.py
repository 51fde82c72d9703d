"""One of several clients of CARLA that tick a world together: drives a car of its own.

Usage: ticking_client.py PORT SPAWN_POINT TICKS. Says `ready` when its car stands; goes on when a
line comes; then prints the frames that it has asked for, and how far its car went.
"""

import sys

import carla


def drive(port: int, spawn_point: int, ticks: int) -> None:
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    car = world.spawn_actor(blueprint, world.get_map().get_spawn_points()[spawn_point])
    print("ready", flush=True)
    sys.stdin.readline()
    frames = [world.tick(60.0)]
    start = car.get_location()
    for _ in range(ticks - 1):
        car.apply_control(carla.VehicleControl(throttle=0.6))
        frames.append(world.tick(60.0))
    print(*frames, flush=True)
    print(car.get_location().distance(start), flush=True)


drive(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
