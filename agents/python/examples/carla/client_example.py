"""Drives a car through episodes and tells what it measures; with -i saves its pictures.

causeway up
python client_example.py --autopilot --images-to-disk

Every episode begins in a new world, with cars, walkers, weather and a start drawn by chance. The
car steers by chance with half throttle, or the Traffic Manager drives it and every second frame
turns its steering wheel a little aside. Depth is saved in CARLA's code of 24 bits, lidar in the
sensor's axes.
"""

from __future__ import annotations

import argparse
import random
from pathlib import Path
from typing import Any

import settings_file
import traffic
from measurements import Collisions, player
from rig import Rig
from settings_file import Settings
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.1
#: A full turn of the steering wheel is 1.
STEER_NOISE = 0.1
#: CARLA 0.8 numbers its weathers; each is a preset of `carla.WeatherParameters`.
WEATHERS = (
    "Default",
    *("ClearNoon", "CloudyNoon", "WetNoon", "WetCloudyNoon"),
    *("MidRainyNoon", "HardRainNoon", "SoftRainNoon"),
    *("ClearSunset", "CloudySunset", "WetSunset", "WetCloudySunset"),
    *("MidRainSunset", "HardRainSunset", "SoftRainSunset"),
)


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument(
        *("-a", "--autopilot"), action="store_true", help="the Traffic Manager drives"
    )
    parser.add_argument(*("-l", "--lidar"), action="store_true", help="a lidar beside the cameras")
    parser.add_argument(
        *("-q", "--quality-level"),
        choices=("Low", "Epic"),
        default="Epic",
        help="Low: pictures half as wide and high (default: %(default)s)",
    )
    parser.add_argument(
        *("-i", "--images-to-disk"), action="store_true", help="save what the sensors measure"
    )
    parser.add_argument(
        *("-c", "--carla-settings"),
        type=Path,
        metavar="PATH",
        help="a CarlaSettings.ini of CARLA 0.8 says which sensors, how many others, which weather",
    )
    parser.add_argument("--episodes", type=int, default=10, help="(default: %(default)s)")
    parser.add_argument(
        "--frames",
        type=int,
        default=30,
        help=f"of each episode, {STEP_SECS} s each (default: %(default)s)",
    )
    parser.add_argument("--seed", type=int, help="of all that is drawn by chance")
    parser.add_argument(
        "--out", type=Path, default=Path("_out"), help="where to save (default: %(default)s)"
    )
    parser.add_argument(
        "--tm-port", type=int, default=8000, help="of the Traffic Manager (default: %(default)s)"
    )
    finish(run, parser.parse_args())


def run(options: argparse.Namespace) -> None:
    if options.carla_settings:
        settings = settings_file.read(options.carla_settings)
    else:
        settings = settings_file.usual(options.lidar, small=options.quality_level == "Low")
    client = connect(options)
    manager = client.get_trafficmanager(options.tm_port)
    manager.set_synchronous_mode(True)
    seeds = random.Random(options.seed)
    for number in range(options.episodes):
        print(f"episode {number}")
        # A world of its own, as the old server made one for each episode.
        world = client.reload_world(False)
        with synchronous(world, STEP_SECS), cast(client, manager) as ids:
            drive(client, manager, settings, options, number, seeds.randrange(2**31), ids)


def drive(
    client: carla.Client,
    manager: carla.TrafficManager,
    settings: Settings,
    options: argparse.Namespace,
    number: int,
    seed: int,
    ids: list[int],
) -> None:
    rng = random.Random(seed)
    manager.set_random_device_seed(rng.randrange(2**31))
    world, town = client.get_world(), client.get_world().get_map()
    weather = settings.weather if settings.weather is not None else rng.choice((1, 3, 7, 8, 14))
    world.set_weather(getattr(carla.WeatherParameters, WEATHERS[weather]))

    places = town.get_spawn_points()
    rng.shuffle(places)
    blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
    blueprint.set_attribute("role_name", "hero")
    vehicle = world.spawn_actor(blueprint, places[0])
    ids.append(vehicle.id)
    cars = traffic.add_cars(client, places[1 : 1 + settings.vehicles], manager, rng)
    ids.extend(cars)
    walkers, controllers = traffic.add_walkers(client, settings.pedestrians, rng)
    ids.extend([*walkers, *controllers])
    tell(options, f"{WEATHERS[weather]}, {len(cars)} cars, {len(walkers)} walkers")

    collisions = Collisions()
    bumper = world.spawn_actor(
        world.get_blueprint_library().find("sensor.other.collision"),
        carla.Transform(),
        attach_to=vehicle,
    )
    ids.append(bumper.id)
    bumper.listen(collisions.add)
    vehicle.set_autopilot(options.autopilot, manager.get_port())
    world.tick()
    traffic.set_off(world, controllers)

    rig = Rig(world, vehicle)
    try:
        for sensor in settings.sensors:
            place = carla.Transform(
                carla.Location(*sensor.place_m), carla.Rotation(*sensor.turn_deg)
            )
            rig.add(sensor.name, sensor.kind, place, sensor.attributes)
        for frame in range(options.frames):
            measured = rig.measured(world.tick())
            print(player(vehicle, town, len(cars) + len(walkers)).line(collisions))
            if options.images_to_disk:
                save(measured, options.out / f"episode_{number:04}", frame)
            steer(vehicle, options.autopilot, frame, rng)
    finally:
        bumper.stop()
        rig.remove()


def save(measured: dict[str, Any], folder: Path, frame: int) -> None:
    for name, data in measured.items():
        ending = "png" if isinstance(data, carla.Image) else "ply"
        data.save_to_disk(str(folder / name / f"{frame:06}.{ending}"))


def steer(vehicle: carla.Vehicle, autopilot: bool, frame: int, rng: random.Random) -> None:
    if not autopilot:
        vehicle.apply_control(carla.VehicleControl(throttle=0.5, steer=rng.uniform(-1.0, 1.0)))
    elif frame % 2:
        # The control of this frame was the Traffic Manager's own, as that of every second one is.
        control = vehicle.get_control()
        control.steer = max(-1.0, min(1.0, control.steer + rng.uniform(-1, 1) * STEER_NOISE))
        vehicle.apply_control(control)


if __name__ == "__main__":
    main()
