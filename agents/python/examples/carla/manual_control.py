"""Drives a car with the keys of the keyboard, in a window that shows its camera.

causeway up
python manual_control.py

    W, up            throttle            P   autopilot on, off
    S, down          brake               R   a new start
    A, D, left, right: steer             C   the next weather
    Space            hand brake          Tab the next place of the camera
    Q                reverse on, off     Esc the end
"""

from __future__ import annotations

import argparse
import random
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from rig import Rig
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.05
WEATHERS = ("ClearNoon", "CloudySunset", "HardRainNoon", "ClearNight")
#: x and z in m, pitch in degrees: behind the car, on its roof, from above.
PLACES = ((-6.0, 3.0, -12.0), (0.4, 1.9, 0.0), (0.0, 25.0, -90.0))
#: What the steering wheel turns in a second that a key is held, and where it stops.
STEER_PER_SEC, STEER_MOST = 1.0, 0.7
#: Names of keys in scripts that are not their letter.
NAMED = {"space": "K_SPACE", "tab": "K_TAB", "esc": "K_ESCAPE", "up": "K_UP", "down": "K_DOWN"}
NAMED |= {"left": "K_LEFT", "right": "K_RIGHT"}


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.epilog = (__doc__ or "").split("\n\n")[-1]
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(*("-a", "--autopilot"), action="store_true", help="on at the start")
    parser.add_argument(*("-l", "--lidar"), action="store_true", help="show a lidar from above")
    parser.add_argument(
        *("-q", "--quality-level"),
        choices=("Low", "Epic"),
        default="Epic",
        help="Low: the camera has half the width and height (default: %(default)s)",
    )
    parser.add_argument(*("-m", "--map-name"), metavar="TOWN", help="load this map first")
    parser.add_argument(
        "--res", type=size, default=(1280, 720), metavar="WxH", help="(default: 1280x720)"
    )
    parser.add_argument(
        "--keys",
        type=script,
        metavar="'w*60 w+a*10'",
        help="keys to hold, each for so many frames, then the end",
    )
    parser.add_argument("--seed", type=int, help="of the starts, which are drawn by chance")
    parser.add_argument("--save", metavar="PNG", help="save the last picture of the window")
    parser.add_argument(
        "--tm-port", type=int, default=8000, help="of the Traffic Manager (default: %(default)s)"
    )
    finish(run, parser.parse_args())


def size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"(\d{2,4})x(\d{2,4})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r}: wanted WIDTHxHEIGHT, e.g. 1280x720")
    return int(found[1]), int(found[2])


def script(text: str) -> list[frozenset[str]]:
    """The keys that are held in each frame."""
    frames: list[frozenset[str]] = []
    for word in text.split():
        keys, _, count = word.partition("*")
        held = frozenset(keys.lower().split("+"))
        unknown = [key for key in held if key not in NAMED and not re.fullmatch("[a-z]", key)]
        if unknown or not re.fullmatch(r"|\d{1,6}", count):
            raise argparse.ArgumentTypeError(f"{word!r}: wanted keys and frames, e.g. w+a*10")
        frames.extend([held] * int(count or 1))
    return frames


@dataclass
class Hands:
    """What the keys have done to the car's controls."""

    control: carla.VehicleControl
    autopilot: bool
    weather: int = 0
    place: int = 0
    starts: int = 0
    ends: bool = False
    held: set[str] = field(default_factory=set)

    def press(self, key: str) -> None:
        if key == "q":
            self.control.reverse = not self.control.reverse
        elif key == "p":
            self.autopilot = not self.autopilot
        elif key == "c":
            self.weather = (self.weather + 1) % len(WEATHERS)
        elif key == "tab":
            self.place = (self.place + 1) % len(PLACES)
        elif key == "r":
            self.starts += 1
        elif key == "esc":
            self.ends = True

    def hold(self, keys: set[str]) -> None:
        """The controls after a frame in which these keys were held."""
        for key in sorted(keys - self.held):
            self.press(key)
        self.held = keys
        left, right = bool(keys & {"a", "left"}), bool(keys & {"d", "right"})
        steer = self.control.steer + STEER_PER_SEC * STEP_SECS * (right - left)
        self.control.steer = max(-STEER_MOST, min(STEER_MOST, steer)) if left != right else 0.0
        self.control.throttle = 0.8 if keys & {"w", "up"} else 0.0
        self.control.brake = 1.0 if keys & {"s", "down"} else 0.0
        self.control.hand_brake = "space" in keys


def run(options: argparse.Namespace) -> None:
    client = connect(options)
    import pygame

    world = client.load_world(options.map_name) if options.map_name else client.get_world()
    manager = client.get_trafficmanager(options.tm_port)
    manager.set_synchronous_mode(True)
    rng = random.Random(options.seed)
    pygame.display.init()
    pygame.font.init()
    window = pygame.display.set_mode(options.res)
    pygame.display.set_caption("manual_control")
    with synchronous(world, STEP_SECS), cast(client, manager) as ids:
        blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
        blueprint.set_attribute("role_name", "hero")
        starts = world.get_map().get_spawn_points()
        vehicle = next(
            filter(None, (world.try_spawn_actor(blueprint, one) for one in shuffled(starts, rng)))
        )
        ids.append(vehicle.id)
        hands = Hands(carla.VehicleControl(), options.autopilot)
        vehicle.set_autopilot(hands.autopilot, manager.get_port())
        world.tick()
        rig = Rig(world, vehicle)
        try:
            set_up(rig, options, hands.place)
            for keys in frames_of(options.keys):
                before = hands.autopilot, hands.weather, hands.place, hands.starts
                hands.hold(keys)
                if hands.ends:
                    break
                if hands.autopilot != before[0]:
                    vehicle.set_autopilot(hands.autopilot, manager.get_port())
                if hands.weather != before[1]:
                    world.set_weather(getattr(carla.WeatherParameters, WEATHERS[hands.weather]))
                if hands.place != before[2]:
                    rig.remove()
                    set_up(rig, options, hands.place)
                if hands.starts != before[3]:
                    vehicle.set_transform(rng.choice(starts))
                    vehicle.set_target_velocity(carla.Vector3D())
                if not hands.autopilot:
                    vehicle.apply_control(hands.control)
                draw(window, rig.measured(world.tick()), vehicle, hands)
                pygame.display.flip()
            if options.save:
                pygame.image.save(window, options.save)
        finally:
            rig.remove()
            place = vehicle.get_location()
            print(f"the car is at ({place.x:.1f}, {place.y:.1f})")
            tell(options, f"started {1 + hands.starts} times")


def shuffled(starts: list[carla.Transform], rng: random.Random) -> list[carla.Transform]:
    return rng.sample(starts, len(starts))


def set_up(rig: Rig, options: argparse.Namespace, place: int) -> None:
    share = 2 if options.quality_level == "Low" else 1
    width, height = options.res
    x_m, z_m, pitch_deg = PLACES[place]
    at = carla.Transform(carla.Location(x=x_m, z=z_m), carla.Rotation(pitch=pitch_deg))
    picture = {"image_size_x": width // share, "image_size_y": height // share}
    rig.add("camera", "sensor.camera.rgb", at, picture)
    if options.lidar:
        lidar = {
            "channels": 32,
            "range": 50,
            "rotation_frequency": 20,
            "points_per_second": 100_000,
        }
        rig.add("lidar", "sensor.lidar.ray_cast", carla.Transform(carla.Location(z=2.5)), lidar)


def frames_of(wanted: list[frozenset[str]] | None) -> Iterator[set[str]]:
    """Keys held in each frame: of a script, or of the keyboard until the window closes."""
    import pygame

    if wanted is not None:
        for held in wanted:
            pygame.event.pump()
            yield set(held)
        return
    names = {getattr(pygame, constant): name for name, constant in NAMED.items()}
    names |= {getattr(pygame, f"K_{letter}"): letter for letter in "wasdqprc"}
    clock = pygame.time.Clock()
    while not any(event.type == pygame.QUIT for event in pygame.event.get()):
        pressed = pygame.key.get_pressed()
        yield {name for code, name in names.items() if pressed[code]}
        clock.tick(1.0 / STEP_SECS)


def draw(window: Any, measured: dict[str, Any], vehicle: carla.Vehicle, hands: Hands) -> None:
    import numpy as np
    import pygame

    image = measured["camera"]
    pixels = np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4)
    surface = pygame.surfarray.make_surface(pixels[:, :, 2::-1].swapaxes(0, 1))
    pygame.transform.scale(surface, window.get_size(), window)
    if "lidar" in measured:
        points = np.frombuffer(measured["lidar"].raw_data, np.float32).reshape(-1, 4)
        for x_m, y_m in points[:, :2]:
            window.set_at((int(110 + 2 * y_m), int(window.get_height() - 110 - 2 * x_m)), "white")
    velocity = vehicle.get_velocity()
    words = [
        f"{3.6 * velocity.length():.0f} km/h",
        "autopilot" if hands.autopilot else "",
        "reverse" if hands.control.reverse else "",
        "hand brake" if hands.control.hand_brake else "",
    ]
    text = pygame.font.Font(None, 28).render(
        "   ".join(filter(None, words)), True, "white", "black"
    )
    window.blit(text, (12, 12))


if __name__ == "__main__":
    main()
