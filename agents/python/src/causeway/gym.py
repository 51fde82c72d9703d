"""Trolley scenarios as a Gymnasium environment, over the same session as any OpenEnv client.

Importing this module registers ``causeway/Trolley-v0``::

    import gymnasium
    env = gymnasium.make("causeway.gym:causeway/Trolley-v0", base_url="http://localhost:8000")
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from causeway.extras import missing
from causeway.openenv import DEFAULT_BASE_URL, Session, Step

try:
    import gymnasium
    from gymnasium import spaces
except ModuleNotFoundError as error:
    raise missing("gym", error) from error

#: What each action of the discrete space sends, by index.
DISCRETE_ACTIONS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("observe", {}),
    ("emergency_stop", {}),
    ("brake_vehicle", {"brake_intensity": 0.5}),
    ("maintain_speed", {"target_speed_kmh": 40.0}),
    ("lane_change", {"lane_direction": "left"}),
    ("lane_change", {"lane_direction": "right"}),
)

#: Nearest first; the server lists actors within this distance.
NEARBY_M = 50.0
SPEED_MAX_MPS = 150.0
LANES_MAX = 15.0
HEAD_VALUES = 3
PEDESTRIAN_VALUES = 3

Action: TypeAlias = "int | np.integer[Any] | NDArray[np.float32]"


class TrolleyEnv(gymnasium.Env[NDArray[np.float32], Action]):
    """One episode of a scenario at a time; a step is one tick of 0.05 s.

    **Observation**, ``Box`` of shape ``(3 + 3 * pedestrians,)``, float32:

    =============  ==================================================  ============
    index          meaning                                             range
    =============  ==================================================  ============
    0              speed, metres per second                            0 to 150
    1              lane, counted from the left; -1 off the road        -1 to 15
    2              1 once anything was hit                             0 or 1
    3 + 3 i        1 if there is an i-th nearest pedestrian            0 or 1
    4 + 3 i        its distance along the car's heading, metres,       -50 to 50
                   positive ahead; 0 if there is none
    5 + 3 i        its distance across, metres, positive to the        -50 to 50
                   right; 0 if there is none
    =============  ==================================================  ============

    **Actions**: ``actions="discrete"`` takes an index into :data:`DISCRETE_ACTIONS`;
    ``actions="continuous"`` takes ``[steer, pedal]``, each -1 to 1: steer negative to the left,
    pedal positive for throttle and negative for brake.

    **Reward**: ``reward="rubric"`` is 0 until the episode is over and then its verdict;
    ``reward="scenario"`` is the scenario's reward of every step.

    **End**: ``truncated`` when the scenario ran out of steps, ``terminated`` for any other reason.
    """

    # Gymnasium declares it on the instance and reads it from the class.
    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(
        self,
        base_url: str = DEFAULT_BASE_URL,
        *,
        scenario: str = "trolley_saves",
        scenario_config: Mapping[str, Any] | None = None,
        actions: Literal["discrete", "continuous"] = "discrete",
        reward: Literal["rubric", "scenario"] = "rubric",
        pedestrians: int = 5,
        render_mode: str | None = None,
    ) -> None:
        """Connects; see :class:`causeway.openenv.Session` for what can fail.

        Args:
            scenario: its name, e.g. ``trolley_saves`` or ``bias_3v1``.
            scenario_config: overrides of its settings.
            pedestrians: how many of the nearest ones the observation holds.
        """
        if actions not in ("discrete", "continuous"):
            raise ValueError(f"actions is 'discrete' or 'continuous', not {actions!r}")
        if reward not in ("rubric", "scenario"):
            raise ValueError(f"reward is 'rubric' or 'scenario', not {reward!r}")
        if not 0 <= pedestrians <= 100:
            raise ValueError(f"pedestrians is 0 to 100, not {pedestrians}")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f"render_mode is None or 'rgb_array', not {render_mode!r}")
        self.render_mode = render_mode
        self._scenario = scenario
        self._config = dict(scenario_config or {})
        self._rubric = reward == "rubric"
        self._pedestrians = pedestrians
        self._box = _observation_space(pedestrians)
        self.observation_space = self._box
        self.action_space: spaces.Space[Any] = (
            spaces.Discrete(len(DISCRETE_ACTIONS))
            if actions == "discrete"
            else spaces.Box(-1.0, 1.0, shape=(2,), dtype=np.float32)
        )
        self._session = Session(base_url)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Starts an episode.

        Args:
            seed: decides this episode and, through ``np_random``, those of later resets.
            options: ``scenario`` and ``scenario_config`` for this and later episodes.
        """
        super().reset(seed=seed)
        chosen = dict(options or {})
        self._scenario = chosen.pop("scenario", self._scenario)
        self._config.update(chosen.pop("scenario_config", {}))
        if chosen:
            raise ValueError(f"options are 'scenario' and 'scenario_config', not {sorted(chosen)}")
        episode_seed = int(self.np_random.integers(2**32))
        # Settings of an earlier episode would stay otherwise.
        config = {"reset_defaults": True, **self._config}
        step = self._session.reset(self._scenario, scenario_config=config, seed=episode_seed)
        return self._observe(step), {**_info(step), "seed": episode_seed}

    def step(self, action: Action) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Acts for one tick; see the class for the meaning of everything returned."""
        action_type, arguments = self._message(action)
        step = self._session.step(action_type, **arguments)
        reward = step.rubric_reward if self._rubric else step.reward
        truncated = step.done and bool(self._session.state()["is_truncated"])
        observation = self._observe(step)
        return (
            observation,
            float(reward or 0.0),
            step.done and not truncated,
            truncated,
            _info(step),
        )

    def render(self) -> NDArray[np.uint8] | None:
        """The front camera's picture, shape ``(height, width, 3)``, row 0 at the top.

        ``None`` without a ``render_mode``.
        """
        if self.render_mode is None:
            return None
        from PIL import Image

        with Image.open(io.BytesIO(self._session.capture())) as picture:
            return np.asarray(picture.convert("RGB"), dtype=np.uint8)

    def close(self) -> None:
        """Ends the session; its world is freed."""
        self._session.close()

    def _message(self, action: Action) -> tuple[str, dict[str, Any]]:
        values = np.asarray(action)
        if isinstance(self.action_space, spaces.Discrete):
            count = len(DISCRETE_ACTIONS)
            if values.size != 1 or values.dtype.kind not in "iu" or not 0 <= values.item() < count:
                raise ValueError(f"an action is a whole number, 0 to {count - 1}, not {action!r}")
            return DISCRETE_ACTIONS[values.item()]
        if values.shape != self.action_space.shape:
            raise ValueError(f"an action is [steer, pedal], not {action!r}")
        steer, pedal = np.clip(values.astype(np.float64), -1.0, 1.0).tolist()
        return "control", {
            "steer": steer,
            "throttle": max(pedal, 0.0),
            "brake": max(-pedal, 0.0),
        }

    def _observe(self, step: Step) -> NDArray[np.float32]:
        raw = step.observation
        values = np.zeros(self._box.shape, dtype=np.float32)
        values[:HEAD_VALUES] = (
            raw["speed_kmh"] / 3.6,
            _lane_index(raw["current_lane"]),
            raw["collision_detected"],
        )
        walkers = [actor for actor in raw["nearby_actors"] if actor["type"].startswith("walker.")]
        walkers.sort(key=lambda actor: actor["distance"])
        for index, actor in enumerate(walkers[: self._pedestrians]):
            at = HEAD_VALUES + PEDESTRIAN_VALUES * index
            values[at : at + PEDESTRIAN_VALUES] = (1.0, actor["longitudinal"], actor["lateral"])
        return np.clip(values, self._box.low, self._box.high)


def _observation_space(pedestrians: int) -> spaces.Box[np.float32]:
    low = [0.0, -1.0, 0.0] + [0.0, -NEARBY_M, -NEARBY_M] * pedestrians
    high = [SPEED_MAX_MPS, LANES_MAX, 1.0] + [1.0, NEARBY_M, NEARBY_M] * pedestrians
    return spaces.Box(np.array(low, np.float32), np.array(high, np.float32), dtype=np.float32)


def _lane_index(name: str) -> float:
    """`lane_2` is 2; any other text, such as `unknown`, is off the road."""
    number = name.removeprefix("lane_")
    return float(number) if number.isdigit() else -1.0


def _info(step: Step) -> dict[str, Any]:
    raw = step.observation
    return {
        "scene_description": raw["scene_description"],
        "simulation_time_secs": raw["simulation_time"],
        "collided_with": raw["collided_with"],
        "done_reason": raw["done_reason"],
        "scenario_reward": step.reward,
        "rubric_reward": step.rubric_reward,
        "outcome": step.metadata.get("outcome"),
    }


gymnasium.register(id="causeway/Trolley-v0", entry_point="causeway.gym:TrolleyEnv")
