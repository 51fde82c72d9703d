"""What the old client's measurements told of the player: collisions, share of other lane and road.

The shares are those of the vehicle's ground area, looked at in a grid of points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from simulator import carla

#: Points of the grid along and across the vehicle.
ALONG, ACROSS = 5, 3


@dataclass
class Collisions:
    """Sums of impulses since the start of the episode, N s."""

    vehicles: float = 0.0
    pedestrians: float = 0.0
    other: float = 0.0

    def add(self, event: carla.CollisionEvent) -> None:
        impulse = event.normal_impulse.length()
        kind = event.other_actor.type_id
        if kind.startswith("vehicle."):
            self.vehicles += impulse
        elif kind.startswith("walker."):
            self.pedestrians += impulse
        else:
            self.other += impulse


@dataclass(frozen=True)
class Player:
    """The player's vehicle in one frame: metres, km/h, N s, and shares between 0 and 1."""

    x_m: float
    y_m: float
    speed_kmh: float
    other_lane: float
    off_road: float
    others: int

    def line(self, collisions: Collisions) -> str:
        return (
            f"vehicle at ({self.x_m:.1f}, {self.y_m:.1f}), {self.speed_kmh:.1f} km/h, "
            f"collisions: vehicles {collisions.vehicles:.0f}, "
            f"pedestrians {collisions.pedestrians:.0f}, other {collisions.other:.0f}, "
            f"{100 * self.other_lane:.0f} % other lane, {100 * self.off_road:.0f} % off road, "
            f"{self.others} others"
        )


def player(vehicle: carla.Vehicle, town: carla.Map, others: int) -> Player:
    pose = vehicle.get_transform()
    velocity = vehicle.get_velocity()
    other_lane, off_road = shares(pose, vehicle.bounding_box, town)
    return Player(
        x_m=pose.location.x,
        y_m=pose.location.y,
        speed_kmh=3.6 * math.hypot(velocity.x, velocity.y),
        other_lane=other_lane,
        off_road=off_road,
        others=others,
    )


def shares(pose: carla.Transform, box: carla.BoundingBox, town: carla.Map) -> tuple[float, float]:
    """How much of a vehicle is on lanes of the other direction, and how much on no lane."""
    against = outside = 0
    for i in range(ALONG):
        for j in range(ACROSS):
            point = carla.Location(
                x=box.location.x + box.extent.x * (2 * i / (ALONG - 1) - 1),
                y=box.location.y + box.extent.y * (2 * j / (ACROSS - 1) - 1),
            )
            lane = town.get_waypoint(
                pose.transform(point), project_to_road=False, lane_type=carla.LaneType.Driving
            )
            if lane is None:
                outside += 1
            elif not lane.is_junction and is_against(pose, lane.transform):
                against += 1
    return against / (ALONG * ACROSS), outside / (ALONG * ACROSS)


def is_against(pose: carla.Transform, lane: carla.Transform) -> bool:
    turn = math.radians(pose.rotation.yaw - lane.rotation.yaw)
    return math.cos(turn) < 0.0
