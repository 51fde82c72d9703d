"""Policies by name and by file, and what is no policy."""

import itertools

import numpy as np
import pytest
from causeway import policy
from causeway.rollout import Batch

from running_site import binary


@pytest.fixture(scope="module")
def batch():
    with Batch("corl17-straight", worlds=4, town="Town02", program=str(binary())) as batch:
        yield batch


def mlp(batch, seed=0, columns=None):
    random = np.random.default_rng(seed)
    names = columns or [column.name for column in batch.columns]
    sizes = [len(names), 8, 2]
    layers = [
        (0.1 * random.normal(size=ends).astype(np.float32), random.normal(size=ends[1]))
        for ends in itertools.pairwise(sizes)
    ]
    layers = [(weights, bias.astype(np.float32)) for weights, bias in layers]
    return policy.Mlp(layers, names, [column.scale for column in batch.columns][: len(names)])


def test_a_policy_that_was_saved_acts_as_before(batch, tmp_path):
    before = mlp(batch)
    before.save(tmp_path / "new" / "policy.npz")
    after = policy.named(str(tmp_path / "new" / "policy.npz"))
    after.begin(batch, 0)
    actions = after.act(batch.observations)
    assert np.array_equal(actions, before.act(batch.observations))
    assert actions.shape == (4, 2) and actions.dtype == np.float32
    assert (np.abs(actions) <= 1.0).all() and np.ptp(actions) > 0.0


def test_a_policy_acts_the_same_on_rows_in_their_units(batch):
    own = mlp(batch)
    normalised = own.act(batch.observations)
    settings = {"worlds": 4, "town": "Town02", "program": str(binary()), "normalise": False}
    with Batch("corl17-straight", **settings) as plain:
        own.begin(plain, 0)
        assert np.allclose(own.act(plain.observations), normalised, atol=1e-5)


@pytest.mark.parametrize("name", list(policy.NAMES))
def test_policies_by_name_give_an_action_for_each_row(name):
    driver = policy.named(name)
    settings = {"worlds": 4, "town": "Town02", "program": str(binary())}
    shown = policy.observation(driver)
    with Batch("corl17-straight", observation=shown, **settings) as batch:
        driver.begin(batch, 3)
        actions = driver.act(batch.observations)
        assert actions.shape == (4, 2) and actions.dtype == np.float32
        again = policy.named(name)
        again.begin(batch, 3)
        assert np.array_equal(actions, again.act(batch.observations))


def test_a_careful_driver_says_what_it_has_to_see(batch):
    with pytest.raises(ValueError, match="observation="):
        policy.named("careful").begin(batch, 3)


def test_files_that_lack_something_are_refused(batch, tmp_path):
    mlp(batch).save(tmp_path / "whole.npz")
    whole = (tmp_path / "whole.npz").read_bytes()
    with np.load(tmp_path / "whole.npz") as file:
        arrays = {name: file[name] for name in file.files}
    broken = tmp_path / "broken.npz"
    for size in (0, 3, 100, len(whole) // 2, len(whole) - 1):
        broken.write_bytes(whole[:size])
        with pytest.raises(ValueError, match=r"broken\.npz is no file of a policy: "):
            policy.named(str(broken))
    for name in ("columns", "scales", "weights0", "bias1"):
        np.savez(broken, **{key: value for key, value in arrays.items() if key != name})
        with pytest.raises(ValueError, match=r"broken\.npz is no file of a policy: no "):
            policy.named(str(broken))
    np.savez(broken, **{**arrays, "weights0": np.zeros(3)})
    with pytest.raises(ValueError, match=r"layers from \d+ columns to 2 actions wanted"):
        policy.named(str(broken))


def test_what_is_no_policy_is_refused_with_what_was_wanted(batch, tmp_path):
    with pytest.raises(ValueError, match=r"no policy 'fly': wanted forward, .* or a file FILE.npz"):
        policy.named("fly")
    with pytest.raises(FileNotFoundError):
        policy.named(str(tmp_path / "none.npz"))
    (tmp_path / "text.npz").write_text("not numbers")
    with pytest.raises(ValueError, match="is no file of a policy"):
        policy.named(str(tmp_path / "text.npz"))
    np.savez(tmp_path / "other.npz", numbers=np.zeros(3))
    with pytest.raises(ValueError, match="version 0 of a policy; wanted 1"):
        policy.named(str(tmp_path / "other.npz"))
    with pytest.raises(ValueError, match=r"first that is not there: ego\.wings"):
        mlp(batch, columns=["ego.speed", "ego.wings"]).begin(batch, 0)
