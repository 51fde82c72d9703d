"""The example that drives a benchmark over CARLA's client."""

import re
import signal
from pathlib import Path

from carla_example import run, started

BENCHMARK = ("-c", "Town02", "--tasks", "straight,one-turn", "--poses", 2, "--agent", "basic")


def results(folder: Path) -> dict[str, str]:
    (log,) = (folder / "_benchmarks_results").iterdir()
    assert log.name == "test_Basic_Town02"
    return {path.name: path.read_text() for path in log.iterdir()}


def test_the_benchmark_goes_on_where_it_was_interrupted(site, client, tmp_path):
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    whole.mkdir()
    parts.mkdir()
    ran = run(site, whole, "run_benchmark.py", *BENCHMARK)
    assert ran.status == 0, ran.err
    assert ran.out.count(": arrived after") == 4
    assert re.search(r"one-turn +1 +100% ", ran.out)

    with started(parts, "run_benchmark.py", "--port", site.carla_port, *BENCHMARK) as process:
        for line in process.stdout:
            if ": arrived after" in line:
                break
        process.send_signal(signal.SIGINT)
        said, _ = process.communicate()
        # It may be over before the signal comes, on a machine that holds this test up.
        assert process.returncode in (130, 0), said
    assert results(parts)["summary.csv"].count("straight") >= 1
    again = run(site, parts, "run_benchmark.py", *BENCHMARK)
    assert again.status == 1 and "--continue-experiment" in again.err
    last = run(site, parts, "run_benchmark.py", *BENCHMARK, "--continue-experiment")
    assert last.status == 0, last.err
    assert last.out.count(": arrived after") < 4
    assert results(parts) == results(whole)
    assert set(results(whole)) == {"summary.csv", "measurements.csv", "metrics.json"}


def test_an_agent_that_goes_straight_on_takes_no_turn(site, client, tmp_path):
    options = ("-c", "Town02", "--tasks", "one-turn")
    ran = run(site, tmp_path, "run_benchmark.py", *options)
    assert ran.status == 0, ran.err
    assert "m from the goal after" in ran.out
    assert re.search(r"one-turn +1 +0% ", ran.out)


def test_a_task_that_is_not_there_is_named(site, tmp_path):
    ran = run(site, tmp_path, "run_benchmark.py", "--tasks", "straight,backwards")
    assert ran.status == 1 and "'backwards'" in ran.err and "Traceback" not in ran.err
