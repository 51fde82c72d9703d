"""Drivers for the benchmark: each turns what it sees of the world into a control."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from roads import Route
from simulator import carla

CRUISE_MPS = 8.0
#: In turns, where the way ahead bends by more than `BEND_RAD`.
TURN_MPS = 5.0
BEND_RAD = 0.3
#: The driver aims at a point of the way so far ahead, m, and that of `AIM_SECS` further.
AIM_M = 3.0
AIM_SECS = 0.3
#: Whoever is so near to the way ahead, m, is in the way.
ASIDE_M = 2.2
#: Between the axles of the car driven here, m.
WHEELBASE_M = 2.85
#: A comfortable deceleration, and where to stand behind others, from middle to middle.
BRAKING_MPS2, BEHIND_M = 4.0, 7.0


class Agent(Protocol):
    def control(self, vehicle: carla.Vehicle, others: list[carla.Actor]) -> carla.VehicleControl:
        """What to do now, with other vehicles and walkers around."""


class Forward:
    """Goes straight on; what the benchmark of the old client came with."""

    def __init__(self, route: Route) -> None:
        del route

    def control(self, vehicle: carla.Vehicle, others: list[carla.Actor]) -> carla.VehicleControl:
        return carla.VehicleControl(throttle=0.9)


class Basic:
    """Follows the way, stops at red lights and behind whoever is on the way."""

    def __init__(self, route: Route) -> None:
        self._points = route.points
        self._at = 0
        self._lock_rad: float | None = None

    def control(self, vehicle: carla.Vehicle, others: list[carla.Actor]) -> carla.VehicleControl:
        pose, velocity = vehicle.get_transform(), vehicle.get_velocity()
        here = pose.location.x, pose.location.y
        speed_mps = math.hypot(velocity.x, velocity.y)
        window = self._points[self._at : self._at + 20]
        self._at += min(range(len(window)), key=lambda index: math.dist(window[index], here))
        ahead = self._points[self._at : self._at + 15]

        yaw = math.radians(pose.rotation.yaw)
        aim = first_beyond(ahead, here, AIM_M + AIM_SECS * speed_mps)
        bearing = wrap(math.atan2(aim[1] - here[1], aim[0] - here[0]) - yaw)
        # Pure pursuit: the circle through the point aimed at (Coulter 1992).
        curve = 2.0 * math.sin(bearing) / max(1.0, math.dist(aim, here))
        angle_rad = math.atan(curve * WHEELBASE_M)
        wanted_mps = self._speed(vehicle, ahead, here, yaw, others)
        pedal = 0.5 * (wanted_mps - speed_mps)
        return carla.VehicleControl(
            throttle=max(0.0, min(0.7, pedal)),
            brake=max(0.0, min(1.0, -pedal)) if wanted_mps > 0.0 else 1.0,
            steer=max(-1.0, min(1.0, angle_rad / self._lock_of(vehicle))),
        )

    def _lock_of(self, vehicle: carla.Vehicle) -> float:
        """The angle of the front wheels at full lock, asked for once."""
        if self._lock_rad is None:
            wheels = vehicle.get_physics_control().wheels
            self._lock_rad = math.radians(max(wheel.max_steer_angle for wheel in wheels))
        return self._lock_rad

    def _speed(
        self,
        vehicle: carla.Vehicle,
        ahead: list[tuple[float, float]],
        here: tuple[float, float],
        yaw: float,
        others: list[carla.Actor],
    ) -> float:
        go = carla.TrafficLightState.Green, carla.TrafficLightState.Off
        if vehicle.is_at_traffic_light() and vehicle.get_traffic_light_state() not in go:
            return 0.0
        end = ahead[-1]
        bend = abs(wrap(math.atan2(end[1] - here[1], end[0] - here[0]) - yaw))
        wanted_mps = TURN_MPS if bend > BEND_RAD else CRUISE_MPS
        for other in others:
            place = other.get_location()
            if math.dist((place.x, place.y), here) > 35.0 or other.id == vehicle.id:
                continue
            gaps = [math.dist((place.x, place.y), point) for point in ahead[1:]]
            if gaps and min(gaps) < ASIDE_M:
                free_m = math.dist((place.x, place.y), here) - BEHIND_M
                wanted_mps = min(wanted_mps, math.sqrt(2.0 * BRAKING_MPS2 * max(0.0, free_m)))
        return wanted_mps


def first_beyond(
    points: list[tuple[float, float]], here: tuple[float, float], far_m: float
) -> tuple[float, float]:
    """The first point that is farther than that, or the last."""
    return next((point for point in points if math.dist(point, here) > far_m), points[-1])


def wrap(angle: float) -> float:
    return math.atan2(math.sin(angle), math.cos(angle))


AGENTS: dict[str, Callable[[Route], Agent]] = {"forward": Forward, "basic": Basic}
