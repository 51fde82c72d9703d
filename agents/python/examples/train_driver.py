"""Trains a driver from nothing, and says how it drives in a town that it has never seen.

python examples/train_driver.py --out driver

It learns with PPO (Schulman and others, "Proximal Policy Optimization Algorithms", 2017), in numpy
alone: first with kinematic cars, then for a while with rigid bodies. The folder gets `policy.npz`,
`curve.csv`, and `results.json` and `report.html` of the evaluation. Equal options and seeds give
equal files on one machine.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from causeway.evaluate import Cell, play, summarise, table, write
from causeway.policy import Mlp
from causeway.rollout import Batch, EngineError

Floats = NDArray[np.float32]
Layers = list[tuple[Floats, Floats]]

#: What it learns in each town, and what it is evaluated in.
LEARNT = ("corl17-straight", "corl17-one-turn", "lane-keep")
EVALUATED = ("corl17-straight", "corl17-one-turn")
#: What figures in `docs/benchmarks.md` are of.
WEATHERS = "ClearNoon"
REWARD = {
    "progress": 0.05,
    "arrived": 1.0,
    "collision": -1.0,
    "off_route": -1.0,
    "speeding": -0.05,
    "steering": -0.004,
}
HIDDEN = (64, 64)
#: Steps of every world between two updates, and what an update does with them.
STEPS = 64
EPOCHS, MINIBATCH = 4, 2048
DISCOUNT, TRACE = 0.99, 0.95
CLIP, VALUE, NORM = 0.2, 0.5, 0.5
RATE = 7.0e-4
#: Of the rate, with rigid bodies: what was learnt is only to be adjusted.
GENTLY = 0.2
#: Spread of the actions that are tried, at first and in the end.
SPREAD = (0.6, 0.05)


def network(random: np.random.Generator, sizes: list[int], last: float) -> Layers:
    """Orthogonal weights, zero biases; the last layer's weights have the length `last`."""
    layers = []
    for at, (inputs, outputs) in enumerate(itertools.pairwise(sizes)):
        q, r = np.linalg.qr(random.normal(size=(max(inputs, outputs), min(inputs, outputs))))
        q = q * np.sign(np.diag(r))
        gain = last if at == len(sizes) - 2 else np.sqrt(2.0)
        weights = (q if inputs >= outputs else q.T) * gain
        layers.append((weights.astype(np.float32), np.zeros(outputs, np.float32)))
    return layers


def forward(layers: Layers, values: Floats) -> list[Floats]:
    """What every layer puts out, the input first."""
    outputs = [values]
    for at, (weights, bias) in enumerate(layers):
        values = values @ weights + bias
        values = np.tanh(values) if at < len(layers) - 1 else values
        outputs.append(values)
    return outputs


def backward(layers: Layers, outputs: list[Floats], slope: Floats) -> list[Floats]:
    """Slopes of all weights and biases, for that of the last output."""
    slopes: list[Floats] = []
    for at in reversed(range(len(layers))):
        slopes = [outputs[at].T @ slope, slope.sum(axis=0), *slopes]
        slope = (slope @ layers[at][0].T) * (1.0 - outputs[at] ** 2) if at else slope
    return slopes


class Adam:
    """Kingma and Ba, 2015; the norm of all slopes together is bounded."""

    def __init__(self, values: list[Floats]) -> None:
        self.values = values
        self._means = [np.zeros_like(value) for value in values]
        self._squares = [np.zeros_like(value) for value in values]
        self._count = 0

    def step(self, slopes: list[Floats], rate: float) -> None:
        norm = float(np.sqrt(sum(float((slope * slope).sum()) for slope in slopes)))
        self._count += 1
        scale = min(1.0, NORM / (norm + 1.0e-6))
        rate *= np.sqrt(1.0 - 0.999**self._count) / (1.0 - 0.9**self._count)
        for value, mean, square, slope in zip(
            self.values, self._means, self._squares, slopes, strict=True
        ):
            slope = slope * np.float32(scale)
            mean += np.float32(0.1) * (slope - mean)
            square += np.float32(0.001) * (slope * slope - square)
            value -= np.float32(rate) * mean / (np.sqrt(square) + np.float32(1.0e-5))


class Learner:
    """A policy with a normal distribution of actions, and a critic."""

    def __init__(self, columns: int, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.actor = network(self.random, [columns, *HIDDEN, 2], 0.01)
        self.critic = network(self.random, [columns, *HIDDEN, 1], 1.0)
        self.spread = np.float32(SPREAD[0])
        layers = [*self.actor, *self.critic]
        self._adam = Adam([array for layer in layers for array in layer])

    def act(self, observations: Floats) -> tuple[Floats, Floats, Floats]:
        """Actions, the logarithms of their densities, and values."""
        mean = forward(self.actor, observations)[-1]
        noise = self.random.standard_normal(mean.shape, np.float32)
        actions = mean + self.spread * noise
        return actions, self._log(noise), self.value(observations)

    def value(self, observations: Floats) -> Floats:
        values: Floats = forward(self.critic, observations)[-1][:, 0]
        return values

    def _log(self, noise: Floats) -> Floats:
        densities: Floats = (-0.5 * noise * noise - np.log(self.spread)).sum(axis=1)
        return densities

    def update(self, data: Experience, rate: float) -> float:
        """Learns from experience; returns how far the policy went (an estimate of KL)."""
        count, gone = len(data.returns), 0.0
        for _ in range(EPOCHS):
            order = self.random.permutation(count)
            for first in range(0, count, MINIBATCH):
                gone = self._descend(data.rows(order[first : first + MINIBATCH]), rate)
        return gone

    def _descend(self, data: Experience, rate: float) -> float:
        count = np.float32(len(data.returns))
        advantages = data.advantages - data.advantages.mean()
        advantages /= advantages.std() + 1.0e-8
        outputs = forward(self.actor, data.observations)
        noise = (data.actions - outputs[-1]) / self.spread
        change = self._log(noise) - data.logs
        ratios = np.exp(change)
        # Beyond the clip there is nothing to gain.
        active = np.where(advantages > 0.0, ratios < 1.0 + CLIP, ratios > 1.0 - CLIP)
        slope = (-(advantages * ratios * active) / count)[:, np.newaxis]
        slopes = backward(self.actor, outputs, slope * noise / self.spread)
        values = forward(self.critic, data.observations)
        errors = values[-1] - data.returns[:, np.newaxis]
        slopes += backward(self.critic, values, np.float32(VALUE) * errors / count)
        self._adam.step(slopes, rate)
        return float((ratios - 1.0 - change).mean())


@dataclass
class Experience:
    """Steps of all worlds, a row for each."""

    observations: Floats
    actions: Floats
    logs: Floats
    advantages: Floats
    returns: Floats

    def rows(self, chosen: NDArray[np.int64]) -> Experience:
        return Experience(*(array[chosen] for array in vars(self).values()))


class Course:
    """The worlds of one task, and what was seen there since the last update."""

    def __init__(self, batch: Batch, learner: Learner) -> None:
        self.batch, self.learner = batch, learner
        self.observations = batch.observations.copy()
        self.ended: list[tuple[float, float]] = []
        shape = (STEPS, batch.rows)
        self._seen = np.zeros((*shape, batch.width), np.float32)
        self._actions = np.zeros((*shape, 2), np.float32)
        self._logs, self._values, self._rewards = (np.zeros(shape, np.float32) for _ in range(3))
        self._goes_on = np.zeros(shape, np.float32)

    def send(self, at: int) -> None:
        actions, logs, values = self.learner.act(self.observations)
        self._seen[at], self._actions[at] = self.observations, actions
        self._logs[at], self._values[at] = logs, values
        self.batch.send(actions)

    def receive(self, at: int) -> None:
        observations, rewards, terminated, truncated = self.batch.recv()
        self._rewards[at], self._goes_on[at] = rewards, ~(terminated | truncated)
        for row in np.flatnonzero(terminated | truncated):
            episode = dict(zip(self.batch.episode_columns, self.batch.episodes[row], strict=True))
            self.ended.append((float(episode["success"]), float(episode["return"])))
        if truncated.any():
            # The time is no part of what is observed: what would have come counts as well.
            finals = self.batch.final_observations[truncated]
            self._rewards[at, truncated] += DISCOUNT * self.learner.value(finals)
        self.observations = observations.copy()

    def experience(self) -> list[Floats]:
        """Arrays as in `Experience`; advantages by Schulman's generalised estimate of 2016."""
        after = self.learner.value(self.observations)
        advantages = np.zeros_like(self._rewards)
        trace = np.zeros_like(after)
        for at in reversed(range(STEPS)):
            goes_on = self._goes_on[at]
            surprise = self._rewards[at] + DISCOUNT * goes_on * after - self._values[at]
            trace = surprise + DISCOUNT * TRACE * goes_on * trace
            advantages[at], after = trace, self._values[at]
        returns = advantages + self._values
        arrays = (self._seen, self._actions, self._logs, advantages, returns)
        return [array.reshape(-1, *array.shape[2:]) for array in arrays]


def percent(success: float) -> str:
    return "no episode ended" if np.isnan(success) else f"{100 * success:.0f} %"


def learn(
    learner: Learner,
    batches: list[Batch],
    steps: int,
    rate: float,
    spread: tuple[float, float],
    told: list[list[float]],
) -> None:
    """Learns for so many steps of worlds; adds a line to `told` for each update."""
    courses = [Course(batch, learner) for batch in batches]
    each = STEPS * sum(batch.rows for batch in batches)
    updates = max(1, steps // each)
    began = time.perf_counter()
    before = told[-1][0] if told else 0.0
    for update in range(updates):
        share = update / updates
        learner.spread = np.float32(spread[0] * (spread[1] / spread[0]) ** share)
        for course in courses:
            course.send(0)
        for at in range(STEPS):
            # While one course's worlds are stepped, the other's actions are worked out.
            for course in courses:
                course.receive(at)
                if at + 1 < STEPS:
                    course.send(at + 1)
        parts = zip(*(course.experience() for course in courses), strict=True)
        gone = learner.update(
            Experience(*(np.concatenate(part) for part in parts)), rate * (1.0 - share)
        )
        line = [before + each * (update + 1)]
        for course in courses:
            ended, course.ended = course.ended, []
            line += [float(value) for value in np.mean(ended or [(np.nan, np.nan)], axis=0)]
        told.append([*line, gone, float(learner.spread)])
        if (update + 1) % 10 == 0 or update + 1 == updates:
            secs = time.perf_counter() - began
            success = ", ".join(map(percent, line[1::2]))
            print(
                f"{line[0] / 1e6:.2f} M steps, {each * (update + 1) / secs:,.0f} a second: "
                f"success {success}",
                flush=True,
            )


def use_one_thread() -> None:
    """Numpy's libraries read these when they are loaded: if need be, begins again with them.

    One thread adds up in one order, and the engine has the other core.
    """
    wanted = {f"{library}_NUM_THREADS": "1" for library in ("OPENBLAS", "MKL", "OMP")}
    if not wanted.items() <= os.environ.items():
        os.environ.update(wanted)
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])


def main() -> int:
    options = parse_arguments()
    use_one_thread()
    try:
        train(options)
    except (EngineError, OSError, ValueError) as error:
        print(f"train_driver: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("driver"), help="folder (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="default: %(default)s")
    parser.add_argument(
        "--steps", type=int, default=3_000_000, help="with kinematic cars (%(default)s)"
    )
    parser.add_argument(
        "--physics-steps", type=int, default=200_000, help="with rigid bodies (%(default)s)"
    )
    parser.add_argument("--worlds", type=int, default=64, help="of each task (%(default)s)")
    towns = ["Town01", "Town07"]
    parser.add_argument(
        "--towns", nargs="+", default=towns, help=f"to learn in ({' '.join(towns)})"
    )
    parser.add_argument("--unseen", default="Town02", help="to evaluate in (%(default)s)")
    parser.add_argument("--episodes", type=int, default=100, help="to evaluate (%(default)s)")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")
    return parser.parse_args()


def train(options: argparse.Namespace) -> None:
    learner: Learner | None = None
    told: list[list[float]] = []
    stages = [
        ("kinematic", options.steps, RATE, SPREAD),
        ("physics", options.physics_steps, GENTLY * RATE, SPREAD[1:] * 2),
    ]
    columns: list[str] = []
    for tier, steps, rate, spread in stages:
        batches = [
            Batch(
                task,
                town=town,
                tier=tier,
                worlds=options.worlds,
                seed=options.seed,
                weathers=WEATHERS,
                reward=REWARD,
                autoreset="same_step",
                program=options.program,
            )
            for town in options.towns
            for task in LEARNT
        ]
        try:
            columns = [column.name for column in batches[0].columns]
            scales = [column.scale for column in batches[0].columns]
            learner = learner or Learner(len(columns), options.seed)
            if steps > 0:
                print(f"with {tier} cars in {', '.join(options.towns)}")
                learn(learner, batches, steps, rate, (spread[0], spread[1]), told)
        finally:
            for batch in batches:
                batch.close()
    assert learner is not None
    policy = Mlp(learner.actor, columns, scales)
    policy.save(options.out / "policy.npz")
    with (options.out / "curve.csv").open("w", newline="") as file:
        places = [f"{task} {town}" for town in options.towns for task in LEARNT]
        by_task = [f"{what} {place}" for place in places for what in ("success", "return")]
        csv.writer(file).writerow(["steps", *by_task, "kl", "spread"])
        csv.writer(file).writerows(told)
    tiers = ("kinematic", "physics")
    cells = [
        (Cell(task, options.unseen, tier, "driver", WEATHERS), policy)
        for tier in tiers
        for task in EVALUATED
    ]
    episodes = play(
        cells,
        seeds=[options.seed],
        episodes=options.episodes,
        settings={"program": options.program},
    )
    print(f"in {options.unseen}, which it has not seen")
    print(table(summarise(episodes)))
    write(options.out, episodes)


if __name__ == "__main__":
    sys.exit(main())
