"""Several cars in one world as a PettingZoo environment, by PettingZoo's own checks."""

import warnings

import numpy as np
import pytest
from causeway.rollout import Batch
from causeway.zoo import parallel_env
from pettingzoo.test import parallel_api_test, parallel_seed_test

from running_site import binary

SETTINGS = {"town": "Town02", "tier": "kinematic", "horizon_secs": 8.0}


def make(agents=2, **settings):
    return parallel_env(agents=agents, program=str(binary()), **{**SETTINGS, **settings})


@pytest.fixture
def env():
    env = make(4)
    yield env
    env.close()


@pytest.mark.parametrize("agents", [1, 2, 8])
def test_pettingzoos_own_check_finds_nothing(agents, capsys):
    env = make(agents)
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        parallel_api_test(env, num_cycles=1000)
    env.close()
    assert "Passed Parallel API test" in capsys.readouterr().out


def test_equal_seeds_give_equal_episodes():
    made = []

    def another():
        made.append(make())
        return made[-1]

    parallel_seed_test(another, num_cycles=200)
    for env in made:
        env.close()
    assert len(made) >= 2


def test_agents_are_the_rows_of_a_batch(env):
    settings = {**SETTINGS, "worlds": 1, "agents": 4, "autoreset": "disabled"}
    with Batch("lane-keep", program=str(binary()), **settings) as batch:
        rows = batch.reset([5])
        observations, infos = env.reset(seed=5)
        random = np.random.default_rng(0)
        while env.agents:
            assert [rows[int(name[-1])].tolist() for name in observations] == [
                row.tolist() for row in observations.values()
            ]
            live = list(env.agents)
            actions = random.uniform(-0.3, 1.0, (4, 2)).astype(np.float32)
            given = {name: actions[int(name[-1])] for name in live}
            observations, rewards, terminated, truncated, infos = env.step(given)
            rows, theirs, over, cut = batch.step(actions)
            for name in live:
                row = int(name[-1])
                assert rewards[name] == theirs[row]
                assert (terminated[name], truncated[name]) == (over[row], cut[row])
                assert ("drive" in infos[name]) == (terminated[name] or truncated[name])
            assert set(env.agents) == {n for n in live if not (terminated[n] or truncated[n])}
        assert env.state().shape == (4 * batch.width,)
    assert env.step({}) == ({}, {}, {}, {}, {})


def test_an_agent_without_an_action_is_named(env):
    env.reset(seed=1)
    with pytest.raises(ValueError, match="wanted those of ego_0, ego_1, ego_2, ego_3, found"):
        env.step({name: np.zeros(2, np.float32) for name in env.agents[:3]})
