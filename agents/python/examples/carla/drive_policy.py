"""Drives a car over CARLA's client with a policy that `train_driver.py` has learnt elsewhere.

causeway up --cars real
python train_driver.py --out driver
python carla/drive_policy.py --policy driver/policy.npz --out turn.jpg

Besides requirements.txt it needs the package causeway, which reads the policy. What the policy saw
of its vehicle and way when it learnt is worked out here of what CARLA's client tells.
"""

from __future__ import annotations

import argparse
import itertools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from corl2017 import ARRIVED_M, TASKS, Drive, drives
from numpy.typing import NDArray
from PIL import ImageDraw
from rig import from_behind
from roads import Roads
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

from causeway.policy import Mlp

Floats = NDArray[np.float64]

STEP_SECS = 0.05
#: Ticks for which an action holds, as in training.
HELD = 2
#: What was learnt with.
CAR = "vehicle.lincoln.mkz"
#: Points of the way from the nearest before that may be the nearest now.
REACH = 12
#: Bends are measured over so many metres to either side.
BEND_M = 2
CAMERA = {"image_size_x": 800, "image_size_y": 450, "fov": 80}
#: Of the little map in the picture, pixels.
MAP_PX, MARGIN_PX = 150, 12


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument("--policy", type=Path, required=True, help="policy.npz of train_driver.py")
    parser.add_argument("--town", default="Town02", help="default: %(default)s")
    parser.add_argument(
        "--task", choices=["straight", "one-turn"], default="one-turn", help="default: %(default)s"
    )
    parser.add_argument("--episodes", type=int, default=5, help="default: %(default)s")
    parser.add_argument("--out", type=Path, help="save a picture of the first drive there")
    finish(run, parser.parse_args())


def run(options: argparse.Namespace) -> None:
    policy = Mlp.load(options.policy)
    client = connect(options)
    world = client.load_world(options.town)
    town = world.get_map()
    task = next(task for task in TASKS if task.name == options.task)
    arrived = 0
    with synchronous(world, STEP_SECS):
        for number, drive in enumerate(drives(town, Roads(town), task, options.episodes)):
            with cast(client) as ids:
                place = town.get_spawn_points()[drive.start]
                car = world.spawn_actor(world.get_blueprint_library().find(CAR), place)
                ids.append(car.id)
                world.tick()
                picture = options.out if number == 0 else None
                end, secs = episode(world, car, policy, drive, picture)
                tell(options, f"from spawn point {drive.start} to {drive.goal}")
            arrived += end == "arrived"
            length_m = drive.route.length_m()
            print(f"{task.name} {number}: {end} after {secs:.1f} s of {length_m:.0f} m")
    print(f"{arrived} of {options.episodes} arrived")


def episode(
    world: carla.World, car: carla.Vehicle, policy: Mlp, drive: Drive, picture: Path | None
) -> tuple[str, float]:
    """How it ends, and after how many simulated seconds.

    The picture is of the sharpest bend, or of the end of a drive that does not get there.
    """
    way = Way.of(world.get_map(), drive)
    observer = Observer(car, way)
    trace: list[tuple[float, float]] = []
    end, secs = "was too slow", 0.0
    while secs < drive.limit_secs():
        seen = observer.seen()
        trace.append(observer.centre)
        if math.dist(observer.centre, way.goal) < ARRIVED_M:
            end = "arrived"
            break
        if abs(seen["ego.offset"]) > way.half_widths_m[observer.at]:
            end = "left its lane"
            break
        if picture and observer.at >= way.sharpest:
            take(world, car, picture, way, trace)
            picture = None
        row = np.array([seen[name] for name in policy.columns], np.float32) * policy.scales
        steer, pedal = policy.act(row[np.newaxis])[0].tolist()
        observer.last = steer, pedal
        # CARLA steers to the right with positive numbers.
        control = carla.VehicleControl(
            throttle=max(pedal, 0.0), brake=max(-pedal, 0.0), steer=-steer
        )
        car.apply_control(control)
        for _ in range(HELD):
            world.tick()
        secs += HELD * STEP_SECS
    if picture:
        take(world, car, picture, way, trace)
    return end, secs


@dataclass
class Way:
    """A way by points 1 m apart; right-handed: x as CARLA's, y to the left of it."""

    points_m: Floats
    headings_rad: Floats
    #: Positive to the left.
    curvatures_per_m: Floats
    half_widths_m: Floats
    length_m: float

    @classmethod
    def of(cls, town: carla.Map, drive: Drive) -> Way:
        corners = np.array(drive.route.points)
        steps_m = np.hypot(*np.diff(corners, axis=0).T)
        along_m = np.concatenate([[0.0], np.cumsum(steps_m)])
        at_m = np.append(np.arange(0.0, along_m[-1]), along_m[-1])
        x, y = (np.interp(at_m, along_m, corners[:, axis]) for axis in (0, 1))
        widths = [
            town.get_waypoint(carla.Location(*one)).lane_width
            for one in np.stack([x, y], axis=1).tolist()
        ]
        points = np.stack([x, -y], axis=1)
        before, after = ends(len(points))
        across = points[after] - points[before]
        headings = np.unwrap(np.arctan2(across[:, 1], across[:, 0]))
        apart_m = np.maximum(at_m[after] - at_m[before], 0.5)
        curvatures = (headings[after] - headings[before]) / apart_m
        return cls(points, headings, curvatures, np.array(widths) / 2.0, float(along_m[-1]))

    @property
    def goal(self) -> tuple[float, float]:
        x, y = self.points_m[-1].tolist()
        return x, y

    @property
    def sharpest(self) -> int:
        """The point at which it bends most."""
        return int(np.abs(self.curvatures_per_m).argmax())


def ends(count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The points over which bends are measured, for each point."""
    own = np.arange(count)
    return np.maximum(own - BEND_M, 0), np.minimum(own + BEND_M, count - 1)


class Observer:
    """What a policy sees, by the names of its columns, in their units.

    Its frame begins on the ground under the middle of the rear axle: x forward, y left.
    """

    def __init__(self, car: carla.Vehicle, way: Way) -> None:
        self._car, self._way = car, way
        self.at = 0
        self.last = 0.0, 0.0
        self.centre = 0.0, 0.0
        box = car.bounding_box
        self._size = 2.0 * box.extent.x, 2.0 * box.extent.y
        middle = car.get_transform().transform(box.location)
        # Of wheels CARLA tells the places in the world, in centimetres.
        wheels = [wheel.position for wheel in car.get_physics_control().wheels[2:]]
        self._rear_m = float(
            np.mean([math.hypot(w.x / 100.0 - middle.x, w.y / 100.0 - middle.y) for w in wheels])
        )
        half_track = math.dist((wheels[0].x, wheels[0].y), (wheels[1].x, wheels[1].y)) / 200.0
        self._rear_m = math.sqrt(max(0.0, self._rear_m**2 - half_track**2))

    def seen(self) -> dict[str, float]:
        car, way = self._car, self._way
        pose = car.get_transform()
        middle = pose.transform(car.bounding_box.location)
        self.centre = x_m, y_m = middle.x, -middle.y
        yaw = -math.radians(pose.rotation.yaw)
        cos, sin = math.cos(yaw), math.sin(yaw)

        window = way.points_m[self.at : self.at + REACH]
        self.at += int(np.hypot(*(window - self.centre).T).argmin())
        heading = float(way.headings_rad[self.at])
        to_x, to_y = self.centre - way.points_m[self.at]
        at_m = self.at + to_x * math.cos(heading) + to_y * math.sin(heading)
        speed, push = car.get_velocity(), car.get_acceleration()
        wheel = car.get_wheel_steer_angle(carla.VehicleWheelLocation.FL_Wheel)
        found = {
            "ego.speed": speed.x * cos - speed.y * sin,
            "ego.acceleration.x": push.x * cos - push.y * sin,
            "ego.acceleration.y": -push.x * sin - push.y * cos,
            "ego.yaw_rate": -math.radians(car.get_angular_velocity().z),
            "ego.road_wheel": -math.radians(wheel),
            "ego.last.steer": self.last[0],
            "ego.last.pedal": self.last[1],
            "ego.length": self._size[0],
            "ego.width": self._size[1],
            "ego.limit": car.get_speed_limit() / 3.6,
            "ego.offset": to_y * math.cos(heading) - to_x * math.sin(heading),
            "ego.heading.sin": math.sin(yaw - heading),
            "ego.heading.cos": math.cos(yaw - heading),
            "goal.distance": way.length_m - at_m,
        }
        for ahead in (2, 4, 7, 10, 15, 20, 30, 40):
            point, half_width, curvature = self._ahead(at_m + ahead)
            x, y = point[0] - x_m, point[1] - y_m
            found[f"route.{ahead}m.x"] = x * cos + y * sin + self._rear_m
            found[f"route.{ahead}m.y"] = y * cos - x * sin
            found[f"route.{ahead}m.half_width"] = half_width
            found[f"route.{ahead}m.curvature"] = curvature
        return found

    def _ahead(self, at_m: float) -> tuple[Floats, float, float]:
        """The way at a distance from its start, kept within its ends."""
        way = self._way
        own = np.minimum(np.arange(len(way.points_m)), way.length_m)
        columns = (*way.points_m.T, way.half_widths_m, way.curvatures_per_m)
        x, y, half_width, curvature = (float(np.interp(at_m, own, one)) for one in columns)
        return np.array([x, y]), half_width, curvature


def take(
    world: carla.World,
    car: carla.Vehicle,
    path: Path,
    way: Way,
    trace: list[tuple[float, float]],
) -> None:
    """Saves what a camera behind the car sees, with a little map of the way and what was driven."""
    picture = from_behind(world, car, CAMERA)
    draw = ImageDraw.Draw(picture)
    low, high = way.points_m.min(axis=0), way.points_m.max(axis=0)
    scale = MAP_PX / max(*(high - low).tolist(), 1.0)
    left = picture.width - MARGIN_PX - MAP_PX

    def pixel(point: tuple[float, float]) -> tuple[float, float]:
        x, y = (point[0] - low[0]) * scale, (high[1] - point[1]) * scale
        return left + x, 2 * MARGIN_PX + y

    frame = (left - MARGIN_PX, MARGIN_PX, picture.width - 1, 3 * MARGIN_PX + MAP_PX)
    draw.rectangle(frame, fill=(250, 250, 250))
    places = [pixel((x, y)) for x, y in way.points_m.tolist()]
    draw.line(places, fill=(170, 170, 170), width=7)
    for one, other in itertools.pairwise(trace):
        draw.line([pixel(one), pixel(other)], fill=(200, 40, 40), width=3)
    path.parent.mkdir(parents=True, exist_ok=True)
    picture.save(path, quality=85)
    print(f"saved {path}")


if __name__ == "__main__":
    main()
