"""Counts of infractions over an episode, as the driving benchmark of CARLA 0.8 counts them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """A column of measurements, what it must rise by within `within` frames, the pause after it.

    Collisions are N s, lanes shares between 0 and 1; with `within` 0 the value itself counts.
    """

    column: str
    threshold: float
    within: int
    pause: int


RULES = {
    "other": Rule("collision_other", 400.0, 10, 20),
    "vehicle": Rule("collision_vehicles", 400.0, 10, 30),
    "pedestrian": Rule("collision_pedestrians", 300.0, 5, 100),
    "off-road": Rule("intersection_offroad", 0.3, 0, 20),
    "other-lane": Rule("intersection_otherlane", 0.4, 0, 20),
}


def count(values: Sequence[float], rule: Rule) -> int:
    """How often the rule was broken, at most once in its pause."""
    found, frame = 0, 0
    while frame < len(values):
        before = values[max(0, frame - rule.within)] if rule.within else 0.0
        if values[frame] - before > rule.threshold:
            found += 1
            frame += rule.pause
        else:
            frame += 1
    return found
