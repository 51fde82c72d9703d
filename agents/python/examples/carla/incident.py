"""Records a crash, finds it by a query, replays it, and goes on from before it: somebody brakes.

causeway up
python incident.py --out pictures

Saves three pictures: the contact as it is replayed, two seconds before it, and where the car stands
that brakes from there. The recording stays on the server.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rig import from_behind
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.05
TOWN = "Town10HD_Opt"
RECORDING = "incident.log"
#: How far ahead of the hero the other car is parked.
GAP_M = 20.0
RECORDED_TICKS = 120
BEFORE_SECS = 2.0
BRAKED_TICKS = 60
CAMERA = {"image_size_x": 480, "image_size_y": 270, "fov": 70}
JPEG_QUALITY = 80


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument(
        "--out", type=Path, default=Path("_out"), help="where to save (default: %(default)s)"
    )
    finish(run, parser.parse_args())


def run(options: argparse.Namespace) -> None:
    client = connect(options)
    world = client.load_world(TOWN)
    options.out.mkdir(parents=True, exist_ok=True)
    with synchronous(world, STEP_SECS), cast(client) as ids:
        hero, parked = crash(client, world, ids)
        contact_secs, actor = first_contact(client)
        print(f"actor {actor} meets the parked car after {contact_secs} s")

        # The camera of the spectator follows the actor that the query names.
        tell(options, client.replay_file(RECORDING, contact_secs, 0.0, actor))
        take(world, hero, options.out / "contact.jpg")
        client.replay_file(RECORDING, contact_secs - BEFORE_SECS, 0.0, actor)
        take(world, hero, options.out / "before.jpg")

        # From here on the cars are driven by clients again.
        client.stop_replayer(True)
        hero.apply_control(carla.VehicleControl(brake=1.0))
        for _ in range(BRAKED_TICKS):
            world.tick()
        take(world, hero, options.out / "braked.jpg")
        gap_m = hero.get_location().distance(parked.get_location())
        print(f"the hero that brakes stands {gap_m:.1f} m from the parked car")


def crash(
    client: carla.Client, world: carla.World, ids: list[int]
) -> tuple[carla.Vehicle, carla.Vehicle]:
    """Records how a hero runs into a parked car."""
    print(f"recording to {client.start_recorder(RECORDING)}")
    library = world.get_blueprint_library()
    place = world.get_map().get_spawn_points()[0]
    blueprint = library.find("vehicle.lincoln.mkz_2020")
    blueprint.set_attribute("role_name", "hero")
    hero = world.spawn_actor(blueprint, place)
    ids.append(hero.id)
    place.location += place.get_forward_vector() * GAP_M
    parked = world.spawn_actor(library.find("vehicle.audi.tt"), place)
    ids.append(parked.id)
    # Contacts are recorded of those who carry such a sensor.
    sensor = library.find("sensor.other.collision")
    ids.append(world.spawn_actor(sensor, carla.Transform(), attach_to=hero).id)
    hero.apply_control(carla.VehicleControl(throttle=1.0))
    for _ in range(RECORDED_TICKS):
        world.tick()
    client.stop_recorder()
    return hero, parked


def first_contact(client: carla.Client) -> tuple[float, int]:
    """When a hero first met a vehicle, and who it was."""
    lines = client.show_recorder_collisions(RECORDING, "h", "v").splitlines()
    head = next(number for number, line in enumerate(lines) if line.split()[:1] == ["Time"])
    _, _, _, hero, _, other, *_ = lines[head + 1].split()
    # The table has whole seconds; the list of events has the frame.
    secs = 0.0
    for line in client.show_recorder_file_info(RECORDING, False).splitlines():
        words = line.split()
        if line.startswith("Frame "):
            secs = float(words[3])
        elif line.startswith(" Collision ") and words[4] == hero and words[-1] == other:
            return secs, int(hero)
    raise RuntimeError("the recording has a contact that its events have not")


def take(world: carla.World, car: carla.Vehicle, path: Path) -> None:
    """Saves what a camera behind a car sees after one more tick."""
    from_behind(world, car, CAMERA).save(path, quality=JPEG_QUALITY)
    print(f"saved {path}")


if __name__ == "__main__":
    main()
