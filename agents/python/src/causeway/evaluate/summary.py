"""What the episodes of a cell come to, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from causeway.evaluate import intervals
from causeway.evaluate.episodes import CAUSES, Cell, Episode
from causeway.evaluate.intervals import Interval
from causeway.evaluate.score import KINDS, PENALTIES, driving_score

#: The version whose score tables show.
SCORE = "2.1"


@dataclass(frozen=True)
class Summary:
    """Numbers of a cell; every interval is one of 95 %."""

    cell: Cell
    episodes: int
    successes: int
    #: Wilson's.
    success_interval: Interval
    #: Mean share of the way, 0 to 1.
    completion: float
    completion_interval: Interval
    km: float
    #: Of whatever was run into, of red lights that were run, and of times off the way.
    infractions: int
    infractions_per_km: float
    infractions_interval: Interval
    #: By kind.
    per_km: dict[str, float]
    #: Means by version of CARLA's leaderboard, 0 to 100.
    driving_scores: dict[str, float]
    mean_speed_mps: float
    mean_beside_m: float
    #: Episodes by what ended them.
    causes: dict[str, int]

    @property
    def success(self) -> float:
        return self.successes / self.episodes

    def record(self) -> dict[str, Any]:
        """As in a file of results."""
        values = asdict(self)
        return {**values.pop("cell"), "success": self.success, **values}


def summarise(episodes: Iterable[Episode]) -> list[Summary]:
    """One summary for each cell, in the order in which they first come.

    Raises:
        ValueError: an episode of a cell comes twice, as with two policies of one name.
    """
    cells: dict[Cell, dict[tuple[int, int], Episode]] = {}
    for episode in episodes:
        found, name = cells.setdefault(episode.cell, {}), (episode.seed, episode.number)
        if name in found:
            raise ValueError(f"{episode.cell}: episode {name[1]} of seed {name[0]} comes twice")
        found[name] = episode
    return [_of(cell, list(found.values())) for cell, found in cells.items()]


def _of(cell: Cell, episodes: Sequence[Episode]) -> Summary:
    def column(name: str) -> list[float]:
        # Results of earlier versions lack some.
        return [episode.numbers.get(name, 0.0) for episode in episodes]

    count, successes = len(episodes), sum(episode.success for episode in episodes)
    km = [metres / 1000.0 for metres in column("driven_m")]
    left = [float(episode.cause == "off_route") for episode in episodes]
    kinds = {**{kind: column(name) for name, kind in KINDS.items()}, "off the way": left}
    infractions = [sum(counts) for counts in zip(*kinds.values(), strict=True)]
    causes = [episode.cause for episode in episodes]
    secs = sum(column("secs"))
    return Summary(
        cell=cell,
        episodes=count,
        successes=successes,
        success_interval=intervals.wilson(successes, count),
        completion=sum(column("completion")) / count,
        completion_interval=intervals.mean(column("completion")),
        km=sum(km),
        infractions=int(sum(infractions)),
        infractions_per_km=sum(infractions) / sum(km) if sum(km) > 0.0 else 0.0,
        infractions_interval=intervals.ratio(infractions, km),
        per_km={
            kind: sum(counts) / sum(km) if sum(km) > 0.0 else 0.0 for kind, counts in kinds.items()
        },
        driving_scores={
            version: sum(driving_score(one.numbers, version) for one in episodes) / count
            for version in PENALTIES
        },
        mean_speed_mps=sum(column("driven_m")) / secs if secs > 0.0 else 0.0,
        mean_beside_m=sum(column("mean_beside_m")) / count,
        causes={cause: causes.count(cause) for cause in CAUSES if cause in causes},
    )


def table(summaries: Sequence[Summary]) -> str:
    """For people: a line for each cell."""
    head = ["task", "town", "weathers", "tier", "policy", "n", "success %", "95 %"]
    head += ["way %", "per km", "score", "m/s", "ended by"]
    lines = [head]
    for one in summaries:
        low, high = one.success_interval
        causes = ", ".join(f"{name} {count}" for name, count in one.causes.items())
        lines.append(
            [
                *(one.cell.task, one.cell.town, one.cell.weathers, one.cell.tier, one.cell.policy),
                *(str(one.episodes), f"{100 * one.success:.1f}"),
                *(f"{100 * low:.1f} to {100 * high:.1f}", f"{100 * one.completion:.1f}"),
                *(f"{one.infractions_per_km:.2f}", f"{one.driving_scores[SCORE]:.1f}"),
                *(f"{one.mean_speed_mps:.1f}", causes),
            ]
        )
    return columns(lines)


def columns(lines: Sequence[Sequence[str]]) -> str:
    """Lines of texts, one below the other."""
    widths = [max(len(line[at]) for line in lines) for at in range(len(lines[0]))]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )
