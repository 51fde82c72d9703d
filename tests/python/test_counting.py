"""`./test` counts what ran, and lets nothing be skipped that the machine could run."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

COUNTER = Path(__file__).parents[2] / "scripts" / "count_checks.py"

NO_MAPS = '<system-out>running 1 test\nskipped: no maps in "/maps"\ntest ok</system-out>'


def count(tmp_path, *cases: str, **environment: str):
    report = tmp_path / "report.xml"
    tests = "".join(
        f'<testcase classname="suite" name="t{i}">{c}</testcase>' for i, c in enumerate(cases)
    )
    report.write_text(f"<testsuites><testsuite>{tests}</testsuite></testsuites>")
    inherited = {name: value for name, value in os.environ.items() if name != "CAUSEWAY_MAPS_DIR"}
    result = subprocess.run(
        [sys.executable, COUNTER, report],
        env={**inherited, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return tuple(map(int, result.stdout.split())), result.stderr


@pytest.mark.parametrize(
    ("case", "wanted"),
    [
        ("", (1, 0, 0)),
        ("<system-out>nothing was skipped: all is well</system-out>", (1, 0, 0)),
        ('<failure type="panic">wrong</failure>', (0, 1, 0)),
        ('<error message="failed on setup"/>', (0, 1, 0)),
        # One that failed after it said so has failed.
        (f"<failure/>{NO_MAPS}", (0, 1, 0)),
        (NO_MAPS, (0, 0, 1)),
    ],
)
def test_a_check_is_counted_once(tmp_path, case, wanted):
    assert count(tmp_path, case)[0] == wanted
    assert count(tmp_path, case, "", "")[0] == (wanted[0] + 2, wanted[1], wanted[2])


def test_what_this_machine_could_run_must_not_be_skipped(tmp_path):
    counted, said = count(tmp_path, NO_MAPS, CAUSEWAY_MAPS_DIR="/maps")
    assert counted == (0, 1, 0)
    assert 'could run it: suite::t0: no maps in "/maps"' in said


def test_a_reason_that_nobody_knows_is_no_excuse(tmp_path):
    skipped = '<skipped type="pytest.skip" message="it is late">file.py:3</skipped>'
    counted, said = count(tmp_path, skipped)
    assert counted == (0, 1, 0)
    assert "suite::t0: it is late" in said


def named(names: dict[str, str]) -> str:
    tests = "".join(
        f'<testcase classname="suite" name="{n}">{c}</testcase>' for n, c in names.items()
    )
    return f"<testsuites><testsuite>{tests}</testsuite></testsuites>"


def count_twice(tmp_path, first: dict[str, str], again: dict[str, str]):
    reports = [tmp_path / "report.xml", tmp_path / "again.xml"]
    for path, names in zip(reports, (first, again), strict=True):
        path.write_text(named(names))
    result = subprocess.run(
        [sys.executable, COUNTER, *reports], capture_output=True, text=True, check=True
    )
    return tuple(map(int, result.stdout.split())), result.stderr


def test_what_passes_when_it_is_run_again_is_named(tmp_path):
    first = {"a": "", "b": "<failure/>", "c": "<failure/>"}
    counted, said = count_twice(tmp_path, first, {"b": "", "c": "<failure/>"})
    assert counted == (2, 1, 0)
    assert "flaky, passed when it was run again: suite::b\n" in said


def test_more_than_two_flaky_tests_are_failures(tmp_path):
    first = dict.fromkeys("abc", "<failure/>")
    assert count_twice(tmp_path, first, dict.fromkeys("abc", ""))[0] == (0, 3, 0)
    assert count_twice(tmp_path, first, dict.fromkeys("ab", ""))[0] == (2, 1, 0)
    # As nextest says it.
    flaky = '<flakyFailure type="panic">wrong</flakyFailure>'
    assert count(tmp_path, flaky, flaky)[0] == (2, 0, 0)
    assert count(tmp_path, flaky, flaky, flaky)[0] == (0, 3, 0)
