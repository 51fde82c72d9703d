"""Learns to tell cars and people from anything else in one weather, and is tested in others.

causeway up
python learn_to_see.py

Every scene has parked cars and standing people before a camera, drawn by chance, and is pictured in
each weather. The picture of instances tells where they are: squares around them, and squares
without any of them, are cut out. Scenes are for learning or for the test, never for both. The model
is softmax regression on histograms of oriented gradients; the table has the mean of the shares that
are right of each class, in percent.
"""

from __future__ import annotations

import argparse
import queue
import random
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.05
WAIT_SECS = 60.0
#: Each is a preset of `carla.WeatherParameters`.
WEATHERS = {
    "day": "ClearNoon",
    "night": "ClearNight",
    "rain": "HardRainNoon",
    "rainy night": "HardRainNight",
}
CLASSES = ("nothing", "car", "person")
#: Semantic tags of CARLA.
TAGS = {14: "car", 12: "person"}
WIDTH, HEIGHT = 480, 270
#: Sides of what is cut out are at least this, and of a square that shows this much of its thing.
SIDE_PX_MIN, SHARE_MIN = 14, 0.3
#: Around the thing, in parts of its longer side.
MARGIN = 1.25
#: What is cut out is scaled to this many pixels a side, and so many go into one histogram.
CROP_PX, CELL_PX, BINS = 32, 4, 9
STEPS, RATE, DECAY = 400, 0.02, 1e-3

#: A camera, and what it has sent.
Eye: TypeAlias = "tuple[carla.Sensor, queue.Queue[Any]]"
Boxes = list[tuple[int, int, int, str]]
Pixels = NDArray[np.uint8]
Numbers = NDArray[np.float64]


@dataclass
class Examples:
    """What was cut out in one weather: features by row, and the number of each one's class."""

    features: list[Numbers] = field(default_factory=list)
    classes: list[int] = field(default_factory=list)


def main(options: argparse.Namespace) -> None:
    chance = random.Random(options.seed)
    learning = {weather: Examples() for weather in WEATHERS}
    testing = {weather: Examples() for weather in WEATHERS}
    client = connect(options)
    world = client.load_world(options.town)
    with synchronous(world, STEP_SECS), cast(client) as ids:
        eyes = [camera(world, kind, ids) for kind in ("rgb", "instance_segmentation")]
        for scene in range(options.scenes):
            into = testing if scene % 3 == 2 else learning
            picture_scene(client, eyes, into, chance)
            tell(options, f"scene {scene + 1} of {options.scenes}")
        for sensor, _ in eyes:
            sensor.stop()
            sensor.destroy()
    for name, examples in (("learning", learning), ("test", testing)):
        counts = np.bincount(examples["day"].classes, minlength=len(CLASSES))
        told = ", ".join(f"{count} {kind}" for count, kind in zip(counts, CLASSES, strict=True))
        print(f"for {name}, in each weather: {told}")
    table(learning, testing)


def camera(world: carla.World, kind: str, ids: list[int]) -> Eye:
    blueprint = world.get_blueprint_library().find(f"sensor.camera.{kind}")
    for name, value in (("image_size_x", WIDTH), ("image_size_y", HEIGHT), ("fov", 70)):
        blueprint.set_attribute(name, str(value))
    sensor = world.spawn_actor(blueprint, carla.Transform())
    ids.append(sensor.id)
    pictures: queue.Queue[Any] = queue.Queue()
    sensor.listen(pictures.put)
    return sensor, pictures


def picture_scene(
    client: carla.Client,
    eyes: list[Eye],
    into: dict[str, Examples],
    chance: random.Random,
) -> None:
    """Puts up a scene, cuts out what is seen of it in each weather, and clears it away."""
    world = client.get_world()
    start = chance.choice(world.get_map().get_spawn_points())
    eye = carla.Transform(start.location + carla.Location(z=1.2), start.rotation)
    boxes: Boxes | None = None
    with cast(client) as ids:
        populate(world, start, ids, chance)
        for sensor, _ in eyes:
            sensor.set_transform(eye)
        for weather, preset in WEATHERS.items():
            world.set_weather(getattr(carla.WeatherParameters, preset))
            # What was just put down settles first.
            frames = [world.tick() for _ in range(2)]
            colour, instances = (newest(pictures, frames[-1]) for _, pictures in eyes)
            if boxes is None:
                boxes = boxes_of(instances, chance)
            for left, top, side, kind in boxes:
                crop = Image.fromarray(colour).crop((left, top, left + side, top + side))
                scaled = crop.convert("L").resize((CROP_PX, CROP_PX), Image.Resampling.BILINEAR)
                into[weather].features.append(gradients(np.asarray(scaled, float)))
                into[weather].classes.append(CLASSES.index(kind))


def populate(
    world: carla.World, start: carla.Transform, ids: list[int], chance: random.Random
) -> None:
    """Cars with their lights on, and people, up to 30 m ahead and to both sides."""
    library = world.get_blueprint_library()
    cars = [one for one in library.filter("vehicle.*") if one.get_attribute("base_type") == "car"]
    people = list(library.filter("walker.pedestrian.*"))
    ahead, aside = start.get_forward_vector(), start.get_right_vector()
    for kinds, count, far_m in ((cars, 5, 32.0), (people, 7, 18.0)):
        for _ in range(count):
            blueprint = chance.choice(kinds)
            if blueprint.has_attribute("color"):
                colours = blueprint.get_attribute("color").recommended_values
                blueprint.set_attribute("color", chance.choice(colours))
            place = start.location + ahead * chance.uniform(5.0, far_m)
            place += aside * chance.uniform(-6.0, 6.0) + carla.Location(z=0.6)
            turn = carla.Rotation(yaw=chance.uniform(-180.0, 180.0))
            actor = world.try_spawn_actor(blueprint, carla.Transform(place, turn))
            if actor is not None:
                ids.append(actor.id)
                if kinds is cars:
                    lights = carla.VehicleLightState.Position | carla.VehicleLightState.LowBeam
                    actor.set_light_state(carla.VehicleLightState(lights))


def newest(pictures: queue.Queue[Any], frame: int) -> Pixels:
    """Red, green and blue of a frame."""
    while (image := pictures.get(timeout=WAIT_SECS)).frame < frame:
        pass
    data = np.frombuffer(image.raw_data, np.uint8).reshape(image.height, image.width, 4)
    return data[..., 2::-1].copy()


def boxes_of(instances: Pixels, chance: random.Random) -> Boxes:
    """Squares around what is seen, and as many of the same sizes with nothing of it: left edge,
    upper edge, side, what it shows."""
    tags, ids = instances[..., 0], instances[..., 1:].astype(int) @ [1, 256]
    boxes: Boxes = []
    is_thing = np.isin(tags, list(TAGS))
    for tag, kind in TAGS.items():
        for one in np.unique(ids[tags == tag]):
            rows, columns = np.nonzero((tags == tag) & (ids == one))
            height, width = np.ptp(rows) + 1, np.ptp(columns) + 1
            if min(height, width) < SIDE_PX_MIN // 2 or max(height, width) < SIDE_PX_MIN:
                continue
            side = int(MARGIN * max(height, width))
            if len(rows) > SHARE_MIN * height * width and side < HEIGHT:
                middle = columns.min() + width // 2, rows.min() + height // 2
                boxes.append((int(middle[0] - side // 2), int(middle[1] - side // 2), side, kind))
    sides = [side for _, _, side, _ in boxes]
    for side in sides:
        for _ in range(20):
            left, top = chance.randrange(WIDTH - side), chance.randrange(HEIGHT - side)
            if is_thing[top : top + side, left : left + side].mean() < 0.02:
                boxes.append((left, top, side, "nothing"))
                break
    return boxes


def gradients(grey: Numbers) -> Numbers:
    """Histograms of the directions in which a picture gets brighter, each beside its neighbours.

    Source: Dalal, Triggs, "Histograms of oriented gradients for human detection", 2005.
    """
    down, right = np.gradient(grey)
    strength = np.hypot(down, right)
    turn = np.arctan2(down, right) % np.pi
    bins = np.minimum((turn / np.pi * BINS).astype(int), BINS - 1)
    cells = CROP_PX // CELL_PX
    parts = (strength[..., None] * (bins[..., None] == np.arange(BINS))).reshape(
        cells, CELL_PX, cells, CELL_PX, BINS
    )
    histograms = parts.sum(axis=(1, 3))
    blocks = np.concatenate(
        [histograms[y : cells - 1 + y, x : cells - 1 + x] for y in (0, 1) for x in (0, 1)],
        axis=2,
    )
    # One grey level of 255 is noise: what is weaker than that is not blown up.
    told: Numbers = blocks / (np.linalg.norm(blocks, axis=2, keepdims=True) + CELL_PX)
    return told.ravel()


def learn(features: Numbers, classes: NDArray[np.int64]) -> Numbers:
    """Weights of softmax regression, by class; each class counts alike.

    Source of the steps: Kingma, Ba, "Adam", 2015.
    """
    weights = np.zeros((len(CLASSES), features.shape[1]))
    first, second = np.zeros_like(weights), np.zeros_like(weights)
    wanted = np.eye(len(CLASSES))[classes]
    counts = 1.0 / (np.maximum(wanted.sum(axis=0), 1.0) * len(CLASSES))
    for step in range(1, STEPS + 1):
        scores = features @ weights.T
        chances = np.exp(scores - scores.max(axis=1, keepdims=True))
        chances /= chances.sum(axis=1, keepdims=True)
        error = (chances - wanted) * counts[classes, None]
        slope = error.T @ features + DECAY * weights
        first = 0.9 * first + 0.1 * slope
        second = 0.999 * second + 0.001 * slope**2
        size = np.sqrt(second / (1.0 - 0.999**step)) + 1e-8
        weights -= RATE * first / (1.0 - 0.9**step) / size
    return weights


def table(learning: dict[str, Examples], testing: dict[str, Examples]) -> None:
    """Tells what models that learnt in one weather, and in all, get right in each."""
    print(f"| learnt | {' | '.join(WEATHERS)} |")
    print(f"|---|{'---|' * len(WEATHERS)}")
    for name, weathers in [*((one, [one]) for one in WEATHERS), ("all", list(WEATHERS))]:
        weights = learn(*gathered([learning[weather] for weather in weathers]))
        shares = []
        for weather in WEATHERS:
            features, classes = gathered([testing[weather]])
            told = (features @ weights.T).argmax(axis=1)
            there = np.unique(classes)
            right = [np.mean(told[classes == one] == one) for one in there]
            shares.append(f"{100.0 * float(np.mean(right)):.0f}")
        print(f"| {name} | {' | '.join(shares)} |", flush=True)


def gathered(parts: list[Examples]) -> tuple[Numbers, NDArray[np.int64]]:
    """Features with a constant behind them, and classes.

    Raises:
        ValueError: nothing was cut out.
    """
    features = [one for part in parts for one in part.features]
    if not features:
        raise ValueError("nothing was seen: more --scenes are needed")
    ones = np.ones((len(features), 1))
    classes = np.array([one for part in parts for one in part.classes])
    return np.hstack([np.array(features), ones]), classes


if __name__ == "__main__":
    parser = options_of(__doc__ or "")
    parser.add_argument("--town", default="Town02", help="default: %(default)s")
    parser.add_argument("--scenes", type=int, default=150, help="default: %(default)s")
    parser.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    finish(main, parser.parse_args())
