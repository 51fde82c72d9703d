"""Draws the start positions of the loaded map, with their numbers, over its roads.

causeway up
python view_start_positions.py --positions all --out positions.pdf

The numbers are those of `get_spawn_points()`. The picture is seen from above, x to the right and y
down, as CARLA's axes are.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

import matplotlib
from simulator import carla, connect, finish, options_of, tell

#: Between points of a road, m.
SPACING_M = 2.0
#: So much of the map on an inch, on which a number of size 6 is as high as a lane is wide; and the
#: shortest and longest side of the picture in inches.
SCALE_M = 25.0
SIDES_INCHES = 6.0, 60.0
#: Numbers are written behind the place, along its lane.
LABEL_M = 4.0


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument(
        *("-pos", "--positions"),
        default="all",
        metavar="all|N,N...",
        help="which start positions (default: %(default)s)",
    )
    parser.add_argument("--no-labels", action="store_true", help="circles without numbers")
    parser.add_argument(
        "--out", type=Path, help="picture, e.g. .pdf, .png, .svg (default: MAP_positions.pdf)"
    )
    parser.add_argument("--show", action="store_true", help="show a window instead of saving")
    finish(run, parser.parse_args())


def run(options: argparse.Namespace) -> None:
    town = connect(options).get_world().get_map()
    name = town.name.rsplit("/", 1)[-1]
    starts = town.get_spawn_points()
    numbers = chosen(options.positions, len(starts), name)
    if not options.show:
        matplotlib.use("Agg")
    tell(options, f"drawing {len(numbers)} of {len(starts)} start positions of {name}")
    draw(town, f"{name}: {len(numbers)} of {len(starts)} start positions", starts, numbers, options)


def chosen(wanted: str, count: int, town: str) -> list[int]:
    """The numbers of start positions. ValueError if one is none, or beyond the last."""
    if wanted == "all":
        return list(range(count))
    numbers = []
    for word in wanted.split(","):
        if not word.strip().isdecimal():
            raise ValueError(f"--positions: {word!r} is not a number: wanted all, or e.g. 140,134")
        if int(word) >= count:
            raise ValueError(f"--positions: {town} has no start position {word}: 0 to {count - 1}")
        numbers.append(int(word))
    return numbers


def draw(
    town: carla.Map,
    title: str,
    starts: list[carla.Transform],
    numbers: list[int],
    options: argparse.Namespace,
) -> None:
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection

    lanes = ground(town)
    figure, axes = plt.subplots(figsize=size_inches(lanes), layout="constrained")
    axes.add_collection(PolyCollection(lanes, facecolors="#d8d8d8", zorder=1))
    for number in numbers:
        mark(axes, starts[number], "" if options.no_labels else str(number))
    axes.set_title(title)
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.invert_yaxis()
    if options.show:
        plt.show()
    else:
        out = options.out or Path(f"{town.name.rsplit('/', 1)[-1]}_positions.pdf")
        figure.savefig(out, dpi=150)
        print(f"saved {out}")


def size_inches(lanes: list[list[tuple[float, float]]]) -> tuple[float, float]:
    """Of a picture of these outlines."""
    spans_m = [
        max(point[axis] for lane in lanes for point in lane)
        - min(point[axis] for lane in lanes for point in lane)
        for axis in (0, 1)
    ]
    low, high = SIDES_INCHES
    wide, tall = (min(high, max(low, span / SCALE_M)) for span in spans_m)
    return wide, tall


def mark(axes: Any, start: carla.Transform, label: str) -> None:
    """A circle at a place, a line to where a car there looks, the label behind it."""
    x, y = start.location.x, start.location.y
    yaw_deg = start.rotation.yaw
    ahead = math.cos(math.radians(yaw_deg)), math.sin(math.radians(yaw_deg))
    axes.scatter([x], [y], s=16, color="#c0392b", zorder=3, gid="start")
    axes.plot([x, x + 4.0 * ahead[0]], [y, y + 4.0 * ahead[1]], color="#c0392b", lw=0.8)
    if label:
        # The picture's y goes down, so that yaw turns as in CARLA; never upside down.
        turn_deg = (-yaw_deg + 90.0) % 180.0 - 90.0
        at = (x - LABEL_M * ahead[0], y - LABEL_M * ahead[1])
        style = {"size": 6, "ha": "center", "va": "center", "zorder": 4, "gid": "number"}
        axes.text(*at, label, rotation=turn_deg, **style)


def ground(town: carla.Map) -> list[list[tuple[float, float]]]:
    """The outline of every lane between two places where lanes begin and end, x and y in m."""
    outlines = []
    for first, last in town.get_topology():
        lane = [first, *first.next_until_lane_end(SPACING_M), last]
        sides = [edge(point, 0.5) for point in lane], [edge(point, -0.5) for point in lane]
        outlines.append([*sides[0], *reversed(sides[1])])
    return outlines


def edge(point: carla.Waypoint, share: float) -> tuple[float, float]:
    """A point beside the middle of a lane, in shares of its width to the right."""
    place, right = point.transform.location, point.transform.get_right_vector()
    aside_m = share * point.lane_width
    return place.x + aside_m * right.x, place.y + aside_m * right.y


if __name__ == "__main__":
    main()
