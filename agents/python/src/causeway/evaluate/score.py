"""The driving score of CARLA's leaderboard, in its three versions, of what episodes tell.

Percent of the way, times a penalty for infractions. Of the leaderboard's infractions episodes know
collisions, red lights and time off the way. Nothing is subtracted for what they do not know: stop
signs, time-outs of scenarios, emergency vehicles that are not yielded to, and too little speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

#: Infractions that are counted, by column.
KINDS = {
    "collisions_walker": "people",
    "collisions_vehicle": "vehicles",
    "collisions_static": "things",
    "red_lights": "red lights",
}
#: By column: the factor for each in versions 1.0 and 2.0, and what each adds in version 2.1.
FACTORS = {
    "collisions_walker": 0.5,
    "collisions_vehicle": 0.6,
    "collisions_static": 0.65,
    "red_lights": 0.7,
}
SUMMANDS = {
    "collisions_walker": 1.0,
    "collisions_vehicle": 0.7,
    "collisions_static": 0.6,
    "red_lights": 0.4,
}


def _product(numbers: Mapping[str, float]) -> float:
    return math.prod(factor ** int(numbers.get(name, 0.0)) for name, factor in FACTORS.items())


def _sum(numbers: Mapping[str, float]) -> float:
    return 1.0 / (1.0 + sum(part * numbers.get(name, 0.0) for name, part in SUMMANDS.items()))


#: The penalty of each version. 2.0 differs from 1.0 in infractions alone that are not known here.
PENALTIES: dict[str, Callable[[Mapping[str, float]], float]] = {
    "1.0": _product,
    "2.0": _product,
    "2.1": _sum,
}


def driving_score(numbers: Mapping[str, float], version: str) -> float:
    """Of an episode's numbers by column, 0 to 100.

    The share of the way that was driven outside of it is taken by time, not by distance.

    Raises:
        KeyError: there is no such version.
    """
    secs = numbers.get("secs", 0.0)
    outside = numbers.get("off_route_secs", 0.0) / secs if secs > 0.0 else 0.0
    within = 1.0 - min(outside, 1.0)
    return 100.0 * numbers["completion"] * PENALTIES[version](numbers) * within
