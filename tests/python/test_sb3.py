"""Stable-Baselines3's form of a vector environment, beside the batch that it shows."""

import warnings

import gymnasium
import numpy as np
import pytest
from causeway.rollout import Batch
from causeway.sb3 import DriveVecEnv

from running_site import binary

SETTINGS = {"town": "Town02", "tier": "kinematic", "task": "lane-keep"}


@pytest.fixture
def envs():
    envs = DriveVecEnv(num_envs=6, program=str(binary()), **SETTINGS)
    yield envs
    envs.close()


def test_steps_are_those_of_the_batch_and_ends_tell_the_last_observation(envs):
    own = {"worlds": 6, "autoreset": "same_step", "program": str(binary())}
    with Batch(**SETTINGS, **own) as beside:
        envs.seed(40)
        assert np.array_equal(envs.reset(), beside.reset(40))
        assert [info["seed"] for info in envs.reset_infos] == beside.seeds.tolist()
        ended = 0
        for _ in range(120):
            actions = np.tile(np.array([[0.2, 1.0]], np.float32), (6, 1))
            observations, rewards, over, infos = envs.step(actions)
            shown, earned, terminated, truncated = beside.step(actions)
            assert np.array_equal(observations, shown) and np.array_equal(rewards, earned)
            assert np.array_equal(over, terminated | truncated) and len(infos) == 6
            for row in np.flatnonzero(over):
                info = infos[row]
                assert np.array_equal(info["terminal_observation"], beside.final_observations[row])
                assert not np.array_equal(info["terminal_observation"], observations[row])
                assert info["TimeLimit.truncated"] == bool(truncated[row])
                assert info["episode"]["l"] == info["drive"]["steps"] > 0
                assert envs.reset_infos[row]["seed"] == beside.seeds[row]
                ended += 1
        assert ended >= 6
    assert not np.shares_memory(observations, envs.batch.observations)


def test_the_time_that_is_up_is_told_as_such():
    settings = {**SETTINGS, "horizon_secs": 0.5, "program": str(binary())}
    envs = DriveVecEnv(num_envs=2, **settings)
    envs.reset()
    for _ in range(5):
        *_, over, infos = envs.step(np.zeros((2, 2), np.float32))
    assert over.all() and all(info["TimeLimit.truncated"] for info in infos)
    envs.close()


def test_what_wrappers_ask_for_is_there(envs):
    assert envs.observation_space.shape == (46,) and envs.action_space.shape == (2,)
    assert envs.get_attr("render_mode") == [None] * 6
    assert envs.get_attr("step_secs", indices=[0, 3]) == [0.1, 0.1]
    assert envs.env_is_wrapped(object, indices=2) == [False]
    with pytest.raises(AttributeError, match="cannot be set"):
        envs.set_attr("tier", "physics")


def installed(module):
    reason = "Stable-Baselines3 needs torch, which is too large to be installed for tests"
    return pytest.importorskip(f"stable_baselines3.common.{module}", reason=reason)


def test_its_own_check_of_single_environments_finds_nothing():
    check_env = installed("env_checker").check_env
    env = gymnasium.make("causeway.vector:causeway/Drive-v0", program=str(binary()), **SETTINGS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, warn=True)
    env.close()


def test_it_is_one_of_stable_baselines(envs):
    base = installed("vec_env")
    assert isinstance(envs, base.VecEnv)
    monitored = base.VecMonitor(envs)
    monitored.reset()
    monitored.step(np.zeros((6, 2), np.float32))
