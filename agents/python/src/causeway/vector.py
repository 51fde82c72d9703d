"""Driving tasks as Gymnasium environments: many at once, or one.

Importing this module registers ``causeway/Drive-v0`` for both::

    import gymnasium
    envs = gymnasium.make_vec("causeway.vector:causeway/Drive-v0", num_envs=256)
    env = gymnasium.make("causeway.vector:causeway/Drive-v0", task="corl17-straight")

Settings are those of :class:`causeway.rollout.Batch`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from causeway.extras import missing
from causeway.rollout import Autoreset, Batch

try:
    import gymnasium
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

    from causeway.spaces import action_space, observation_space, with_own
except ModuleNotFoundError as error:
    raise missing("gym", error) from error

Floats = NDArray[np.float32]
Flags = NDArray[np.bool_]
Info = dict[str, Any]

#: Numbers of an ended episode stand in `info` under this key.
DRIVE = "drive"

_MODES: dict[AutoresetMode, Autoreset] = {
    AutoresetMode.NEXT_STEP: "next_step",
    AutoresetMode.SAME_STEP: "same_step",
    AutoresetMode.DISABLED: "disabled",
}


def _drive(batch: Batch, row: int) -> Info:
    """The numbers of the episode that ended in a row."""
    values = batch.episodes[row]
    return {name: values[at] for at, name in enumerate(batch.episode_columns)}


def _no_pictures(render_mode: str) -> TypeError:
    """Of this type, after which Stable-Baselines3's `make_vec_env` goes on without the mode."""
    return TypeError(f"render_mode is None, as there are no pictures; not {render_mode!r}")


class DriveEnv(gymnasium.Env[Floats, Floats]):
    """One world. `info` has `seed` after a reset, and `drive` at the end of an episode."""

    # Gymnasium declares it on the instance and reads it from the class.
    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012

    def __init__(self, *, render_mode: str | None = None, **settings: Any) -> None:
        """Opens a batch of one world with these settings."""
        if render_mode is not None:
            raise _no_pictures(render_mode)
        self.batch = Batch(**with_own(settings, worlds=1, agents=1, autoreset="disabled"))
        self.observation_space = observation_space(self.batch)
        self.action_space = action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, Info]:
        """Begins the first episode of a seed, or the next one."""
        super().reset(seed=seed)
        observations = self.batch.reset(None if seed is None else [seed])
        return observations[0].copy(), {"seed": int(self.batch.seeds[0])}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, Info]:
        """Acts for one step."""
        row = np.asarray(action, dtype=np.float32)[np.newaxis]
        observations, rewards, terminated, truncated = self.batch.step(row)
        over = bool(terminated[0] or truncated[0])
        return (
            observations[0].copy(),
            float(rewards[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {DRIVE: _drive(self.batch, 0)} if over else {},
        )

    def close(self) -> None:
        """Ends the world."""
        self.batch.close()


class DriveVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """Many worlds in one batch, with the observations of as many :class:`DriveEnv`."""

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        copy: bool = True,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        """Opens a batch.

        Args:
            num_envs: how many worlds.
            autoreset_mode: when the next episode begins, by either name of the mode.
            copy: returns copies of observations; else views that later steps write.
            render_mode: there are no pictures.
            **settings: of :class:`causeway.rollout.Batch`.
        """
        if render_mode is not None:
            raise _no_pictures(render_mode)
        named: dict[AutoresetMode | str, AutoresetMode] = {it: mode for mode, it in _MODES.items()}
        self._mode = AutoresetMode(named.get(autoreset_mode, autoreset_mode))
        own = {"worlds": num_envs, "agents": 1, "autoreset": _MODES[self._mode]}
        self.batch = Batch(**with_own(settings, **own))
        self.num_envs = num_envs
        self.render_mode = None
        self.metadata = {"render_modes": [], "autoreset_mode": self._mode}
        self.single_observation_space = observation_space(self.batch)
        self.single_action_space = action_space()
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy = copy
        self._over = np.zeros(num_envs, dtype=np.bool_)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Floats, Info]:
        """Begins episodes anew.

        Args:
            seed: environment `i` has `seed + i`; or one for each.
            options: `reset_mask`, booleans of shape ``(num_envs,)``, says which; others go on.
        """
        mask = _mask(options, self.num_envs)
        if isinstance(seed, (Sequence, np.ndarray)):
            if len(seed) != self.num_envs:
                raise ValueError(f"wanted {self.num_envs} seeds, found {len(seed)}")
        observations = self.batch.reset(seed, mask=mask)
        chosen = np.ones(self.num_envs, np.bool_) if mask is None else mask.copy()
        self._over[chosen] = False
        info: Info = {}
        self._tell_seeds(info, chosen)
        return self._shown(observations), info

    def step(
        self, actions: Floats
    ) -> tuple[Floats, NDArray[Any], NDArray[Any], NDArray[Any], Info]:
        """Acts in all environments for one step."""
        given = np.asarray(actions)
        if given.dtype.kind in "iu":
            raise TypeError(f"actions are floats, not {given.dtype}")
        observations, rewards, terminated, truncated = self.batch.step(given)
        over = terminated | truncated
        info: Info = {}
        if self._mode is AutoresetMode.NEXT_STEP and self._over.any():
            self._tell_seeds(info, self._over.copy())
        if over.any():
            self._tell_ends(info, over)
        self._over = over
        return self._shown(observations), rewards.copy(), terminated.copy(), truncated.copy(), info

    def _tell_seeds(self, info: Info, chosen: Flags) -> None:
        # As Gymnasium gathers plain integers of single environments.
        info["seed"] = np.where(chosen, self.batch.seeds, 0).astype(np.int64)
        info["_seed"] = chosen

    def _tell_ends(self, info: Info, over: Flags) -> None:
        drive: Info = {}
        for at, name in enumerate(self.batch.episode_columns):
            drive[name] = np.where(over, self.batch.episodes[:, at], np.float32(0.0))
            drive[f"_{name}"] = over.copy()
        if self._mode is not AutoresetMode.SAME_STEP:
            info[DRIVE], info[f"_{DRIVE}"] = drive, over.copy()
            return
        finals = np.full(self.num_envs, None, dtype=object)
        for row in np.flatnonzero(over):
            finals[row] = self.batch.final_observations[row].copy()
        info["final_obs"], info["_final_obs"] = finals, over.copy()
        info["final_info"] = {DRIVE: drive, f"_{DRIVE}": over.copy()}
        info["_final_info"] = over.copy()
        self._tell_seeds(info, over.copy())

    def _shown(self, observations: Floats) -> Floats:
        return observations.copy() if self._copy else observations

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """The attribute of the batch, or what the method returns, once for each environment."""
        found = getattr(self.batch, name)
        return (found(*args, **kwargs) if callable(found) else found,) * self.num_envs

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """The attribute of the batch, once for each environment."""
        return (getattr(self.batch, name),) * self.num_envs

    def set_attr(self, name: str, values: Any) -> None:
        """Refuses: settings of worlds that are open do not change."""
        raise AttributeError(f"{name!r} cannot be set: open another batch with other settings")

    def close_extras(self, **kwargs: Any) -> None:
        """Ends all worlds."""
        self.batch.close()


def _mask(options: dict[str, Any] | None, count: int) -> Flags | None:
    """The mask of a reset; the options stay as they are for wrappers that look, too."""
    if options is None or "reset_mask" not in options:
        return None
    mask = options["reset_mask"]
    if not isinstance(mask, np.ndarray):
        raise TypeError(f"`options['reset_mask']` is a numpy array, not {type(mask)}")
    if mask.dtype != np.bool_:
        raise TypeError(f"`options['reset_mask']` has dtype bool, not {mask.dtype}")
    if mask.shape != (count,):
        raise ValueError(f"`options['reset_mask']` has shape {(count,)}, not {mask.shape}")
    if not mask.any():
        raise ValueError("`options['reset_mask']` has at least one True")
    return mask


def check(envs: DriveVectorEnv, *, steps: int = 2000, seed: int = 0) -> None:
    """Drives a vector environment beside single ones, and compares all that they return.

    Raises:
        AssertionError: they differ; says where.
    """
    spec = envs.batch.spec
    settings = {name: spec[name] for name in spec if name not in ("worlds", "agents", "autoreset")}
    program = envs.batch.program
    single = [lambda: DriveEnv(program=program, **settings)] * envs.num_envs
    beside = gymnasium.vector.SyncVectorEnv(single, autoreset_mode=envs.metadata["autoreset_mode"])
    try:
        _compare(envs, beside, steps, seed)
    finally:
        beside.close()


def _compare(envs: DriveVectorEnv, beside: VectorEnv[Any, Any, Any], steps: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    _same(envs.reset(seed=seed), beside.reset(seed=seed), "reset")
    assert envs.single_observation_space == beside.single_observation_space
    assert envs.single_action_space == beside.single_action_space
    for number in range(steps):
        actions = random.uniform(-1.0, 1.0, envs.action_space.shape or ()).astype(np.float32)
        # Mostly throttle, so that episodes end.
        actions[:, 1] = np.abs(actions[:, 1])
        ours, theirs = envs.step(actions), beside.step(actions)
        _same(ours, theirs, f"step {number}")
        over = ours[2] | ours[3]
        if envs.metadata["autoreset_mode"] is AutoresetMode.DISABLED and over.any():
            masks = [{"reset_mask": over.copy()} for _ in range(2)]
            _same(envs.reset(options=masks[0]), beside.reset(options=masks[1]), f"reset {number}")


def _same(ours: Any, theirs: Any, where: str) -> None:
    if isinstance(ours, tuple):
        assert len(ours) == len(theirs), where
        for index, pair in enumerate(zip(ours, theirs, strict=True)):
            _same(*pair, f"{where}, value {index}")
    elif isinstance(ours, dict):
        assert ours.keys() == theirs.keys(), f"{where}: {ours.keys()} and {theirs.keys()}"
        for key in ours:
            _same(ours[key], theirs[key], f"{where}, {key}")
    elif ours.dtype == object:
        for index, pair in enumerate(zip(ours, theirs, strict=True)):
            assert (pair[0] is None) == (pair[1] is None), f"{where}, entry {index}"
            if pair[0] is not None:
                _same(*pair, f"{where}, entry {index}")
    else:
        assert np.array_equal(ours, theirs), f"{where}: {ours} and {theirs}"


gymnasium.register(
    id="causeway/Drive-v0",
    entry_point="causeway.vector:DriveEnv",
    vector_entry_point="causeway.vector:DriveVectorEnv",
)
