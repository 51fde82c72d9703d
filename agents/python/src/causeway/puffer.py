"""Driving tasks as a native environment of PufferLib.

::

    from causeway.puffer import DriveEnv
    import pufferlib.vector
    envs = pufferlib.vector.make(DriveEnv, env_kwargs={"worlds": 256, "tier": "kinematic"})

Settings are those of :class:`causeway.rollout.Batch`. One such environment has all worlds of a
batch, and its engine has threads of its own: PufferLib's native backend, the default, takes it as
it is; `Serial` and `Multiprocessing` take several.
Where PufferLib is not installed the class is there all the same, with the same methods.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from causeway.rollout import Batch, Flags, Floats
from causeway.spaces import action_space, observation_space, with_own

try:
    from pufferlib import PufferEnv as _Base  # type: ignore[import-not-found]
except ImportError:

    class _Base:  # type: ignore[no-redef]
        """What of PufferLib's class this one relies on."""

        num_agents: int
        single_observation_space: Any
        single_action_space: Any

        def __init__(self, buf: Mapping[str, NDArray[Any]] | None = None) -> None:
            rows = self.num_agents
            given = buf or {
                "observations": np.zeros((rows, *self.single_observation_space.shape), np.float32),
                "rewards": np.zeros(rows, np.float32),
                "terminals": np.zeros(rows, np.bool_),
                "truncations": np.zeros(rows, np.bool_),
                "masks": np.ones(rows, np.bool_),
                "actions": np.zeros((rows, *self.single_action_space.shape), np.float32),
            }
            self.observations, self.rewards = given["observations"], given["rewards"]
            self.terminals, self.truncations = given["terminals"], given["truncations"]
            self.masks, self.actions = given["masks"], given["actions"]
            self.agent_ids = np.arange(rows)

        def async_reset(self, seed: int | None = None) -> None:
            """Begins anew; :meth:`recv` gives the observations."""
            self._infos = self.reset(seed)[1]  # type: ignore[attr-defined]

        def send(self, actions: ArrayLike) -> None:
            """Steps; :meth:`recv` gives what came of it."""
            self._infos = self.step(actions)[4]  # type: ignore[attr-defined]

        def recv(self) -> tuple[Any, ...]:
            """Everything that the last step or reset has written."""
            arrays = (self.observations, self.rewards, self.terminals, self.truncations)
            return (*arrays, self._infos, self.agent_ids, self.masks)


Infos = list[dict[str, float]]
#: Numbers of ended episodes that an info has the mean of.
TOLD = ("return", "steps", "completion", "success", "mean_speed_mps")


class DriveEnv(_Base):  # type: ignore[misc]
    """All worlds of a batch. The next episode begins in the step that ends one.

    Arrays are PufferLib's own and are written in place; `masks` tells which agents still drive. The
    info of a step in which episodes ended has their number `n` and the means of :data:`TOLD`.
    """

    def __init__(
        self,
        worlds: int = 1,
        *,
        buf: Mapping[str, NDArray[Any]] | None = None,
        seed: int = 0,
        **settings: Any,
    ) -> None:
        """Opens a batch."""
        own = {"worlds": worlds, "autoreset": "same_step", "seed": seed}
        self.batch = Batch(**with_own(settings, **own))
        self.single_observation_space = observation_space(self.batch)
        self.single_action_space = action_space()
        self.num_agents = self.batch.rows
        self.render_mode: str | None = None
        super().__init__(buf)

    def reset(self, seed: int | None = None) -> tuple[Floats, Infos]:
        """Begins all episodes anew; with `seed` world `i` begins with those of `seed + i`."""
        self.observations[:] = self.batch.reset(seed)
        self.rewards[:] = 0.0
        self.terminals[:] = self.truncations[:] = False
        self.masks[:] = self.batch.alive
        return self.observations, []

    def step(self, actions: ArrayLike) -> tuple[Floats, Floats, Flags, Flags, Infos]:
        """Acts in all worlds for one step."""
        shown, earned, terminated, truncated = self.batch.step(np.asarray(actions, np.float32))
        self.observations[:], self.rewards[:] = shown, earned
        self.terminals[:], self.truncations[:] = terminated, truncated
        self.masks[:] = self.batch.alive
        over = terminated | truncated
        infos: Infos = []
        if over.any():
            ended = self.batch.episodes[over]
            means = dict(zip(self.batch.episode_columns, ended.mean(axis=0).tolist(), strict=True))
            infos = [{**{name: means[name] for name in TOLD}, "n": float(over.sum())}]
        return self.observations, self.rewards, self.terminals, self.truncations, infos

    def close(self) -> None:
        """Ends all worlds."""
        self.batch.close()
