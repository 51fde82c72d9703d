"""Agent-steps of rows of 1,847 numbers, of ours and of PufferLib's `gpudrive`, in turns in one run.

    python rollouts/benches/beside_pufferlib.py --source pufferlib-3.0.0 --program causeway

`--source` is the unpacked source distribution of PufferLib 3.0.0, whose one scene (`map_942.bin`) is
loaded as often as agents need it; its C code is compiled here with PufferLib's flags, which wants a C
compiler and Python's headers. Both make the same row, 6 + 63 x 7 + 200 x 7 float32, in episodes of
91 steps of 0.1 s that nothing ends, and begin new ones within the time that is measured: PufferLib's
either as they were, or with scenes that are read again, which is its default.

What is stepped differs: PufferLib's cars drive by random actions among cars that are played back and
those that stand, ours along their ways in Town01, 64 in each world. Times are of processors; of
PufferLib all of its process, of ours those of the engine.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import statistics
import subprocess
import sys
import sysconfig
import tempfile
import time
import types
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "agents/python/examples"))
from causeway.rollout import Batch
from vector_rates import AGENTS, EPISODE, driver

ROUNDS = 5
#: Steps of all agents together in a round.
ROUND_AGENT_STEPS = 400_000
SCENE = "pufferlib/resources/gpudrive/map_942.bin"
DRIVE = "pufferlib/ocean/gpudrive"

#: One step of all agents.
Step = Callable[[], None]
Clock = Callable[[], float]


@contextlib.contextmanager
def ours(agents: int, options: argparse.Namespace) -> Iterator[tuple[Step, Clock]]:
    with Batch(
        "lane-keep",
        town="Town01",
        tier="kinematic",
        observation="wide",
        worlds=agents // AGENTS,
        agents=AGENTS,
        ends=[],
        horizon_secs=(EPISODE - 1) / 10.0,
        threads=1,
        program=options.program,
    ) as batch:
        act, observations = driver(batch), batch.reset()

        def step() -> None:
            nonlocal observations
            observations, *_ = batch.step(act(observations))

        # Starts and lists of roads are made when they are first asked for.
        for _ in range(20 * EPISODE):
            step()
        yield step, batch.engine_secs


@contextlib.contextmanager
def theirs(
    agents: int, options: argparse.Namespace, again: bool
) -> Iterator[tuple[Step, Clock]]:
    """With scenes that are read `again` after each episode, or not."""
    with tempfile.TemporaryDirectory() as folder:
        scenes = Path(folder, "resources/gpudrive/binaries")
        scenes.mkdir(parents=True)
        shutil.copy(options.source / SCENE, scenes / "map_000.bin")
        drive = module_of(options.source, Path(folder))
        before = Path.cwd()
        os.chdir(folder)
        try:
            env = drive.GPUDrive(
                num_agents=agents, num_maps=1, resample_frequency=91 * again
            )
            env.reset(1)
            dice = np.random.default_rng(1)
            actions = dice.integers((0, 0), (7, 13), (64, agents, 2), dtype=np.int32)
            number = 0

            def step() -> None:
                nonlocal number
                env.step(actions[number % len(actions)])
                number += 1

            yield step, time.process_time
            env.close()
        finally:
            os.chdir(before)


def module_of(source: Path, folder: Path) -> types.ModuleType:
    """PufferLib's environment with its C code, without the rest of PufferLib."""
    import importlib.util

    name = "pufferlib.ocean.gpudrive"
    if name + ".gpudrive" in sys.modules:
        return sys.modules[name + ".gpudrive"]
    library = folder / f"binding{sysconfig.get_config_var('EXT_SUFFIX')}"
    raylib = source / "raylib-5.5_linux_amd64"
    subprocess.run(
        [
            *("cc", "-shared", "-fPIC", "-O2", "-flto", "-fwrapv", "-w"),
            *("-DPLATFORM_DESKTOP", "-DNPY_NO_DEPRECATED_API=NPY_1_7_API_VERSION"),
            *(f"-I{place}" for place in (np.get_include(), raylib / "include")),
            f"-I{sysconfig.get_paths()['include']}",
            *(source / DRIVE / "binding.c", raylib / "lib/libraylib.a"),
            *("-lm", "-lpthread", "-ldl", "-o", library),
        ],
        check=True,
    )
    for parent in ("pufferlib", "pufferlib.ocean", name):
        sys.modules[parent] = types.ModuleType(parent)
        sys.modules[parent].__path__ = []
    sys.modules["pufferlib"].PufferEnv = Buffers
    for module, path in (
        ("binding", library),
        ("gpudrive", source / DRIVE / "gpudrive.py"),
    ):
        spec = importlib.util.spec_from_file_location(f"{name}.{module}", path)
        loaded = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
        setattr(sys.modules[name], module, loaded)
        spec.loader.exec_module(loaded)
    return sys.modules[name + ".gpudrive"]


class Buffers:
    """What an environment of PufferLib is given to write into."""

    def __init__(self, buf: None = None) -> None:
        del buf
        size = self.num_agents
        self.observations = np.zeros(
            (size, *self.single_observation_space.shape), np.float32
        )
        self.actions = np.zeros((size, 2), np.int32)
        self.rewards = np.zeros(size, np.float32)
        self.terminals, self.truncations = np.zeros(size, bool), np.zeros(size, bool)


def rate(step: Step, clock: Clock, agents: int) -> float:
    """Agent-steps a second of processor time."""
    episodes = max(1, ROUND_AGENT_STEPS // (agents * EPISODE))
    begun = clock()
    for _ in range(EPISODE * episodes):
        step()
    return agents * EPISODE * episodes / (clock() - begun)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--agents",
        type=int,
        nargs="+",
        default=[256, 4096],
        help="each a multiple of 64",
    )
    parser.add_argument(
        "--source", type=lambda text: Path(text).resolve(), required=True
    )
    parser.add_argument(
        "--program", default="causeway", help="the engine (%(default)s)"
    )
    options = parser.parse_args()
    if not (options.source / SCENE).exists():
        parser.error(
            f"{options.source} is no unpacked source of PufferLib 3.0.0: no {SCENE} there"
        )
    print(
        "| agents | ours | PufferLib | ratio | PufferLib, scenes read again | ratio |"
    )
    print("|---|---|---|---|---|---|")
    for agents in options.agents:
        with (
            ours(agents, options) as mine,
            theirs(agents, options, again=False) as same,
            theirs(agents, options, again=True) as anew,
        ):
            rounds = [
                [rate(*one, agents) for one in (mine, same, anew)]
                for _ in range(ROUNDS)
            ]
        own, *others = (statistics.median(rates) for rates in zip(*rounds, strict=True))
        cells = "".join(f" {other:,.0f} | {own / other:.1f} |" for other in others)
        print(f"| {agents} | {own:,.0f} |{cells}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
