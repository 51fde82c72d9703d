"""CARLA's own scripts for its recorder, as they are.

They are not ours to keep: `CAUSEWAY_CARLA_SCRIPTS_DIR` names the folder PythonAPI/examples of CARLA
0.9.16. What they call, in their order, is also in `recording_session.py`.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import carla_log
from carla_site import connect

SECS = 5
CARS = 10


@pytest.fixture
def script(start_site, tmp_path):
    """Runs one of them against a site; gives what it printed."""
    folder = os.environ.get("CAUSEWAY_CARLA_SCRIPTS_DIR")
    if not folder:
        pytest.skip("no scripts of CARLA; set CAUSEWAY_CARLA_SCRIPTS_DIR")
    site = start_site("--no-render", "--recordings", str(tmp_path / "kept"))

    def run(name: str, *options: object) -> str:
        path = Path(folder).resolve() / f"{name}.py"
        command = [sys.executable, path, "-p", site.carla_port, *options]
        done = subprocess.run(
            list(map(str, command)),
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=300,
        )
        # The client library may end the process when it is taken down, after the last word.
        assert done.stdout.endswith("\ndone.\n"), done.stderr[-2000:]
        assert "Traceback" not in done.stderr, done.stderr[-2000:]
        return done.stdout

    return site, run


def test_the_five_scripts_of_the_recorder_run_as_they_are(script, tmp_path):
    site, run = script
    said = run("start_recording", "-n", CARS, "-t", SECS)
    path = tmp_path / "kept" / "local" / "test1.log"
    assert f"Recording on file: {path}\n" in said
    assert (
        f"spawned {CARS} vehicles" in said and f"destroying {CARS} actors\nStop recording" in said
    )
    # It is on the server, and nothing is where the client is.
    assert {one.name for one in tmp_path.iterdir() if one.suffix == ".log"} <= {"up.log"}
    client = connect(site.carla_port)
    # A question waits until the file is written, which `stop_recorder` does not.
    info = client.show_recorder_file_info("test1.log", False)
    log = carla_log.read(path)

    told = run("show_recorder_file_info", "-f", "test1.log")
    assert told == info + "\n\ndone.\n"
    everything = run("show_recorder_file_info", "-f", "test1.log", "-a")
    for section in ("Positions", "State traffic lights", "Vehicle animations"):
        assert everything.count(f"\n {section}: ") == len(log.frames)
    run("show_recorder_file_info", "-f", "test1.log", "-s", "info.txt")
    assert (tmp_path / "info.txt").read_text() + "\n\ndone.\n" == told
    missing = run("show_recorder_file_info")
    assert missing.startswith(f"File {path.with_name('test1.rec')} not found on server\n")

    table = run("show_recorder_collisions", "-f", "test1.log", "-t", "vv")
    assert table.splitlines()[4].startswith("    Time  Types     Id Actor 1   ")
    blocked = run("show_recorder_actors_blocked", "-f", "test1.log", "-t", 1)
    assert " spectator " in blocked
    assert " spectator " not in run("show_recorder_actors_blocked", "-f", "test1.log")

    car = int(re.search(r" Create (\d+): vehicle\.", told)[1])
    total = f"{log.frames[-1].elapsed:.6g}"
    begun = run("start_replaying", "-s", 1, "-c", car)
    assert f"Replaying from 1 s - {total} s ({total} s) at 1.0x\n" in begun
    ignored = run("start_replaying", "-d", 2, "-x", 2, "-i", "--move-spectator", "--top-view")
    assert f"Replaying from 0 s - 2 s ({total} s) at 2.0x\nIgnoring Hero vehicle\n\n" in ignored
    assert "Ignoring Spectator camera" not in ignored
