"""What a user of the OpenEnv client writes for this environment: three models and a thin client.

Fields, defaults and bounds are the table of the environment's data model. Works with both
generations of the client package.
"""

from typing import Any, Literal

from openenv.core.client_types import StepResult
from openenv.core.env_client import EnvClient
from openenv.core.env_server.types import Action, Observation, State
from pydantic import Field

ACTION_TYPES = (
    "control",
    "emergency_stop",
    "brake_vehicle",
    "maintain_speed",
    "lane_change",
    "observe",
    "init_navigation_agent",
    "set_destination",
    "follow_route",
    "capture_image",
)


class CarlaAction(Action):
    """Unknown fields are forbidden by the base class."""

    action_type: Literal[ACTION_TYPES] = "observe"  # type: ignore[valid-type]
    throttle: float = Field(default=0.0, ge=0.0, le=1.0)
    steer: float = Field(default=0.0, ge=-1.0, le=1.0)
    brake: float = Field(default=0.0, ge=0.0, le=1.0)
    lane_direction: str | None = None
    target_speed_kmh: float | None = Field(default=None, ge=0.0, le=200.0)
    brake_intensity: float | None = Field(default=None, ge=0.0, le=1.0)
    target_lane_id: str | None = None
    navigation_behavior: str | None = "normal"
    destination_x: float | None = None
    destination_y: float | None = None
    destination_z: float | None = None
    route_steps: int | None = Field(default=1, ge=1)


class CarlaObservation(Observation):
    """Unknown fields are forbidden by the base class: a server that adds one breaks its clients."""

    scene_description: str = ""
    speed_kmh: float = 0.0
    location: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    goal_distance: float | None = None
    goal_direction: str | None = None
    current_lane: str = "unknown"
    nearby_actors: list[dict[str, Any]] = Field(default_factory=list)
    collision_detected: bool = False
    collision_intensity: float = 0.0
    collided_with: str | None = None
    scenario_name: str = ""
    simulation_time: float = 0.0
    step_number: int = 0
    done_reason: str = ""
    rubric_reward: float | None = None
    camera_image: str | None = None


class CarlaState(State):
    """Unknown fields are kept by the base class; null is not a number."""

    scenario_name: str = "default"
    town: str = ""
    weather: str = ""
    total_distance: float = 0.0
    total_reward: float = 0.0
    simulation_time: float = 0.0
    num_turns: int = 0
    total_tool_calls: int = 0
    tool_call_counts: dict[str, int] = Field(default_factory=dict)
    is_truncated: bool = False
    average_speed: float = 0.0
    max_speed: float = 0.0
    collisions: list[dict[str, Any]] = Field(default_factory=list)
    collisions_count: int = 0
    collision_intensity_total: float = 0.0
    scenario_data: dict[str, Any] = Field(default_factory=dict)


class CarlaEnv(EnvClient[CarlaAction, CarlaObservation, CarlaState]):
    """Nothing but the three conversions that the base class asks for."""

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
