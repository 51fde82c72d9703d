"""What environments say to those who use them otherwise than meant."""

import gymnasium
import numpy as np
import pytest

import causeway.vector
from causeway.rollout import EngineError
from causeway.sb3 import DriveVecEnv
from causeway.zoo import parallel_env

SETTINGS = {"town": "Town02", "tier": "kinematic"}


def test_a_mode_of_pictures_is_refused_so_that_stable_baselines_goes_on_without():
    """Its `make_vec_env` tries `rgb_array`, and again without after a `TypeError` alone."""
    with pytest.raises(TypeError, match="render_mode is None, as there are no pictures"):
        causeway.vector.DriveEnv(render_mode="rgb_array", **SETTINGS)
    with pytest.raises(TypeError, match="render_mode is None, as there are no pictures"):
        gymnasium.make_vec("causeway/Drive-v0", num_envs=2, render_mode="rgb_array", **SETTINGS)


def test_the_helper_of_stable_baselines_makes_some():
    reason = "Stable-Baselines3 needs torch, which is too large to be installed for tests"
    made = pytest.importorskip("stable_baselines3.common.env_util", reason=reason)
    envs = made.make_vec_env("causeway.vector:causeway/Drive-v0", n_envs=2, env_kwargs=SETTINGS)
    assert envs.reset().shape == (2, 46)
    envs.close()


def test_environments_that_are_closed_say_so():
    actions = np.zeros((2, 2), np.float32)
    one, many = causeway.vector.DriveEnv(**SETTINGS), DriveVecEnv(num_envs=2, **SETTINGS)
    several = parallel_env(agents=2, **SETTINGS)
    several.reset(seed=1)
    for env, given in (
        (one, actions[0]),
        (many, actions),
        (several, dict(zip(several.agents, actions, strict=True))),
    ):
        env.close()
        with pytest.raises(EngineError, match="the batch is closed"):
            env.step(given)
        with pytest.raises(EngineError, match="the batch is closed"):
            env.reset()
