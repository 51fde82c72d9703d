"""What a batch of worlds says to settings that cannot be, and when it is over."""

import numpy as np
import pytest

from causeway.rollout import Batch, EngineError

SETTINGS = {"town": "Town02", "tier": "kinematic"}


@pytest.fixture
def batch():
    with Batch(worlds=2, **SETTINGS) as batch:
        yield batch


def test_settings_may_be_what_numpy_computed():
    numbers = {"worlds": np.int64(3), "seed": np.uint64(7), "horizon_secs": np.float32(3.0)}
    weights = {"progress": np.float32(0.5)}
    with Batch(**numbers, reward=weights, normalise=np.bool_(True), **SETTINGS) as batch:
        counted = batch.reset(seed=np.int64(5)).copy()
        assert np.array_equal(batch.reset(seed=np.array([5, 6, 7], np.uint64)), counted)
        assert batch.spec["horizon_secs"] == 3.0 and batch.spec["reward"] == {"progress": 0.5}


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"horizon_secs": float("nan")}, "horizon_secs .* wanted a finite number, found nan"),
        ({"horizon_secs": np.float32("inf")}, "horizon_secs .* wanted a finite number, found inf"),
        ({"reward": {"progress": -np.inf}}, "progress .* wanted a finite number, found -inf"),
        ({"reward": 5}, "reward is a name, or weights by term, not 5"),
        ({"seed": "a"}, r"a seed is a whole number, .* not 'a'"),
        ({"seed": 1.5}, r"a seed is a whole number, .* not 1\.5"),
        ({"seed": -1}, "a seed is a whole number, .* not -1"),
        ({"weathers": 5}, "weathers is a name or a list of names, not 5"),
        ({"ends": [5]}, r"ends is a name or a list of names, not \[5\]"),
    ],
)
def test_settings_that_cannot_be_are_named_before_anything_is_started(settings, words):
    with pytest.raises(ValueError, match=words):
        Batch(**{**SETTINGS, **settings})


@pytest.mark.parametrize("seed", [1.5, "ab", [1.5, 2], np.array(1.5)])
def test_a_reset_wants_whole_numbers(batch, seed):
    with pytest.raises(ValueError, match="a seed is a whole number"):
        batch.reset(seed=seed)


def test_one_end_may_come_by_its_name():
    with Batch(ends="arrived", **SETTINGS) as batch:
        assert batch.spec["ends"] == ["arrived"]


@pytest.mark.parametrize("flag", ["maps", "tasks"])
def test_a_folder_that_is_none_is_refused(tmp_path, flag):
    wanted = {"maps": r"\.xodr", "tasks": r"\.toml"}[flag]
    with pytest.raises(
        ValueError, match=f"{flag}: wanted a folder of {wanted} files, found nothing"
    ):
        Batch(**{flag: tmp_path / "gone"}, **SETTINGS)
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match=f"found a file at {tmp_path}/file"):
        Batch(**{flag: tmp_path / "file"}, **SETTINGS)


def test_folders_are_not_for_an_engine_that_runs(tmp_path):
    words = "maps and tasks: wanted no folders with address=, found .*--listen /run/engine --maps"
    with pytest.raises(ValueError, match=words):
        Batch(address="/run/engine", maps=tmp_path, tasks=tmp_path, **SETTINGS)


def test_a_batch_that_is_closed_says_so(batch):
    actions = np.zeros((2, 2), np.float32)
    batch.step(actions)
    held = batch.observations
    batch.send(actions)
    batch.close()
    batch.close()
    for call in (batch.recv, batch.reset, batch.engine_secs, lambda: batch.step(actions)):
        with pytest.raises(EngineError, match="the batch is closed"):
            call()
    assert np.isfinite(held).all()


def test_an_engine_that_is_not_there_is_named(tmp_path):
    path = tmp_path / "nope.sock"
    words = f"no engine at {path} .*: start one with `causeway rollout --listen {path}`"
    with pytest.raises(FileNotFoundError, match=words):
        Batch(address=path, **SETTINGS)
    with pytest.raises(OSError, match=r"no engine at /tmp/xxx.* too long"):
        Batch(address="/tmp/" + 200 * "x", **SETTINGS)
