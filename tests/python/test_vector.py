"""Driving tasks as Gymnasium environments, one and many."""

import contextlib
import warnings

import causeway.vector
import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import (
    DictInfoToList,
    NormalizeObservation,
    RecordEpisodeStatistics,
)

from running_site import binary

SETTINGS = {"town": "Town02", "task": "lane-keep"}


@pytest.fixture
def make():
    """Makes vector environments that are closed after the test."""
    with contextlib.ExitStack() as stack:

        def another(num_envs, **settings):
            settings = {**SETTINGS, "program": str(binary()), **settings}
            envs = gymnasium.make_vec("causeway/Drive-v0", num_envs=num_envs, **settings)
            stack.callback(envs.close)
            return envs

        yield another


def test_gymnasiums_own_check_finds_nothing():
    env = gymnasium.make("causeway.vector:causeway/Drive-v0", program=str(binary()), **SETTINGS)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
    env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_many_are_what_as_many_single_ones_are(make, mode):
    envs = make(4, autoreset_mode=mode, horizon_secs=12.0)
    causeway.vector.check(envs.unwrapped, steps=400)


def test_modes_go_by_the_names_of_a_batch_and_own_settings_are_not_overridden_unsaid(make):
    named = make(2, autoreset_mode="same_step").unwrapped
    assert named.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    for setting in ({"worlds": 64}, {"agents": 2}, {"autoreset": "same_step"}):
        (name,) = setting
        with pytest.raises(ValueError, match=f"{name} is .* in this environment, not"):
            make(2, **setting)
        with pytest.raises(ValueError, match=f"{name} is .* in this environment, not"):
            gymnasium.make("causeway.vector:causeway/Drive-v0", program=str(binary()), **setting)


def test_seeds_come_as_a_number_as_a_list_or_not_at_all(make):
    envs = make(3)
    first, info = envs.reset(seed=5)
    assert info["seed"].shape == (3,) and info["_seed"].all()
    again, same = envs.reset(seed=[5, 6, 7])
    assert np.array_equal(first, again) and np.array_equal(info["seed"], same["seed"])
    other, further = envs.reset()
    assert not np.array_equal(other, again) and not np.array_equal(info["seed"], further["seed"])
    with pytest.raises(ValueError, match="wanted 3 seeds, found 2"):
        envs.reset(seed=[1, 2])


def test_masks_reset_some_and_what_is_no_mask_is_refused(make):
    envs = make(3)
    before, _ = envs.reset(seed=1)
    options = {"reset_mask": np.array([False, True, False])}
    after, info = envs.reset(seed=[None, 9, None], options=options)
    assert np.array_equal(before[[0, 2]], after[[0, 2]])
    assert not np.array_equal(before[1], after[1])
    assert info["_seed"].tolist() == [False, True, False] and "reset_mask" in options
    for bad, error in (
        ([True, False, False], TypeError),
        (np.array([1, 0, 0]), TypeError),
        (np.array([True]), ValueError),
        (np.zeros(3, np.bool_), ValueError),
    ):
        with pytest.raises(error, match="reset_mask"):
            envs.reset(options={"reset_mask": bad})


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_statistics_are_those_summed_by_hand(make, mode):
    envs = RecordEpisodeStatistics(make(4, autoreset_mode=mode, horizon_secs=6.0))
    envs.reset(seed=3)
    rewards, lengths, ended = np.zeros(4), np.zeros(4, int), 0
    over = np.zeros(4, np.bool_)
    for _ in range(200):
        actions = np.tile(np.array([[0.05, 0.6]], np.float32), (4, 1))
        if mode is AutoresetMode.DISABLED and over.any():
            envs.reset(options={"reset_mask": over})
            over = np.zeros(4, np.bool_)
        _, reward, terminated, truncated, info = envs.step(actions)
        counted = ~over if mode is AutoresetMode.NEXT_STEP else np.ones(4, np.bool_)
        rewards[counted] += reward[counted]
        lengths[counted] += 1
        over = terminated | truncated
        for row in np.flatnonzero(over):
            drive = info["final_info"] if mode is AutoresetMode.SAME_STEP else info
            assert info["episode"]["l"][row] == lengths[row] == drive["drive"]["steps"][row]
            assert info["episode"]["r"][row] == pytest.approx(rewards[row], abs=1e-3)
            assert drive["drive"]["return"][row] == pytest.approx(rewards[row], abs=1e-3)
            ended += 1
        rewards[over], lengths[over] = 0.0, 0
    assert ended >= 8 and envs.episode_count == ended


def test_wrappers_of_gymnasium_go_around_it(make):
    envs = DictInfoToList(NormalizeObservation(make(4, horizon_secs=2.0)))
    _, infos = envs.reset(seed=1)
    assert [set(info) for info in infos] == [{"seed"}] * 4
    ends = 0
    for _ in range(30):
        observations, *_, infos = envs.step(envs.action_space.sample())
        ends += sum("drive" in info for info in infos)
    assert np.isfinite(observations).all() and ends >= 4


def test_what_is_not_copied_changes_with_a_later_step(make):
    copied, viewed = make(2), make(2, copy=False)
    actions = np.full((2, 2), 0.5, np.float32)
    for envs, stays in ((copied, True), (viewed, False)):
        envs.reset(seed=1)
        observations = envs.step(actions)[0]
        before = observations.copy()
        envs.step(actions)
        envs.step(actions)
        assert np.array_equal(observations, before) is stays


def test_observations_lie_in_their_space(make):
    for normalise in (True, False):
        envs = make(8, normalise=normalise)
        envs.action_space.seed(1)
        envs.reset(seed=1)
        for _ in range(200):
            observations = envs.step(envs.action_space.sample())[0]
            assert envs.observation_space.contains(observations)
