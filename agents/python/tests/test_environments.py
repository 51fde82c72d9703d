"""What environments say to those who use them otherwise than meant."""

import gymnasium
import numpy as np
import pytest

import causeway.gym
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


def test_agents_without_actions_and_actions_without_agents_are_named():
    env = parallel_env(agents=2, horizon_secs=0.2, **SETTINGS)
    action = np.zeros(2, np.float32)
    with pytest.raises(RuntimeError, match=r"no episode has begun: call reset\(\) first"):
        env.step({"ego_0": action, "ego_1": action})
    env.reset(seed=1)
    for given, found in (
        ({"ego_0": action}, "ego_0"),
        ({"ego_0": action, "ego_1": action, "me": action}, "ego_0, ego_1, me"),
        ({}, "nobody"),
    ):
        with pytest.raises(ValueError, match=f"those of ego_0, ego_1, found those of {found}$"):
            env.step(given)
    for shape in ((), (3,), (1, 2)):
        with pytest.raises(ValueError, match=r"action of ego_1 has the shape .* wanted \(2,\)"):
            env.step({"ego_0": action, "ego_1": np.zeros(shape)})
    both = {"ego_0": action, "ego_1": action}
    while env.agents:
        env.step(both)
    assert env.step(both) == ({}, {}, {}, {}, {}), "they have left"
    with pytest.raises(ValueError, match="wanted those of nobody, found those of me"):
        env.step({"me": action})
    env.close()


def test_actions_of_trolleys_that_are_none_are_refused(monkeypatch):
    monkeypatch.setattr(causeway.gym, "Session", lambda url: None)
    env = causeway.gym.TrolleyEnv()
    for action in (99, -1, 1.5, [0, 1]):
        with pytest.raises(ValueError, match="an action is a whole number, 0 to 5, not"):
            env.step(action)
    assert (
        env._message(np.int64(4)) == env._message(np.array([4])) == causeway.gym.DISCRETE_ACTIONS[4]
    )
    env = causeway.gym.TrolleyEnv(actions="continuous")
    with pytest.raises(ValueError, match=r"an action is \[steer, pedal\], not 3"):
        env.step(3)
    sent = {"steer": 0.5, "throttle": 0.0, "brake": 1.0}
    assert env._message([0.5, -2]) == ("control", sent)
