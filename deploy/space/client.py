"""OpenEnv client of a Causeway server.

Fields and their meaning are those of `carla_env`: metres and degrees as CARLA has them (left-handed,
x forward, y right, z up), speeds in km/h where the name says so.
"""

from typing import Any, Literal

from openenv.core.env_client import EnvClient, StepResult
from openenv.core.env_server import Action, Observation, State
from pydantic import ConfigDict, Field

ActionType = Literal[
    "observe",
    "control",
    "emergency_stop",
    "brake_vehicle",
    "maintain_speed",
    "lane_change",
    "init_navigation_agent",
    "set_destination",
    "follow_route",
    "capture_image",
]


class CarlaAction(Action):
    """What the vehicle shall do. Fields that an action type does not use are ignored."""

    action_type: ActionType = "observe"
    #: 0 to 1.
    throttle: float = 0.0
    #: -1 (left) to 1 (right).
    steer: float = 0.0
    #: 0 to 1.
    brake: float = 0.0
    #: ``left`` or ``right``.
    lane_direction: str | None = None
    #: E.g. ``lane_1``, as observations name lanes.
    target_lane_id: str | None = None
    #: 0 to 200.
    target_speed_kmh: float | None = None
    #: 0 to 1.
    brake_intensity: float | None = None
    #: ``cautious``, ``normal`` or ``aggressive``.
    navigation_behavior: str | None = "normal"
    destination_x: float | None = None
    destination_y: float | None = None
    destination_z: float | None = None
    #: Ticks of one ``follow_route``.
    route_steps: int | None = 1


class CarlaObservation(Observation):
    """What the agent perceives; the server's schema at ``/schema`` lists all of it."""

    model_config = ConfigDict(extra="allow")

    scene_description: str = ""
    speed_kmh: float = 0.0
    location: tuple[float, float, float] = (0.0, 0.0, 0.0)
    #: Pitch, yaw, roll.
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    current_lane: str = "unknown"
    nearby_actors: list[dict[str, Any]] = Field(default_factory=list)
    collision_detected: bool = False
    collided_with: str | None = None
    #: JPEG in base64, after ``capture_image``.
    camera_image: str | None = None


class CarlaState(State):
    """The episode as the server counts it."""


class CarlaEnv(EnvClient[CarlaAction, CarlaObservation, CarlaState]):
    """One session with a world of its own."""

    def _step_payload(self, action: CarlaAction) -> dict[str, Any]:
        return action.model_dump()

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[CarlaObservation]:
        return StepResult(
            observation=CarlaObservation(**payload["observation"]),
            reward=payload.get("reward"),
            done=payload.get("done", False),
        )

    def _parse_state(self, payload: dict[str, Any]) -> CarlaState:
        return CarlaState(**payload)
