"""Measures how many agent-steps a second one core of the engine makes, by observation and agents.

python examples/vector_rates.py

Kinematic cars follow their ways in episodes of 91 steps of 0.1 s that nothing else ends, so that
all agents drive all the time; resets are counted in. Rates are of processor time, which other
programs of the machine do not change as they change the clock on the wall.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable

import numpy as np

from causeway.rollout import Batch, EngineError, Floats

#: Agents of a world, and steps of an episode with the one that begins the next.
AGENTS = 64
EPISODE = 92
WHEELBASE_M = 2.85
LOCK_RAD = 0.6
#: Kept speed, in the units of the column.
SPEED = 0.4


def main() -> int:
    options = parse_arguments()
    print("observation  columns  agents  agent-steps per second of one core  others seen")
    try:
        for observation in options.observations:
            for worlds in (agents // AGENTS for agents in options.agents):
                print(measured(observation, worlds, options), flush=True)
    except (EngineError, OSError, ValueError) as error:
        print(f"vector_rates: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--observations", nargs="+", default=["wide", "route"])
    parser.add_argument("--agents", type=int, nargs="+", default=[256, 4096], help="64 or more")
    parser.add_argument("--town", default="Town01", help="default: %(default)s")
    parser.add_argument("--episodes", type=int, default=20, help="measured; fewer of many agents")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")
    return parser.parse_args()


def measured(observation: str, worlds: int, options: argparse.Namespace) -> str:
    """One line of the table."""
    with Batch(
        "lane-keep",
        town=options.town,
        tier="kinematic",
        observation=observation,
        worlds=worlds,
        agents=AGENTS,
        ends=[],
        horizon_secs=(EPISODE - 1) / 10.0,
        threads=1,
        program=options.program,
    ) as batch:
        act = driver(batch)
        episodes = max(1, options.episodes * 4 // worlds)
        observations = batch.reset()
        # Starts and lists of roads are made when they are first asked for.
        for _ in range(EPISODE * (10 + episodes)):
            observations, *_ = batch.step(act(observations))
        begun, alive = batch.engine_secs(), 0
        for _ in range(EPISODE * episodes):
            observations, *_ = batch.step(act(observations))
            alive += int(batch.alive.sum())
        rate = alive / (batch.engine_secs() - begun)
        return f"{observation:11}  {batch.width:7}  {batch.rows:6}  {rate:35,.0f}  {others(batch)}"


def driver(batch: Batch) -> Callable[[Floats], Floats]:
    """Steers for the point 15 m ahead on the way, at an even speed."""
    names = [column.name for column in batch.columns]
    x, y, speed = (names.index(name) for name in ("route.15m.x", "route.15m.y", "ego.speed"))
    scales = [batch.columns[at].scale for at in (x, y)]

    def act(observations: Floats) -> Floats:
        ahead, left = observations[:, x] / scales[0], observations[:, y] / scales[1]
        reach = np.maximum(ahead * ahead + left * left, 1.0)
        steer = 2.0 * WHEELBASE_M * left / reach / LOCK_RAD
        return np.stack([steer, SPEED - observations[:, speed]], axis=1).astype(np.float32)

    return act


def others(batch: Batch) -> str:
    """How many others a row shows, in the mean."""
    found = [block for block in batch.blocks if block.name == "partners"]
    if not found:
        return "-"
    shown = found[0].of(batch.observations)[:, :, 5] > 0.0
    return f"{shown.sum(axis=1).mean():.1f}"


if __name__ == "__main__":
    sys.exit(main())
