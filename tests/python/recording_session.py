"""Records traffic of CARLA's own Traffic Manager, asks about it and replays it, as a client does
that nobody helps: asynchronous, with the short time-out of programs that wait for a tick.

Usage: recording_session.py PORT TM_PORT NAME. Prints one line of JSON: what it was told.
"""

import json
import os
import sys
import time

import carla

CARS = 10
RECORDED_SECS = 4.0


def record(client: carla.Client, tm_port: int, name: str) -> dict:
    """Spawns and drives cars by one batch, and destroys them before the end."""
    client.set_timeout(2.0)
    world = client.get_world()
    library = world.get_blueprint_library().filter("vehicle.*")
    path = client.start_recorder(name)
    spawn, drive = carla.command.SpawnActor, carla.command.SetAutopilot
    batch = []
    for number, place in enumerate(world.get_map().get_spawn_points()[:CARS]):
        blueprint = library[number % len(library)]
        blueprint.set_attribute("role_name", "autopilot")
        batch.append(spawn(blueprint, place).then(drive(carla.command.FutureActor, True, tm_port)))
    responses = client.apply_batch_sync(batch)
    cars = [response.actor_id for response in responses if not response.error]
    begun = world.get_snapshot().timestamp.elapsed_seconds
    while world.get_snapshot().timestamp.elapsed_seconds < begun + RECORDED_SECS:
        world.wait_for_tick()
    client.apply_batch_sync([carla.command.DestroyActor(car) for car in cars])
    # They are destroyed in the last frame of the recording.
    client.stop_recorder()
    return {"path": path, "cars": cars}


def ask(client: carla.Client, name: str) -> dict:
    client.set_timeout(60.0)
    return {
        "info": client.show_recorder_file_info(name, False),
        "all": client.show_recorder_file_info(name, True),
        "collisions": client.show_recorder_collisions(name, "a", "a"),
        "blocked": client.show_recorder_actors_blocked(name, 30.0, 100.0),
    }


def replay(client: carla.Client, name: str, car: int) -> dict:
    """At double speed, seen from above one of the cars; until nobody is left."""
    world = client.get_world()
    client.set_replayer_time_factor(2.0)
    client.set_replayer_ignore_hero(False)
    client.set_replayer_ignore_spectator(True)
    above = carla.Transform(carla.Location(0, 0, 40), carla.Rotation(-90, 0, 0))
    text = client.replay_file(name, 1.0, 0.0, car, False, above)
    most, heights = 0, []
    deadline = time.monotonic() + 60.0
    while time.monotonic() < deadline:
        world.wait_for_tick()
        cars = world.get_actors().filter("vehicle.*")
        most = max(most, len(cars))
        followed = world.get_actor(car)
        if followed is not None:
            spectator = world.get_spectator().get_location()
            heights.append(spectator.z - followed.get_location().z)
        if most and not len(cars):
            break
    client.set_replayer_time_factor(1.0)
    return {"text": text, "most": most, "left": len(cars), "heights": heights}


def main() -> None:
    port, tm_port, name = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
    client = carla.Client("127.0.0.1", port)
    recorded = record(client, tm_port, name)
    told = recorded | ask(client, name) | {"replay": replay(client, name, recorded["cars"][0])}
    print(json.dumps(told), flush=True)
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main()
