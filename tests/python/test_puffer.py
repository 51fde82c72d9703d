"""PufferLib's form of many worlds, beside the batch that it shows."""

import numpy as np
import pytest
from causeway.puffer import DriveEnv
from causeway.rollout import Batch

from running_site import binary

SETTINGS = {"town": "Town02", "tier": "kinematic", "task": "lane-keep", "program": str(binary())}


@pytest.fixture
def env():
    env = DriveEnv(worlds=3, agents=2, **SETTINGS)
    yield env
    env.close()


def test_steps_are_those_of_the_batch_in_arrays_that_stay(env):
    arrays = [env.observations, env.rewards, env.terminals, env.truncations, env.masks]
    own = {"worlds": 3, "agents": 2, "autoreset": "same_step"}
    with Batch(**SETTINGS, **own) as beside:
        observations, infos = env.reset(seed=40)
        assert np.array_equal(observations, beside.reset(40)) and infos == []
        ended = 0
        for _ in range(150):
            actions = np.tile(np.array([[0.2, 1.0]], np.float32), (6, 1))
            *told, infos = env.step(actions)
            shown = beside.step(actions)
            assert all(np.array_equal(*pair) for pair in zip(told, shown, strict=True))
            assert np.array_equal(env.masks, beside.alive)
            over = shown[2] | shown[3]
            assert len(infos) == int(over.any())
            if infos:
                assert infos[0]["n"] == over.sum()
                column = beside.episode_columns.index("success")
                assert infos[0]["success"] == pytest.approx(beside.episodes[over, column].mean())
                ended += over.sum()
        assert ended >= 6
    kept = [env.observations, env.rewards, env.terminals, env.truncations, env.masks]
    assert all(one is other for one, other in zip(arrays, kept, strict=True))


def test_buffers_of_a_trainer_are_written_in_place():
    buf = {
        "observations": np.zeros((2, 46), np.float32),
        "rewards": np.zeros(2, np.float32),
        "terminals": np.zeros(2, np.bool_),
        "truncations": np.zeros(2, np.bool_),
        "masks": np.zeros(2, np.bool_),
        "actions": np.zeros((2, 2), np.float32),
    }
    env = DriveEnv(worlds=2, buf=buf, **SETTINGS)
    env.async_reset(seed=3)
    first = env.recv()[0].copy()
    assert first is not buf["observations"] and np.array_equal(first, buf["observations"])
    assert buf["observations"].any() and buf["masks"].all()
    env.send(np.full((2, 2), 0.5, np.float32))
    observations, *_, ids, masks = env.recv()
    assert observations is buf["observations"] and masks is buf["masks"]
    assert ids.tolist() == [0, 1] and not np.array_equal(observations, first)
    env.close()


def test_it_is_one_of_pufferlib_and_its_vector_environments_take_it():
    reason = "PufferLib wants numpy below 2 and Gymnasium 0.29, beside which the others do not run"
    vector = pytest.importorskip("pufferlib.vector", reason=reason)
    from pufferlib import PufferEnv

    native = vector.make(DriveEnv, env_kwargs={"worlds": 8, **SETTINGS})
    assert isinstance(native, PufferEnv)
    settings = {"env_kwargs": {"worlds": 4, **SETTINGS}, "num_envs": 2}
    serial = vector.make(DriveEnv, backend=vector.Serial, **settings)
    several = vector.make(DriveEnv, backend=vector.Multiprocessing, num_workers=2, **settings)
    for envs in (native, serial, several):
        envs.async_reset(seed=5)
        for _ in range(20):
            observations, rewards, *_, masks = envs.recv()
            assert observations.shape == (8, 46) and rewards.shape == masks.shape == (8,)
            envs.send(np.tile(np.array([[0.0, 0.5]], np.float32), (8, 1)))
        assert observations[:, 0].mean() > 0.0
        envs.close()
