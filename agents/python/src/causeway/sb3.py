"""Driving tasks as a vector environment of Stable-Baselines3.

::

    from causeway.sb3 import DriveVecEnv
    model = PPO("MlpPolicy", DriveVecEnv(num_envs=64, task="corl17-straight", tier="kinematic"))

Settings are those of :class:`causeway.rollout.Batch`. Where Stable-Baselines3 is not installed the
class is there all the same, with the same methods.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from causeway.rollout import Batch
from causeway.spaces import action_space, observation_space, with_own

try:
    from stable_baselines3.common.vec_env import VecEnv as _Base  # type: ignore[import-not-found]
except ImportError:

    class _Base:  # type: ignore[no-redef]
        """What of Stable-Baselines3's class this one relies on."""

        def __init__(self, num_envs: int, observed: Any, acted: Any) -> None:
            self.num_envs, self.observation_space, self.action_space = num_envs, observed, acted
            self.reset_infos: list[dict[str, Any]] = [{} for _ in range(num_envs)]
            self.render_mode: str | None = None
            self._reset_seeds()

        def _reset_seeds(self) -> None:
            self._seeds: list[int | None] = [None] * self.num_envs

        def seed(self, seed: int | None = None) -> Sequence[int | None]:
            """For the next reset: environment `i` has `seed + i`."""
            numbers = range(self.num_envs)
            self._seeds = [None if seed is None else seed + number for number in numbers]
            return self._seeds

        def step(self, actions: NDArray[np.float32]) -> Any:
            """Acts in all environments for one step."""
            self.step_async(actions)  # type: ignore[attr-defined]
            return self.step_wait()  # type: ignore[attr-defined]


Floats = NDArray[np.float32]
Info = dict[str, Any]
Indices = int | Iterable[int] | None


class DriveVecEnv(_Base):  # type: ignore[misc]
    """Many worlds in one batch. The next episode begins in the step that ends one.

    The info of an ended episode has `terminal_observation`, `TimeLimit.truncated`, `drive` with its
    numbers, and `episode` with return, length and simulated seconds, as a monitor writes them.
    """

    def __init__(self, num_envs: int = 1, **settings: Any) -> None:
        """Opens a batch."""
        own = {"worlds": num_envs, "agents": 1, "autoreset": "same_step"}
        self.batch = Batch(**with_own(settings, **own))
        self.metadata: dict[str, Any] = {"render_modes": []}
        super().__init__(num_envs, observation_space(self.batch), action_space())

    def reset(self) -> Floats:
        """Begins all episodes anew: those of the seeds that were given since the last reset."""
        observations = self.batch.reset(list(self._seeds))
        self._reset_seeds()
        seeds = self.batch.seeds.tolist()
        self.reset_infos = [{"seed": seed} for seed in seeds]
        return observations.copy()

    def step_async(self, actions: Floats) -> None:
        """Begins a step."""
        self.batch.send(np.asarray(actions, np.float32))

    def step_wait(self) -> tuple[Floats, Floats, NDArray[np.bool_], list[Info]]:
        """Observations, rewards, ends and infos of the step that was begun."""
        observations, rewards, terminated, truncated = self.batch.recv()
        over = terminated | truncated
        infos: list[Info] = [{"TimeLimit.truncated": False} for _ in range(self.num_envs)]
        for row in np.flatnonzero(over).tolist():
            values = (float(value) for value in self.batch.episodes[row])
            drive = dict(zip(self.batch.episode_columns, values, strict=True))
            infos[row] = {
                "terminal_observation": self.batch.final_observations[row].copy(),
                "TimeLimit.truncated": bool(truncated[row] and not terminated[row]),
                "drive": drive,
                "episode": {"r": drive["return"], "l": int(drive["steps"]), "t": drive["secs"]},
            }
            self.reset_infos[row] = {"seed": int(self.batch.seeds[row])}
        return observations.copy(), rewards.copy(), over, infos

    def close(self) -> None:
        """Ends all worlds."""
        self.batch.close()

    def get_attr(self, attr_name: str, indices: Indices = None) -> list[Any]:
        """An attribute of the batch, once for each environment."""
        if attr_name == "render_mode":
            return [None] * self._count(indices)
        return [getattr(self.batch, attr_name)] * self._count(indices)

    def set_attr(self, attr_name: str, value: Any, indices: Indices = None) -> None:
        """Refuses: settings of worlds that are open do not change."""
        del value, indices
        raise AttributeError(f"{attr_name!r} cannot be set: open another with other settings")

    def env_method(
        self, method_name: str, *args: Any, indices: Indices = None, **kwargs: Any
    ) -> list[Any]:
        """What a method of the batch returns, called once, for each environment."""
        return [getattr(self.batch, method_name)(*args, **kwargs)] * self._count(indices)

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Indices = None) -> list[bool]:
        """Worlds have no wrappers."""
        del wrapper_class
        return [False] * self._count(indices)

    def get_images(self) -> list[None]:
        """There are no pictures."""
        return [None] * self.num_envs

    def _count(self, indices: Indices) -> int:
        if indices is None:
            return int(self.num_envs)
        return 1 if isinstance(indices, int) else len(list(indices))
