"""Shortest ways over the lanes of a map, without changes of lane, and their turns."""

from __future__ import annotations

import heapq
import itertools
import math
from dataclasses import dataclass, field

from simulator import carla

#: Between points of a lane, m.
SPACING_M = 2.0

#: Road, section and lane, as OpenDRIVE numbers them.
Key = tuple[int, int, int]


@dataclass(frozen=True)
class Place:
    """The point of a lane with the number `at`."""

    lane: Key
    at: int


@dataclass
class Lane:
    """From where it begins to where it ends: points x, y in m, and how far it turns."""

    points: list[tuple[float, float]]
    turn_deg: float
    is_junction: bool
    ways_on: list[Key] = field(default_factory=list)

    def length_m(self) -> float:
        return length_m(self.points)


@dataclass
class Route:
    """Points x, y in m from a start to a goal, and the turns on its way in degrees.

    `junctions_deg` are those of the junctions, positive to the right; `others_deg` is the largest
    one of a lane between them, without its sign.
    """

    points: list[tuple[float, float]]
    junctions_deg: list[float]
    others_deg: float

    def length_m(self) -> float:
        return length_m(self.points)


def length_m(points: list[tuple[float, float]]) -> float:
    return sum(math.dist(one, behind) for one, behind in itertools.pairwise(points))


def key_of(place: carla.Waypoint) -> Key:
    return place.road_id, place.section_id, place.lane_id


class Roads:
    """The lanes of a map and how they follow each other."""

    def __init__(self, town: carla.Map) -> None:
        self._town = town
        self.lanes: dict[Key, Lane] = {}
        for first, _ in town.get_topology():
            middle = [first, *first.next_until_lane_end(SPACING_M)]
            places = [place.transform.location for place in middle]
            turn = middle[-1].transform.rotation.yaw - first.transform.rotation.yaw
            lane = Lane(
                points=[(place.x, place.y) for place in places],
                turn_deg=(turn + 180.0) % 360.0 - 180.0,
                is_junction=first.is_junction,
            )
            own = key_of(first)
            onward = {key_of(one) for one in middle[-1].next(SPACING_M)} - {own}
            lane.ways_on = sorted(onward)
            self.lanes[own] = lane

    def place_of(self, location: carla.Location) -> Place:
        lane = key_of(self._town.get_waypoint(location))
        points = self.lanes[lane].points
        here = location.x, location.y
        at = min(range(len(points)), key=lambda index: math.dist(points[index], here))
        return Place(lane, at)

    def ways_from(self, start: Place) -> dict[Key, list[Key]]:
        """The shortest way to every lane that can be reached, as lanes from the first to it."""
        ways: dict[Key, list[Key]] = {}
        waiting: list[tuple[float, list[Key]]] = [(0.0, [start.lane])]
        while waiting:
            far_m, way = heapq.heappop(waiting)
            if way[-1] in ways:
                continue
            ways[way[-1]] = way
            for key in self.lanes[way[-1]].ways_on:
                if key in self.lanes and key not in ways:
                    cost_m = far_m + self.lanes[way[-1]].length_m()
                    heapq.heappush(waiting, (cost_m, [*way, key]))
        return ways

    def route(self, way: list[Key], start: Place, goal: Place) -> Route | None:
        """Along lanes from a start to a goal; None where the goal is before it on its lane."""
        if len(way) == 1:
            points = self.lanes[way[0]].points[start.at : goal.at + 1]
        else:
            points = self.lanes[way[0]].points[start.at :]
            for key in way[1:-1]:
                points = points + self.lanes[key].points
            points = points + self.lanes[way[-1]].points[: goal.at + 1]
        if len(points) < 2:
            return None
        lanes = [self.lanes[key] for key in way]
        return Route(
            points=points,
            junctions_deg=[lane.turn_deg for lane in lanes if lane.is_junction],
            others_deg=max(
                (abs(one.turn_deg) for one in lanes if not one.is_junction), default=0.0
            ),
        )
