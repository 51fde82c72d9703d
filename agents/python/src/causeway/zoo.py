"""Driving tasks as a PettingZoo parallel environment: several cars in one world.

::

    from causeway.zoo import parallel_env
    env = parallel_env("lane-keep", agents=4, town="Town02", tier="kinematic")

Settings are those of :class:`causeway.rollout.Batch`. An agent whose episode has ended leaves the
world, and does not come back before the next reset.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from causeway.extras import missing
from causeway.rollout import ACTION_WIDTH, Batch

try:
    from gymnasium import spaces
    from pettingzoo import ParallelEnv

    from causeway.spaces import action_space, observation_space, with_own
except ModuleNotFoundError as error:
    raise missing("zoo", error) from error


Floats = NDArray[np.float32]
Info = dict[str, Any]

#: Numbers of an ended episode stand in an agent's info under this key.
DRIVE = "drive"


class DriveParallelEnv(ParallelEnv[str, Floats, Floats]):  # type: ignore[misc]
    """One world with cars `ego_0`, `ego_1` and so on, each with a way of its own."""

    # PettingZoo declares it on the instance and reads it from the class.
    metadata: dict[str, Any] = {"name": "causeway_drive_v0", "render_modes": []}  # noqa: RUF012

    def __init__(self, task: str = "lane-keep", *, agents: int = 2, **settings: Any) -> None:
        """Opens a batch of one world."""
        own = {"worlds": 1, "agents": agents, "autoreset": "disabled"}
        self.batch = Batch(task, **with_own(settings, **own))
        self.render_mode = None
        self.possible_agents = [f"ego_{number}" for number in range(agents)]
        self.agents: list[str] = []
        self._begun = False
        self._rows = {name: row for row, name in enumerate(self.possible_agents)}
        # PettingZoo wants the same object every time, and one for each agent.
        self._observations = {name: observation_space(self.batch) for name in self._rows}
        self._actions = {name: action_space() for name in self._rows}

    def observation_space(self, agent: str) -> spaces.Box[np.float32]:
        """The space of one row."""
        return self._observations[agent]

    def action_space(self, agent: str) -> spaces.Box[np.float32]:
        """Steering wheel and pedal."""
        return self._actions[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Floats], dict[str, Info]]:
        """Begins the first episode of a seed, or the next one; no options are known."""
        del options
        observations = self.batch.reset(None if seed is None else [seed])
        self.agents = list(self.possible_agents)
        self._begun = True
        info = {"seed": int(self.batch.seeds[0])}
        return self._shown(observations), {name: dict(info) for name in self.agents}

    def step(
        self, actions: dict[str, Floats]
    ) -> tuple[
        dict[str, Floats], dict[str, float], dict[str, bool], dict[str, bool], dict[str, Info]
    ]:
        """Acts for one step; what is returned has all agents that were there before it.

        Args:
            actions: of each agent that is there; those of agents that have left are of no effect.

        Raises:
            ValueError: an agent that is there has no action or one of another shape, or there is
                no such agent.
            RuntimeError: nothing was reset before.
        """
        if not self._begun:
            raise RuntimeError("no episode has begun: call reset() first")
        if not set(self.agents) <= set(actions) <= set(self.possible_agents):
            raise ValueError(
                f"actions of other agents; wanted those of {', '.join(self.agents) or 'nobody'}, "
                f"found those of {', '.join(map(str, actions)) or 'nobody'}"
            )
        if not self.agents:
            return {}, {}, {}, {}, {}
        given = np.zeros((self.batch.rows, ACTION_WIDTH), np.float32)
        for name in self.agents:
            action = np.asarray(actions[name], np.float32)
            if action.shape != (ACTION_WIDTH,):
                raise ValueError(
                    f"the action of {name} has the shape {action.shape}, wanted ({ACTION_WIDTH},)"
                )
            given[self._rows[name]] = action
        observations, rewards, terminated, truncated = self.batch.step(given)
        rows = {name: self._rows[name] for name in self.agents}
        shown = self._shown(observations)
        ended = {name for name, row in rows.items() if terminated[row] or truncated[row]}
        infos = {name: self._drive(row) if name in ended else {} for name, row in rows.items()}
        self.agents = [name for name in self.agents if name not in ended]
        return (
            shown,
            {name: float(rewards[row]) for name, row in rows.items()},
            {name: bool(terminated[row]) for name, row in rows.items()},
            {name: bool(truncated[row]) for name, row in rows.items()},
            infos,
        )

    def _shown(self, observations: Floats) -> dict[str, Floats]:
        return {name: observations[self._rows[name]].copy() for name in self.agents}

    def _drive(self, row: int) -> Info:
        values = self.batch.episodes[row]
        return {DRIVE: {name: values[at] for at, name in enumerate(self.batch.episode_columns)}}

    def state(self) -> Floats:
        """The rows of all agents, one behind the other; zero for those who have left."""
        rows: Floats = self.batch.observations.reshape(-1).copy()
        return rows

    def render(self) -> None:
        """There are no pictures."""

    def close(self) -> None:
        """Ends the world."""
        self.batch.close()


def parallel_env(task: str = "lane-keep", **settings: Any) -> DriveParallelEnv:
    """As PettingZoo's environments are made."""
    return DriveParallelEnv(task, **settings)
