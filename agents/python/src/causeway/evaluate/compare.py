"""Two runs side by side: what came out otherwise, and whether that is more than chance."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from causeway.evaluate import intervals
from causeway.evaluate.episodes import Cell, Episode
from causeway.evaluate.intervals import Interval

#: A difference counts as more than chance below this.
CHANCE = 0.05
_NOTHING_IN_COMMON = (
    "the runs have no episode in common; wanted the same tasks, towns, weathers, tiers, "
    "seeds and names of policies (NAME=FILE.npz names a file)"
)


@dataclass(frozen=True)
class Difference:
    """A cell now and before, over the episodes that both runs have."""

    cell: Cell
    episodes: int
    success_before: float
    success: float
    #: Episodes that succeeded before alone, and now alone.
    lost: int
    won: int
    #: Of so many changes if nothing is different, adjusted for the number of cells (Holm).
    chance: float
    #: Mean change of the share of the way, with its 95 % interval over pairs.
    completion_change: float
    completion_interval: Interval
    #: Episodes that are not the same to the last bit, as (seed, number).
    changed: tuple[tuple[int, int], ...]

    @property
    def verdict(self) -> str:
        """A word for people."""
        if not self.changed:
            return "identical"
        if self.chance >= CHANCE:
            return "no more than chance"
        return "better" if self.won > self.lost else "worse"

    def record(self) -> dict[str, Any]:
        """As in a file of results."""
        values = asdict(self)
        changed = [list(name) for name in values.pop("changed")]
        return {**values.pop("cell"), "verdict": self.verdict, **values, "changed": changed}


def compare(now: Iterable[Episode], before: Iterable[Episode]) -> list[Difference]:
    """One difference for each cell of which both runs have an episode, in the order of `now`.

    Raises:
        ValueError: the runs have no episode in common.
    """
    known = {_key(episode): episode for episode in before}
    pairs: dict[Cell, list[tuple[Episode, Episode]]] = {}
    for episode in now:
        other = known.get(_key(episode))
        if other is not None:
            pairs.setdefault(episode.cell, []).append((episode, other))
    if not pairs:
        raise ValueError(_NOTHING_IN_COMMON)
    lost = {cell: _count(found, False, True) for cell, found in pairs.items()}
    won = {cell: _count(found, True, False) for cell, found in pairs.items()}
    chances = intervals.holm([intervals.mcnemar(lost[cell], won[cell]) for cell in pairs])
    return [
        _of(cell, pairs[cell], (lost[cell], won[cell]), chance)
        for cell, chance in zip(pairs, chances, strict=True)
    ]


def want_common(before: Iterable[Episode], comes: Callable[[Episode], bool]) -> None:
    """Refuses a run whose episodes will be none of those before; `comes` tells of one of these.

    Raises:
        ValueError: none comes again.
    """
    if not any(comes(episode) for episode in before):
        raise ValueError(_NOTHING_IN_COMMON)


def _key(episode: Episode) -> tuple[Cell, int, int]:
    return episode.cell, episode.seed, episode.number


def _count(pairs: Sequence[tuple[Episode, Episode]], now: bool, before: bool) -> int:
    return sum((one.success, other.success) == (now, before) for one, other in pairs)


def _of(
    cell: Cell,
    pairs: Sequence[tuple[Episode, Episode]],
    lost_and_won: tuple[int, int],
    chance: float,
) -> Difference:
    changes = [now.numbers["completion"] - old.numbers["completion"] for now, old in pairs]
    return Difference(
        cell=cell,
        episodes=len(pairs),
        success_before=sum(old.success for _, old in pairs) / len(pairs),
        success=sum(now.success for now, _ in pairs) / len(pairs),
        lost=lost_and_won[0],
        won=lost_and_won[1],
        chance=chance,
        completion_change=sum(changes) / len(changes),
        completion_interval=intervals.mean(changes),
        changed=tuple((now.seed, now.number) for now, old in pairs if now.record() != old.record()),
    )


def sentences(differences: Sequence[Difference], share: str = "way") -> str:
    """For people: a line for each cell; `share`: what `completion` is one of."""
    lines = []
    for one in differences:
        low, high = one.completion_interval
        lines.append(
            f"{one.cell}: {one.verdict}; success {100 * one.success_before:.1f} % before, "
            f"{100 * one.success:.1f} % now ({one.won} won, {one.lost} lost of {one.episodes}, "
            f"p = {one.chance:.3f}); {share} {100 * one.completion_change:+.1f} points "
            f"({100 * low:+.1f} to {100 * high:+.1f}); {len(one.changed)} episodes changed"
        )
    return "\n".join(lines)
