"""The example that learns to drive: its arithmetic, its files, and what it drives like."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from causeway.evaluate import read
from causeway.policy import Mlp

from running_site import PACKAGE, binary

EXAMPLES = PACKAGE / "examples"
LIMIT_SECS = 600.0
#: What a whole run has learnt: `train_driver.py --seed 1`. Other columns need another one.
LEARNT = Path(__file__).parent / "data" / "driver.npz"

sys.path.insert(0, str(EXAMPLES))

import train_driver  # noqa: E402


def run(name, *arguments):
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(PACKAGE / "src")},
        capture_output=True,
        text=True,
        timeout=LIMIT_SECS,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def train(folder, steps, *arguments):
    """With kinematic cars in one town, unless arguments say more."""
    own = ("--program", binary(), "--out", folder, "--towns", "Town01", "--physics-steps", 0)
    return run("train_driver.py", *own, "--steps", steps, *arguments)


@pytest.fixture(scope="module")
def driver(tmp_path_factory):
    """The folder of a driver who learnt for some seconds."""
    folder = tmp_path_factory.mktemp("driver")
    train(folder, 700_000, "--episodes", 20)
    return folder


def layers(seed=0):
    random = np.random.default_rng(seed)
    wide = train_driver.network(random, [5, 7, 6, 2], 0.5)
    return [(weights.astype(np.float64), bias.astype(np.float64) + 0.1) for weights, bias in wide]


def test_slopes_are_those_of_small_differences():
    own, rows = layers(), np.random.default_rng(1).normal(size=(4, 5))
    wanted = np.random.default_rng(2).normal(size=(4, 2))

    def loss():
        return float((train_driver.forward(own, rows)[-1] * wanted).sum())

    slopes = train_driver.backward(own, train_driver.forward(own, rows), wanted)
    arrays = [array for layer in own for array in layer]
    assert [slope.shape for slope in slopes] == [array.shape for array in arrays]
    for array, slope in zip(arrays, slopes, strict=True):
        for place in np.ndindex(array.shape):
            before = array[place]
            ends = []
            for step in (1e-6, -1e-6):
                array[place] = before + step
                ends.append(loss())
            array[place] = before
            assert slope[place] == pytest.approx((ends[0] - ends[1]) / 2e-6, abs=1e-6)


def test_what_is_saved_acts_as_what_has_learnt():
    own, rows = layers(), 0.3 * np.random.default_rng(1).normal(size=(9, 5)).astype(np.float32)
    policy = Mlp([(weights, bias.astype(np.float32)) for weights, bias in own], ["x"] * 5, [1.0])
    learnt = np.clip(train_driver.forward(own, rows)[-1], -1.0, 1.0)
    assert np.allclose(policy.act(rows), learnt, atol=1e-5)


def test_equal_seeds_give_equal_files_and_others_do_not(tmp_path):
    for name, seed in [("a", 1), ("b", 1), ("c", 2)]:
        train(tmp_path / name, 50_000, "--physics-steps", 15_000, "--seed", seed, "--episodes", 2)
    for file in ("policy.npz", "curve.csv", "results.json", "report.html"):
        a, b, c = ((tmp_path / name / file).read_bytes() for name in "abc")
        assert a == b and a != c, file


def test_a_driver_learns_and_drives_in_a_town_that_it_has_not_seen(driver):
    with (driver / "curve.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[-1]["steps"]) > 600_000
    # Not a number where no episode ended.
    returns = [float(row["return lane-keep Town01"]) for row in rows]
    assert np.nanmean(returns[-10:]) > np.nanmean(returns[:10])
    episodes = [one for one in read(driver / "results.json") if one.cell.tier == "kinematic"]
    assert {episode.cell.town for episode in episodes} == {"Town02"} and len(episodes) == 40
    # Each type of processor has another driver; after a full run all arrive.
    straight = [one for one in episodes if one.cell.task == "corl17-straight"]
    assert len(straight) == 20 and sum(one.success for one in straight) >= 10


def test_it_drives_over_the_official_client(start_site, tmp_path):
    site = start_site("--cars", "real")
    at = ("--host", "127.0.0.1", "--port", site.carla_port, "--policy", LEARNT)
    picture = tmp_path / "picture.jpg"
    said = run("carla/drive_policy.py", *at, *("--task", "straight", "--episodes", 2))
    ends = re.findall(r"straight [01]: ([a-z ]+) after \d+\.\d s of \d+ m\n", said)
    (arrived,) = re.findall(r"^(\d) of 2 arrived$", said, re.MULTILINE)
    assert ends == ["arrived", "arrived"] and arrived == "2", said
    said = run("carla/drive_policy.py", *at, *("--episodes", 1, "--out", picture))
    assert picture.stat().st_size > 10_000 and "1 of 1 arrived" in said
