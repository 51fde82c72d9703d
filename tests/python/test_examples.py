"""The examples do what their documentation says, as a user runs them."""

import os
import subprocess
import sys
import threading
from contextlib import contextmanager

import causeway
import pytest
from PIL import Image

from running_site import PACKAGE, binary

EXAMPLES = PACKAGE / "examples"


def run(name, *arguments, cwd=EXAMPLES):
    """Runs a file in the folder of the examples, or `-c` and a program."""
    return subprocess.run(
        [sys.executable, name, *map(str, arguments)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(PACKAGE / "src")},
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.mark.parametrize("name", sorted(path.name for path in EXAMPLES.glob("*.py")))
def test_every_example_has_help(name):
    result = run(name, "--help")
    assert result.returncode == 0
    assert "usage:" in result.stdout


@pytest.mark.parametrize(
    ("policy", "reward", "hit"), [("observe", -1.0, 3), ("brake", -1.0, 0), ("swerve", 1.0, 0)]
)
def test_play_trolley_tells_the_outcome_and_saves_two_pictures(
    base_url, tmp_path, policy, reward, hit
):
    result = run(
        "play_trolley.py",
        "--base-url",
        base_url,
        "--policy",
        policy,
        "--seed",
        1,
        "--out",
        tmp_path,
    )
    assert result.returncode == 0, result.stderr
    assert f"reward {reward}" in result.stdout
    assert f"pedestrians hit: {hit}" in result.stdout
    for name in ("before.jpg", "after.jpg"):
        with Image.open(tmp_path / name) as picture:
            assert (picture.format, picture.size) == ("JPEG", (640, 360))
    before, after = ((tmp_path / name).read_bytes() for name in ("before.jpg", "after.jpg"))
    assert before != after


def test_play_trolley_takes_another_scenario(base_url, tmp_path):
    result = run(
        "play_trolley.py", "--base-url", base_url, "--scenario", "bias_2v0", "--out", tmp_path
    )
    assert result.returncode == 0, result.stderr
    assert "2 pedestrians in your lane" in result.stdout


def test_play_trolley_without_a_server_says_what_to_do(tmp_path):
    result = run("play_trolley.py", "--base-url", "http://127.0.0.1:1", "--out", tmp_path)
    assert result.returncode == 1
    assert "causeway up" in result.stderr
    assert "Traceback" not in result.stderr


@contextmanager
def driving(base_url):
    """A world that is driven as long as the block lasts."""
    with causeway.Session(base_url) as session:
        session.reset("trolley_saves", seed=1)
        stop = threading.Event()

        def drive():
            while not stop.is_set():
                session.step("maintain_speed", target_speed_kmh=36.0)
                stop.wait(0.02)

        driver = threading.Thread(target=drive)
        driver.start()
        try:
            yield
        finally:
            stop.set()
            driver.join()


def test_watch_frames_prints_the_speeds_of_a_running_world(site):
    with driving(site.base_url):
        result = run(
            "watch_frames.py", "--endpoint", site.endpoint, "--count", 5, "--timeout-secs", 60
        )
    assert result.returncode == 0, result.stderr
    lines = [line for line in result.stdout.splitlines() if line.startswith("world ")]
    assert len(lines) == 5
    assert "vehicles at" in lines[0]


def test_rates_are_told_by_observation_and_agents():
    arguments = ("--agents", 64, "--observations", "route", "--episodes", 1)
    result = run("vector_rates.py", *arguments, "--program", binary())
    assert result.returncode == 0, result.stderr
    told = result.stdout.splitlines()[1].split()
    assert told[:3] == ["route", "46", "64"] and float(told[3].replace(",", "")) > 0.0
