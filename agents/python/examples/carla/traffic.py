"""Other road users: cars of the Traffic Manager and walkers who wander."""

from __future__ import annotations

import random

from simulator import carla


def add_cars(
    client: carla.Client,
    places: list[carla.Transform],
    manager: carla.TrafficManager,
    rng: random.Random,
) -> list[int]:
    """One car per place where it is free, driven by the Traffic Manager; ids of those there are."""
    library = client.get_world().get_blueprint_library().filter("vehicle.*")
    cars = sorted(
        (one for one in library if one.get_attribute("base_type").as_str() == "car"),
        key=lambda one: str(one.id),
    )
    command, batch = carla.command, []
    for place in places:
        car = rng.choice(cars)
        car.set_attribute("role_name", "autopilot")
        drive = command.SetAutopilot(command.FutureActor, True, manager.get_port())
        batch.append(command.SpawnActor(car, place).then(drive))
    return spawned(client, batch)


def add_walkers(
    client: carla.Client, count: int, rng: random.Random
) -> tuple[list[int], list[int]]:
    """Up to so many walkers and as many controllers; they stand until `set_off`."""
    world = client.get_world()
    library = sorted(
        world.get_blueprint_library().filter("walker.pedestrian.*"), key=lambda one: str(one.id)
    )
    world.set_pedestrians_seed(rng.randrange(2**31))
    batch = []
    for _ in range(count):
        place = world.get_random_location_from_navigation()
        if place is None:
            continue
        place.z += 1.0
        batch.append(carla.command.SpawnActor(rng.choice(library), carla.Transform(place)))
    walkers = spawned(client, batch)
    mind = world.get_blueprint_library().find("controller.ai.walker")
    minds = [carla.command.SpawnActor(mind, carla.Transform(), walker) for walker in walkers]
    return walkers, spawned(client, minds)


def set_off(world: carla.World, controllers: list[int]) -> None:
    """Walkers go to places drawn by chance, once their controllers are in a frame."""
    for controller in world.get_actors(controllers):
        controller.start()
        target = world.get_random_location_from_navigation()
        if target is not None:
            controller.go_to_location(target)


def spawned(client: carla.Client, batch: list[object]) -> list[int]:
    return [int(one.actor_id) for one in client.apply_batch_sync(batch) if not one.error]
