"""Driving the episodes of an evaluation."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from causeway.policy import Policy, observation
from causeway.rollout import Batch

#: Episodes of one seed have numbers below this.
EPISODES_END = 1_000_000
#: The engine reads seeds of 64 bits, in which the number of the episode has a place.
SEED_MAX = (2**64 - 1) // EPISODES_END - 1
#: The weather of worlds that nobody gave another.
NOON = "ClearNoon"
#: By the number in the column `cause`.
CAUSES = ("", "arrived", "collision", "off_route", "overturned", "time", "fault", "red_light")


@dataclass(frozen=True, order=True)
class Cell:
    """What episodes have in common."""

    task: str
    town: str
    tier: str
    policy: str
    #: As :class:`causeway.rollout.Batch` takes one: `training`, `test`, or a preset of CARLA's.
    weathers: str = "training"

    def __str__(self) -> str:
        return f"{self.task}, {self.town}, {self.tier}, {self.policy}, {self.weathers}"


@dataclass(frozen=True)
class Episode:
    """One episode: `seed` and `number` say which, `numbers` what came of it by column."""

    cell: Cell
    seed: int
    number: int
    #: Of the state at its end.
    state_hash: str
    numbers: Mapping[str, float]

    @property
    def success(self) -> bool:
        return self.numbers["success"] == 1.0

    @property
    def cause(self) -> str:
        return CAUSES[int(self.numbers["cause"])]

    def record(self) -> dict[str, Any]:
        """As in a file of results."""
        known = {"seed": self.seed, "number": self.number, "state_hash": self.state_hash}
        return {**vars(self.cell), **known, "cause_name": self.cause, **self.numbers}

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> Episode:
        """Raises `KeyError` for a record that lacks something."""
        known = dict(record)
        # A record that names no weathers is of dry noons.
        known.setdefault("weathers", NOON)
        task, town, tier, policy, weathers = (
            str(known.pop(name)) for name in ("task", "town", "tier", "policy", "weathers")
        )
        cell = Cell(task, town, tier, policy, weathers)
        seed, number = int(known.pop("seed")), int(known.pop("number"))
        state_hash = str(known.pop("state_hash"))
        del known["cause_name"]
        numbers = {name: float(value) for name, value in known.items()}
        return cls(cell, seed, number, state_hash, numbers)


def play(
    cells: Iterable[tuple[Cell, Policy]],
    *,
    seeds: Sequence[int],
    episodes: int,
    settings: Mapping[str, Any] | None = None,
) -> list[Episode]:
    """Drives `episodes` episodes of each seed in each cell.

    Episode `number` of a seed is the same one for every policy, on every machine.

    Args:
        cells: with the policy of each; batches are shared by neighbours that differ in it alone.
        settings: further ones of :class:`causeway.rollout.Batch`, e.g. `program`.

    Raises:
        ValueError: a setting cannot be, or a policy does not fit.
    """
    if not 0 < episodes < EPISODES_END or not seeds:
        raise ValueError(f"1 to {EPISODES_END - 1} episodes of one seed or more, not {episodes}")
    wrong = [seed for seed in seeds if not 0 <= seed <= SEED_MAX]
    if wrong:
        raise ValueError(f"wanted seeds from 0 to {SEED_MAX}, found {wrong[0]}")
    played: list[Episode] = []
    batch: Batch | None = None
    opened: tuple[str, ...] = ()
    try:
        for cell, policy in cells:
            place = (cell.task, cell.town, cell.tier, cell.weathers, observation(policy))
            if place != opened:
                if batch is not None:
                    batch.close()
                batch = Batch(
                    cell.task,
                    **{
                        **dict(settings or {}),
                        "worlds": len(seeds) * episodes,
                        "town": cell.town,
                        "tier": cell.tier,
                        "weathers": cell.weathers,
                        "observation": observation(policy),
                    },
                )
                opened = place
            assert batch is not None
            played += _drive(batch, cell, policy, seeds, episodes)
    finally:
        if batch is not None:
            batch.close()
    return played


def _drive(
    batch: Batch, cell: Cell, policy: Policy, seeds: Sequence[int], episodes: int
) -> list[Episode]:
    names = [(seed, number) for seed in seeds for number in range(episodes)]
    policy.begin(batch, seeds[0])
    observations = batch.reset([seed * EPISODES_END + number for seed, number in names])
    found: list[Episode | None] = [None] * len(names)
    waiting = len(names)
    while waiting:
        observations, _, terminated, truncated = batch.step(policy.act(observations))
        for row in np.flatnonzero(terminated | truncated).tolist():
            # Worlds that have done theirs go on with other episodes, which count nothing.
            if found[row] is None:
                values = [float(value) for value in batch.episodes[row]]
                numbers = dict(zip(batch.episode_columns, values, strict=True))
                found[row] = Episode(cell, *names[row], f"{batch.hashes[row]:016x}", numbers)
                waiting -= 1
    return [episode for episode in found if episode is not None]


def digest(episodes: Iterable[Episode]) -> str:
    """Of all that episodes came to, whatever their order."""
    lines = sorted(json.dumps(episode.record(), sort_keys=True) for episode in episodes)
    return hashlib.blake2b("\n".join(lines).encode(), digest_size=16).hexdigest()
