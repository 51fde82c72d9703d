"""Success by condition, as tables of CoRL 2017 and NoCrash have it: in towns and weathers that a
driver knows from training, and in those that are new to it."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from causeway.evaluate import intervals
from causeway.evaluate.episodes import Episode
from causeway.evaluate.intervals import Interval
from causeway.evaluate.summary import columns

#: In the order of the papers' columns.
CONDITIONS = ("training", "new town", "new weather", "new town and weather")


@dataclass
class Share:
    """Episodes of one condition."""

    episodes: int = 0
    successes: int = 0

    @property
    def interval(self) -> Interval:
        """Wilson's, of 95 %."""
        return intervals.wilson(self.successes, self.episodes)

    def __str__(self) -> str:
        """Percent of success with its interval; a dash where there is no episode."""
        if self.episodes == 0:
            return "-"
        low, high = self.interval
        success = 100 * self.successes / self.episodes
        return f"{success:.1f} ({100 * low:.1f} to {100 * high:.1f})"


@dataclass
class Row:
    """How one policy did a task in a tier, by condition."""

    task: str
    tier: str
    policy: str
    shares: dict[str, Share] = field(
        default_factory=lambda: {condition: Share() for condition in CONDITIONS}
    )

    @property
    def names(self) -> tuple[str, str, str]:
        return self.task, self.tier, self.policy

    def texts(self) -> list[str]:
        """By condition, for people."""
        return [str(share) for share in self.shares.values()]

    def record(self) -> dict[str, Any]:
        """As in a file of results."""
        return asdict(self)


def by_condition(episodes: Iterable[Episode], training_towns: Collection[str]) -> list[Row]:
    """A row for each task, tier and policy, in the order in which they first come.

    Args:
        episodes: towns that are not among `training_towns` are new, and so are the weathers `test`.
            Episodes in weathers that were asked for by a preset's name are left out.
    """
    rows: dict[tuple[str, str, str], Row] = {}
    for episode in episodes:
        cell = episode.cell
        if cell.weathers not in ("training", "test"):
            continue
        names = (cell.task, cell.tier, cell.policy)
        is_new = (cell.town not in training_towns, cell.weathers == "test")
        share = rows.setdefault(names, Row(*names)).shares[CONDITIONS[is_new[0] + 2 * is_new[1]]]
        share.episodes += 1
        share.successes += episode.success
    return list(rows.values())


def table(rows: Sequence[Row]) -> str:
    """For people: percent of success with its interval, a line for each row."""
    head = ["task", "tier", "policy", *CONDITIONS]
    return columns([head, *([*row.names, *row.texts()] for row in rows)])
