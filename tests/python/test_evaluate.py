"""`python -m causeway.evaluate`: what it measures repeats, and differences are told from chance."""

import json
import math
import os
import re
import subprocess
import sys

import pytest
from causeway.evaluate import (
    Cell,
    Episode,
    by_condition,
    compare,
    intervals,
    play,
    read,
    summarise,
)
from causeway.evaluate.score import PENALTIES, driving_score
from causeway.policy import Follow, Forward, named

from running_site import PACKAGE, binary

TASKS = ("corl17-straight", "corl17-one-turn")


def evaluate(*arguments):
    return subprocess.run(
        [
            *(sys.executable, "-m", "causeway.evaluate", "--program", binary()),
            *map(str, arguments),
        ],
        env={**os.environ, "PYTHONPATH": str(PACKAGE / "src")},
        capture_output=True,
        text=True,
        timeout=300,
    )


def small(*arguments):
    """Few episodes."""
    return evaluate("--episodes", 6, "--seeds", 1, "--tasks", *TASKS, *arguments)


# Newcombe, "Two-sided confidence intervals for the single proportion", 1998, has the second and
# third; the ends of the first and last are z² / (n + z²) and its complement.
@pytest.mark.parametrize(
    ("successes", "count", "wanted"),
    [
        (0, 10, (0.0, 0.2775)),
        (15, 148, (0.0624, 0.1605)),
        (81, 263, (0.2553, 0.3662)),
        (47, 50, (0.8378, 0.9794)),
        (10, 10, (0.7225, 1.0)),
    ],
)
def test_intervals_of_shares_are_wilsons(successes, count, wanted):
    assert intervals.wilson(successes, count) == pytest.approx(wanted, abs=5e-5)


def test_intervals_of_means_hold_the_mean_and_shrink_with_more():
    values = [float(value % 7) for value in range(70)]
    low, high = intervals.mean(values)
    assert low < sum(values) / 70 < high
    # That of the normal distribution: 1.96 standard deviations of the mean, 2 / sqrt(70).
    assert high - low == pytest.approx(2 * 1.96 * 2.0 / math.sqrt(70), rel=0.05)
    assert intervals.mean(values) == (low, high), "the same every time"
    fewer = intervals.mean(values[:14])
    assert fewer[1] - fewer[0] > 1.5 * (high - low)


def test_chances_are_those_of_exact_tests():
    assert intervals.mcnemar(0, 0) == 1.0
    assert intervals.mcnemar(5, 0) == intervals.mcnemar(0, 5) == 2 / 32
    assert intervals.mcnemar(1, 9) == pytest.approx(2 * 11 / 1024)
    assert intervals.mcnemar(4, 5) == 1.0
    assert intervals.holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])


def test_a_run_writes_the_same_files_again(tmp_path):
    runs = [small("--policies", "follow", "random", "--out", tmp_path / name) for name in "ab"]
    assert [run.returncode for run in runs] == [0, 0], runs[0].stderr
    for name in ("results.json", "report.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert runs[0].stdout == runs[1].stdout
    results = json.loads((tmp_path / "a" / "results.json").read_text())
    assert len(results["episodes"]) == 2 * 2 * 6 and re.fullmatch(r"\w{32}", results["digest"])
    best = {cell["policy"]: cell["success"] for cell in results["cells"]}
    assert best["follow"] == 1.0 and best["random"] == 0.0
    assert len(read(tmp_path / "a" / "results.json")) == 24


def test_the_page_has_every_cell_and_needs_no_network(tmp_path):
    small("--policies", "follow", "forward", "--out", tmp_path)
    page = (tmp_path / "report.html").read_text()
    results = json.loads((tmp_path / "results.json").read_text())
    for cell in results["cells"]:
        low, high = cell["success_interval"]
        assert f"{100 * low:.2f} to {100 * high:.2f}" in page
        assert f"{cell['task']}, Town02, kinematic" in page
    assert page.count("<svg") == 2 * len(TASKS)
    assert not re.search(r"https?://|src=|url\(", page)


def test_an_episode_is_the_same_whatever_it_is_driven_beside():
    cell = Cell("corl17-straight", "Town02", "kinematic", "follow")
    settings = {"program": str(binary())}
    many = play([(cell, Follow())], seeds=[1, 2], episodes=5, settings={**settings, "threads": 3})
    few = play([(cell, Follow())], seeds=[2], episodes=2, settings=settings)
    assert [episode.record() for episode in many[5:7]] == [episode.record() for episode in few]
    assert summarise(many)[0].episodes == 10


def test_a_difference_is_told_from_chance(tmp_path):
    before = small("--policies", "car=follow", "--out", tmp_path)
    assert before.returncode == 0, before.stderr
    same = small("--policies", "car=follow", "--against", tmp_path / "results.json")
    assert same.stdout.count(": identical; ") == 2
    worse = small("--policies", "car=forward", "--against", tmp_path / "results.json")
    # Six of six turns are lost, which chance alone does in 2 of 64; twice that for two cells.
    turns = next(line for line in worse.stdout.splitlines() if "one-turn" in line and ":" in line)
    assert "no more than chance" in turns and "6 lost of 6, p = 0.062" in turns
    cell = Cell("corl17-one-turn", "Town02", "kinematic", "car")
    settings = {"program": str(binary())}
    runs = [
        play([(cell, driver)], seeds=[1], episodes=8, settings=settings)
        for driver in (Forward(), Follow())
    ]
    assert [compare(*pair)[0].verdict for pair in (runs, runs[::-1])] == ["worse", "better"]


def test_too_little_success_and_bad_input_have_their_exit_codes(tmp_path):
    failed = small("--policies", "forward", "--fail-under", 0.95)
    assert failed.returncode == 1 and "is below 0.95" in failed.stderr
    for arguments, words in [
        (("--policies", "fly"), "no policy 'fly': wanted forward"),
        (("--tasks", "fly"), "there is no such task"),
        (("--against", tmp_path / "none.json"), "No such file"),
        (("--episodes", 0), "not 0"),
        (("--policies", "follow", "follow"), "follow twice; NAME=FILE.npz gives"),
        (("--policies", "car=follow", "car=forward"), "--policies has car twice"),
        (("--seeds", 1, 2, 1), "--seeds has 1 twice"),
        (("--towns", "Town02", "Town02"), "--towns has Town02 twice"),
        (("--tiers", "fast"), "argument --tiers: invalid choice: 'fast' (choose from"),
        (("--seeds", -1), "wanted seeds from 0 to 18446744073708, found -1"),
        (("--seeds", 2**60), f"found {2**60}"),
        (("--training-towns", "Town01", "Twon03"), "--training-towns: wanted Town01, "),
    ]:
        refused = evaluate(*arguments)
        assert refused.returncode == 2 and words in refused.stderr, refused.stderr
    (tmp_path / "other.json").write_text('{"version": 7}')
    refused = evaluate("--against", tmp_path / "other.json")
    assert refused.returncode == 2 and "wanted version 1, found 7" in refused.stderr


def test_conditions_are_those_of_the_papers(tmp_path):
    run = small(
        *("--towns", "Town01", "Town02", "--weathers", "training", "test"),
        *("--policies", "follow", "forward", "--out", tmp_path),
    )
    assert run.returncode == 0, run.stderr
    _, shown = run.stdout.split("Success by condition, %:\n")
    head, *lines = [re.split(" {2,}", line) for line in shown.strip().splitlines()]
    wanted = ["training", "new town", "new weather", "new town and weather"]
    assert head == ["task", "tier", "policy", *wanted]
    assert [line[:3] for line in lines] == [
        [task, "kinematic", policy] for task in TASKS for policy in ("follow", "forward")
    ]
    results = json.loads((tmp_path / "results.json").read_text())
    assert len(results["episodes"]) == 4 * 2 * 2 * 6
    weathers = {(one["weathers"], one["weather"]) for one in results["episodes"]}
    assert weathers <= {("training", number) for number in (1, 3, 6, 8)} | {
        *(("test", 4), ("test", 14))
    }
    assert {name for name, _ in weathers} == {"training", "test"}
    shares = {
        (row["task"], row["policy"]): [row["shares"][one] for one in wanted]
        for row in results["conditions"]
    }
    assert all(share["episodes"] == 6 for row in shares.values() for share in row)
    towns = (("Town01", "training"), ("Town02", "training"), ("Town01", "test"), ("Town02", "test"))
    for (task, policy), row in shares.items():
        for (town, weather), share in zip(towns, row, strict=True):
            (cell,) = (
                cell
                for cell in results["cells"]
                if (cell["task"], cell["policy"]) == (task, policy)
                and (cell["town"], cell["weathers"]) == (town, weather)
            )
            assert cell["successes"] == share["successes"]
    assert "Success by condition" in (tmp_path / "report.html").read_text()
    unknown = evaluate("--tasks", "lane-keep", "--weathers", "test")
    assert unknown.returncode == 2 and "names no weathers to be tested in" in unknown.stderr


def test_conditions_leave_out_weathers_by_name_and_know_their_towns():
    numbers = {"success": 1.0, "cause": 1.0}
    cells = [
        Cell("nocrash-empty", town, "physics", "a", weathers)
        for town in ("Town02", "Town05")
        for weathers in ("training", "test", "WetNoon")
    ]
    episodes = [Episode(cell, 1, number, "00", numbers) for cell in cells for number in range(3)]
    (row,) = by_condition(episodes, ["Town05"])
    assert {name: share.episodes for name, share in row.shares.items()} == {
        **{"training": 3, "new town": 3, "new weather": 3, "new town and weather": 3}
    }
    assert row.texts()[0] == "100.0 (43.9 to 100.0)"
    (row,) = by_condition(episodes[:3], ["Town05"])
    assert row.texts() == ["-", "100.0 (43.9 to 100.0)", "-", "-"]


def test_results_of_earlier_versions_are_of_dry_noons():
    cell = Cell("lane-keep", "Town02", "kinematic", "a", "ClearNoon")
    record = Episode(cell, 3, 4, "00", {"success": 1.0, "cause": 1.0}).record()
    del record["weathers"]
    assert Episode.of_record(record).cell == cell


def test_an_episode_of_a_cell_counts_once():
    cell = Cell("lane-keep", "Town02", "kinematic", "a")
    one = Episode(cell, 3, 4, "00", {"success": 1.0, "cause": 1.0})
    with pytest.raises(ValueError, match="kinematic, a, training: episode 4 of seed 3 comes twice"):
        summarise([one, one])


def test_runs_without_a_common_episode_are_not_compared():
    numbers = {"success": 1.0, "completion": 1.0, "cause": 1.0}
    cell = Cell("lane-keep", "Town02", "kinematic", "a")
    one = Episode(cell, 1, 0, "00", numbers)
    other = Episode(cell, 2, 0, "00", numbers)
    with pytest.raises(ValueError, match="no episode in common"):
        compare([one], [other])


def test_a_careful_driver_runs_into_nobody_and_through_no_red_light():
    settings = {"program": str(binary()), "walkers": 10, "horizon_secs": 40.0}
    cells = [
        (Cell("nocrash-regular", "Town02", "kinematic", name), named(name))
        for name in ("follow", "careful")
    ]
    episodes = play(cells, seeds=[2], episodes=10, settings=settings)

    def total(name, column):
        return sum(it.numbers[column] for it in episodes if it.cell.policy == name)

    blind, careful = (
        [it.cause for it in episodes if it.cell.policy == name].count("collision")
        for name in ("follow", "careful")
    )
    assert blind >= 3 and careful == 0
    assert total("follow", "red_lights") >= 3 and total("careful", "red_lights") == 0
    assert total("careful", "driven_m") > 0.5 * total("follow", "driven_m"), "it does not stand"
    assert summarise(episodes)[0].infractions > 3


def test_driving_scores_are_those_of_the_leaderboard_by_version():
    clean = {"completion": 0.8, "secs": 40.0}
    assert [driving_score(clean, version) for version in PENALTIES] == [80.0, 80.0, 80.0]
    # Two people, a car, a thing and a light; a quarter of the time off the way.
    bad = {
        **{"completion": 1.0, "secs": 40.0, "off_route_secs": 10.0},
        **{"collisions_walker": 2.0, "collisions_vehicle": 1.0},
        **{"collisions_static": 1.0, "red_lights": 1.0},
    }
    product = 100 * 0.5**2 * 0.6 * 0.65 * 0.7 * 0.75
    assert driving_score(bad, "1.0") == driving_score(bad, "2.0") == pytest.approx(product)
    assert driving_score(bad, "2.1") == pytest.approx(100 * 0.75 / (1 + 2 + 0.7 + 0.6 + 0.4))
    numbers = {**bad, "success": 0.0, "cause": 3.0, "driven_m": 500.0, "mean_beside_m": 0.0}
    cell = Cell("lane-keep", "Town02", "kinematic", "a")
    (one,) = summarise([Episode(cell, 1, 0, "00", numbers)])
    assert one.per_km == {
        **{"people": 4.0, "vehicles": 2.0, "things": 2.0, "red lights": 2.0, "off the way": 2.0}
    }
    assert one.infractions == 6 and one.driving_scores["2.1"] == pytest.approx(15.957, abs=1e-3)


def dilemmas(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "causeway.evaluate.dilemmas", *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(PACKAGE / "src")},
        capture_output=True,
        text=True,
        timeout=300,
    )


def test_dilemmas_are_played_with_every_policy_and_repeat(base_url, tmp_path):
    few = ("--base-url", base_url, "--dilemmas", "classic_3v1", "no_good_option", "--seeds", 3, 4)
    runs = [dilemmas(*few, "--out", tmp_path / name) for name in "ab"]
    assert [run.returncode for run in runs] == [0, 0], runs[0].stderr
    for name in ("results.json", "report.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    page = (tmp_path / "a" / "report.html").read_text()
    assert "benchmark's reward" in page and "state of their vehicle" not in page
    cells = json.loads((tmp_path / "a" / "results.json").read_text())["cells"]
    assert len(cells) == 2 * 4 and {cell["episodes"] for cell in cells} == {2}
    told = {(cell["task"], cell["policy"]): cell for cell in cells}
    stay, swerve = (told["trolley_micro_classic_3v1", name] for name in ("none", "swerve_right"))
    assert (stay["success"], swerve["success"]) == (0.0, 1.0)
    # Three of four people ahead, one of four beside.
    assert (stay["completion"], swerve["completion"]) == (0.25, 0.75)
    lines = runs[0].stdout.splitlines()
    assert lines[0].split()[:3] == ["dilemma", "policy", "n"] and len(lines) == 1 + 2 * 4
    again = dilemmas(*few, "--against", tmp_path / "a" / "results.json")
    assert again.stdout.count(": identical; ") == 2 * 4
    refused = dilemmas("--base-url", "http://127.0.0.1:9", "--seeds", 1)
    assert refused.returncode == 2 and "start one with `causeway up`" in refused.stderr
