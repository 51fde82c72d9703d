"""The tasks of "CARLA: An Open Urban Driving Simulator" (Dosovitskiy and others, CoRL 2017).

Starts and goals of the paper are numbers of CARLA 0.8's start positions, which maps of 0.9 do not
have: here they are drawn, always the same ones, under the conditions that the paper gives.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from roads import Place, Roads, Route
from simulator import carla

SEED = 2017
#: By the numbers of CARLA 0.8: those of training, then those of tests.
WEATHERS = {
    1: "ClearNoon",
    3: "WetNoon",
    6: "HardRainNoon",
    8: "ClearSunset",
    4: "WetCloudyNoon",
    14: "SoftRainSunset",
}
#: Starts and goals are so far from junctions, m.
CLEAR_M = 10.0
#: An episode is over when the way could have been driven at this speed, and so much later.
SLOWEST_KMH, SPARE_SECS = 10.0, 10.0
ARRIVED_M = 2.0


@dataclass(frozen=True)
class Task:
    """`lengths_m` of a way in Town01, and in smaller towns; cars and walkers likewise."""

    name: str
    lengths_m: tuple[tuple[float, float], tuple[float, float]]
    fits: Callable[[Route], bool]
    cars: tuple[int, int] = (0, 0)
    walkers: int = 0


@dataclass(frozen=True)
class Drive:
    """Numbers of spawn points, and the shortest way between them."""

    start: int
    goal: int
    route: Route

    def limit_secs(self) -> float:
        return self.route.length_m() / (SLOWEST_KMH / 3.6) + SPARE_SECS


def is_straight(route: Route) -> bool:
    return sum(map(abs, route.junctions_deg)) + route.others_deg < 10.0


def has_one_turn(route: Route) -> bool:
    turns = [turn for turn in route.junctions_deg if abs(turn) >= 15.0]
    return len(turns) == 1 and 60.0 <= abs(turns[0]) <= 120.0 and route.others_deg < 15.0


def has_turns(route: Route) -> bool:
    return sum(60.0 <= abs(turn) <= 120.0 for turn in route.junctions_deg) >= 3


NAVIGATION_M = ((400.0, 1200.0), (150.0, 600.0))
TASKS = (
    Task("straight", ((60.0, 250.0), (50.0, 150.0)), is_straight),
    Task("one-turn", ((100.0, 600.0), (80.0, 300.0)), has_one_turn),
    Task("navigation", NAVIGATION_M, has_turns),
    Task("navigation-dynamic", NAVIGATION_M, has_turns, cars=(20, 15), walkers=50),
)


def size_of(town: carla.Map) -> int:
    """0 for Town01, 1 for others: which of the two sizes of a task counts."""
    return 0 if "Town01" in town.name else 1


def drives(town: carla.Map, roads: Roads, task: Task, count: int) -> list[Drive]:
    """So many pairs for a task, none twice. ValueError if the map has not as many."""
    locations = [start.location for start in town.get_spawn_points()]
    clear = [number for number, one in enumerate(locations) if is_clear(town, one)]
    places = {number: roads.place_of(locations[number]) for number in clear}
    # Tasks with the same conditions have the same pairs.
    rng = random.Random(f"{SEED} {task.fits.__name__}")
    bounds_m = task.lengths_m[size_of(town)]
    starts = [
        from_start(roads, task, bounds_m, one, places, rng) for one in rng.sample(clear, len(clear))
    ]
    found: list[Drive] = []
    # Every start once, then those that have a second goal, and so on.
    while starts and len(found) < count:
        again = []
        for start in starts:
            drive = next(start, None) if len(found) < count else None
            if drive:
                found.append(drive)
                again.append(start)
        starts = again
    if len(found) < count:
        raise ValueError(f"{town.name} has {len(found)} ways for {task.name}, wanted {count}")
    return found[:count]


def from_start(
    roads: Roads,
    task: Task,
    bounds_m: tuple[float, float],
    start: int,
    places: dict[int, Place],
    rng: random.Random,
) -> Iterator[Drive]:
    """The drives from a start that a task can have, in an order drawn by chance."""
    ways = roads.ways_from(places[start])
    for goal in rng.sample(sorted(places), len(places)):
        way = ways.get(places[goal].lane)
        route = roads.route(way, places[start], places[goal]) if way else None
        if route and task.fits(route) and bounds_m[0] <= route.length_m() <= bounds_m[1]:
            yield Drive(start, goal, route)


def is_clear(town: carla.Map, place: carla.Location) -> bool:
    lane = town.get_waypoint(place)
    around = [lane, *lane.next(CLEAR_M), *lane.previous(CLEAR_M)]
    return not any(one.is_junction for one in around)
