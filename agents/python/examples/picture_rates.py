"""Measures how many pictures a second a running site delivers to a trainer's loop.

python examples/picture_rates.py --bus tcp/127.0.0.1:7460

Each round steps 256 worlds of a batch and has a picture of each drawn by the site, as a trainer
does. The last round's jobs are then drawn by `causeway bench pictures --jobs` in a process of its
own, so that what the way to the renderer and back costs is a ratio within one run.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from causeway.bus import DEFAULT_ENDPOINT
from causeway.pictures import Camera, Renderer, RendererError, jobs
from causeway.rollout import Batch, EngineError, WorldFrame


def main() -> int:
    options = parse_arguments()
    try:
        frames = drive(options)
        return 0 if options.no_bench else bench(frames, options)
    except (ConnectionError, EngineError, OSError, RendererError, ValueError) as error:
        print(f"picture_rates: {error}", file=sys.stderr)
        return 1


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--bus", default=DEFAULT_ENDPOINT, help="of the site (%(default)s)")
    parser.add_argument("--worlds", type=int, default=256, help="default: %(default)s")
    parser.add_argument("--camera", type=Camera.parse, default="84x84", help="default: %(default)s")
    parser.add_argument("--town", default="Town02", help="default: %(default)s")
    parser.add_argument("--task", default="lane-keep", help="default: %(default)s")
    parser.add_argument("--rounds", type=int, default=10, help="default: %(default)s")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")
    parser.add_argument("--no-bench", action="store_true", help="leave the comparison out")
    return parser.parse_args()


def drive(options: argparse.Namespace) -> list[WorldFrame]:
    """Prints what rounds of a trainer's loop take; the frames of the last one."""
    own = {"town": options.town, "worlds": options.worlds, "program": options.program}
    with Batch(options.task, **own) as batch, Renderer(options.bus) as renderer:
        batch.reset()
        actions = np.zeros((batch.rows, 2), np.float32)
        actions[:, 1] = 0.5
        print("pictures  a second of drawing  of the loop  of it: stepping, frames, pictures")
        ways: dict[str, Callable[[list[WorldFrame]], object]] = {
            "raw": lambda frames: renderer.pixels(frames, options.camera),
            "JPEG": lambda frames: renderer.draw(frames, options.camera),
        }
        for name, draw in ways.items():
            draw(batch.frames(range(options.worlds)))
            spent = np.zeros(3)
            for _ in range(options.rounds):
                moments = [time.perf_counter()]
                batch.step(actions)
                moments.append(time.perf_counter())
                frames = batch.frames(range(options.worlds))
                moments.append(time.perf_counter())
                draw(frames)
                moments.append(time.perf_counter())
                spent += np.diff(moments)
            drawn = options.worlds * options.rounds
            shares = ", ".join(f"{part:.0%}" for part in spent / spent.sum())
            rates = f"{drawn / spent[2]:19,.0f}  {drawn / spent.sum():11,.0f}"
            print(f"{name:8}  {rates}  {shares:>34}", flush=True)
    return frames


def bench(frames: list[WorldFrame], options: argparse.Namespace) -> int:
    """Has the same pictures drawn inside one process."""
    with tempfile.TemporaryDirectory() as folder:
        for raw, name in ((True, "raw"), (False, "jpeg")):
            (Path(folder) / name).mkdir()
            for at, job in enumerate(jobs(frames, options.camera, raw=raw)):
                (Path(folder) / name / f"{at:05}.job").write_bytes(job)
            command = [options.program, "bench", "pictures", "--jobs", f"{folder}/{name}"]
            done = subprocess.run(command, check=False)
            if done.returncode != 0:
                return done.returncode
    return 0


if __name__ == "__main__":
    sys.exit(main())
