"""How the package's commands end where something is missing, in the way, or interrupted."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from causeway.dataset import About, Recorded
from causeway.dataset import read as read_recording
from causeway.dataset import write as record
from causeway.evaluate import Cell, Episode, write

SOURCES = str(Path(__file__).parent.parent / "src")
#: A busy machine gets so long for what takes a moment.
DEADLINE_SECS = 120.0

#: As where the packages of `causeway[data]` are not installed.
WITHOUT_DATA = """
import runpy, sys
sys.modules.update(mcap=None, pyarrow=None)
runpy.run_module(sys.argv.pop(1), run_name="__main__", alter_sys=True)
"""


def run(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", WITHOUT_DATA, *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


@pytest.mark.parametrize(
    "words",
    [
        ("causeway.record_episodes", "lane-keep", "--out", "x.mcap"),
        ("causeway.dataset", "x.mcap", "--parquet", "tables"),
    ],
)
def test_commands_for_data_say_what_brings_the_packages_that_they_need(words):
    helped = run(words[0], "--help")
    assert helped.returncode == 0, helped.stderr
    refused = run(*words)
    assert refused.returncode == 2 and "Traceback" not in refused.stderr, refused.stderr
    assert "agents/python[data]" in refused.stderr, refused.stderr


@pytest.mark.parametrize("size", ["64", "0x36", "axb"])
def test_a_camera_that_is_none_is_told_what_one_is(size):
    refused = run("causeway.record_episodes", "lane-keep", "--out", "x.mcap", "--camera", size)
    assert refused.returncode == 2
    assert f"a camera is WIDTHxHEIGHT, as 256x144, not '{size}'" in refused.stderr, refused.stderr


@contextlib.contextmanager
def started(module: str, *words: object) -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-m", module, *map(str, words)],
        env={**os.environ, "PYTHONPATH": SOURCES, "PYTHONUNBUFFERED": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def refusal(module: str, *words: object) -> str:
    """What a command says that cannot do what it is to do."""
    with started(module, *words) as process:
        _, told = process.communicate(timeout=DEADLINE_SECS)
    assert process.returncode == 2 and "Traceback" not in told, told
    return told


#: Hours of driving: who is told before it starts is told in time.
LONG = ("--episodes", 4_000, "--tasks", "nocrash-empty", "--seeds", 1)
#: To nobody.
SITE = ("--base-url", "http://127.0.0.1:9")


@pytest.mark.parametrize("words", [("causeway.evaluate", *LONG), ("causeway.evaluate.dilemmas",)])
def test_where_results_cannot_be_written_nothing_is_driven(tmp_path, words):
    assert "/proc/x" in refusal(*words, "--out", "/proc/x")
    (tmp_path / "file").touch()
    assert "wanted a folder, found a file" in refusal(*words, "--out", tmp_path / "file")
    for name in ("results.json", "report.html"):
        folder = tmp_path / name.partition(".")[0]
        folder.mkdir()
        (folder / name).write_text("of an earlier run")
        told = refusal(*words, "--out", folder)
        assert f"{folder / name} is there already; give another --out or delete it" in told
        assert [path.name for path in folder.iterdir()] == [name]


def results(folder: Path, cell: Cell, seed: int) -> Path:
    """A file with one episode."""
    named = ("success", "cause", "completion", "secs", "driven_m", "return", "mean_beside_m")
    numbers = dict.fromkeys((*named, "steps", "pair"), 1.0)
    write(folder, [Episode(cell, seed, 0, "00", numbers)])
    return folder / "results.json"


@pytest.mark.parametrize(("seed", "policy"), [(2, "follow"), (1, "forward")])
def test_a_run_that_cannot_be_compared_is_not_driven(tmp_path, seed, policy):
    other = results(tmp_path / "a", Cell("nocrash-empty", "Town02", "kinematic", policy), seed)
    told = refusal("causeway.evaluate", *LONG, "--against", other)
    assert "no episode in common; wanted the same tasks" in told
    dilemma = Cell("trolley_micro_classic_3v1", "Town10HD", "physics", "none", "ClearNoon")
    other = results(tmp_path / "b", dilemma, 7)
    alone = ("causeway.evaluate.dilemmas", *SITE, "--against", other, "--seeds")
    assert "no episode in common" in refusal(*alone, 1, 2)
    assert "no OpenEnv server" in refusal(*alone, 7)


def test_a_run_that_is_interrupted_says_what_is_kept(tmp_path):
    folder = tmp_path / "results"
    with started("causeway.evaluate", *LONG, "--out", folder) as process:
        deadline = time.monotonic() + DEADLINE_SECS
        while not folder.exists():
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=DEADLINE_SECS)
    assert process.returncode == 130
    wanted = "causeway.evaluate: interrupted: nothing is written of what has been driven\n"
    assert told == wanted and list(folder.iterdir()) == []


RECORD = ("causeway.record_episodes", "corl17-straight", "--episodes", 1)


def test_a_recording_that_cannot_begin_leaves_no_file(tmp_path):
    path = tmp_path / "episodes.mcap"
    kinematic = ("--tier", "kinematic", "--out", path)
    assert "a seed is a whole number" in refusal(*RECORD, *kinematic, "--seed", -1)
    assert not path.exists()
    with started(*RECORD, *kinematic) as process:
        _, told = process.communicate(timeout=DEADLINE_SECS)
    assert process.returncode == 0, told
    before = path.read_bytes()
    told = refusal(*RECORD, *kinematic)
    assert f"{path} is there already; give another --out or delete it" in told
    assert path.read_bytes() == before
    told = refusal(*RECORD, "--out", tmp_path)
    assert f"wanted a file, found a folder at {tmp_path}" in told


def recorded(seed: int) -> Recorded:
    """An episode of one step."""
    one = np.ones(1, np.uint64)
    return Recorded(seed, one[None], one[None], one, one > 0, one > 1, one, one, {"success": 1.0})


@pytest.mark.parametrize("whole", [0, 1])
def test_a_recording_that_breaks_off_is_kept_with_its_first_episode(tmp_path, whole):
    def broken() -> Iterator[Recorded]:
        yield from map(recorded, range(whole))
        raise ValueError("cannot be drawn")

    path = tmp_path / "episodes.mcap"
    about = About({}, [], [], 0.1, "follow")
    with pytest.raises(ValueError, match="cannot be drawn"):
        list(record(path, about, broken()))
    assert path.exists() == (whole > 0)
    if whole:
        assert [one.seed for one in read_recording(path)[1]] == [0]


def test_an_empty_file_is_told_from_a_recording(tmp_path):
    path = tmp_path / "empty.mcap"
    path.touch()
    told = refusal("causeway.dataset", path, "--parquet", tmp_path / "tables")
    assert told.endswith(f"{path} is no recording of episodes: it ends before it begins\n")


@pytest.mark.parametrize("share", ["2", "-0.1", "nan"])
def test_a_share_is_one(share):
    told = refusal("causeway.evaluate", *LONG, "--fail-under", share)
    assert f"wanted a share of episodes, 0 to 1, found {share}" in told


def test_a_bus_that_is_none_is_told_in_a_line(tmp_path):
    seen = ("--camera", "64x36", "--bus", "junk", "--out", tmp_path / "episodes.mcap")
    told = refusal(*RECORD, *seen)
    assert told.count("\n") == 1 and "wanted an address like tcp/" in told, told


def test_who_learns_for_a_moment_is_told_that_no_episode_ended(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(SOURCES).parent / "examples"))
    from train_driver import percent

    assert [percent(0.254), percent(np.nan)] == ["25 %", "no episode ended"]
