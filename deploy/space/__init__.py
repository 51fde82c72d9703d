"""Causeway as an OpenEnv environment."""

from .client import CarlaAction, CarlaEnv, CarlaObservation, CarlaState

__all__ = ["CarlaAction", "CarlaEnv", "CarlaObservation", "CarlaState"]
