"""The examples over CARLA's client, as processes."""

import contextlib
import os
import re
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

from running_site import PACKAGE, two_free_ports

EXAMPLES = PACKAGE / "examples" / "carla"
LIMIT_SECS = 600.0

#: The programs, each with options for little to do.
PROGRAMS = {
    "client_example.py": ("--episodes", "1", "--frames", "2", "-q", "Low"),
    "point_cloud_example.py": ("--frames", "1"),
    "view_start_positions.py": ("--positions", "0"),
    "incident.py": (),
    "learn_to_see.py": ("--scenes", "6"),
    "manual_control.py": ("--res", "160x90", "--keys", "w*2"),
    "run_benchmark.py": ("--city-name", "Town02", "--tasks", "straight", "--agent", "basic"),
}
#: Every program that drives with others has a Traffic Manager, which wants a port of its own.
WITH_MANAGER = set(PROGRAMS) - {"view_start_positions.py", "incident.py", "learn_to_see.py"}


@dataclass
class Ran:
    status: int
    out: str
    err: str

    def numbers(self, pattern: str) -> list[tuple[float, ...]]:
        """The groups of every line that holds the pattern."""
        return [tuple(map(float, found)) for found in re.findall(pattern, self.out)]


def command(name: str, *arguments: object) -> list[str]:
    own = ["--tm-port", str(two_free_ports())] if name in WITH_MANAGER else []
    return [sys.executable, str(EXAMPLES / name), *own, *map(str, arguments)]


def environment(**added: str) -> dict[str, str]:
    return {**os.environ, "SDL_VIDEODRIVER": "dummy", "PYTHONUNBUFFERED": "1", **added}


def run(site, folder: Path, name: str, *arguments: object) -> Ran:
    """Runs an example to its end, in a folder."""
    at = ("--host", "127.0.0.1", "--port", site.carla_port)
    done = subprocess.run(
        command(name, *at, *arguments),
        cwd=folder,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=LIMIT_SECS,
    )
    return Ran(done.returncode, done.stdout, done.stderr)


@contextlib.contextmanager
def started(folder: Path, name: str, *arguments: object, **added: str):
    """An example that runs while the block does; its errors come with its output."""
    process = subprocess.Popen(
        command(name, *arguments),
        cwd=folder,
        env=environment(**added),
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    # Whoever hangs is ended, so that reading its output ends too.
    limit = threading.Timer(LIMIT_SECS, process.kill)
    limit.start()
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        limit.cancel()
