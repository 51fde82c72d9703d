"""What came of episodes: the two tables of the driving benchmark of CARLA 0.8, and metrics."""

from __future__ import annotations

import csv
import itertools
import json
import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import infractions
from measurements import Collisions, Player
from simulator import carla

SUMMARY = (
    *("exp_id", "rep", "weather", "start_point", "end_point", "result"),
    *("initial_distance", "final_distance", "final_time", "time_out"),
)
FRAME = (
    *("exp_id", "rep", "weather", "start_point", "end_point"),
    *("collision_other", "collision_pedestrians", "collision_vehicles"),
    *("intersection_otherlane", "intersection_offroad"),
    *("pos_x", "pos_y", "steer", "throttle", "brake"),
)


@dataclass
class Episode:
    """One drive. Distances are straight lines to the goal in m, times seconds of the world."""

    task: str
    weather: int
    start: int
    goal: int
    initial_m: float
    limit_secs: float
    arrived: bool = False
    final_m: float = math.inf
    secs: float = 0.0
    frames: list[dict[str, object]] = field(default_factory=list)

    def is_over(self) -> bool:
        return self.arrived or self.secs >= self.limit_secs

    def add(
        self, now: Player, collisions: Collisions, control: carla.VehicleControl, step_secs: float
    ) -> None:
        values = {
            "collision_other": collisions.other,
            "collision_pedestrians": collisions.pedestrians,
            "collision_vehicles": collisions.vehicles,
            "intersection_otherlane": now.other_lane,
            "intersection_offroad": now.off_road,
            "pos_x": now.x_m,
            "pos_y": now.y_m,
            "steer": control.steer,
            "throttle": control.throttle,
            "brake": control.brake,
        }
        rounded = {name: f"{value:.4f}" for name, value in values.items()}
        self.frames.append({**self.which(), **rounded})
        self.secs = len(self.frames) * step_secs

    def which(self) -> dict[str, object]:
        return {
            "exp_id": self.task,
            "rep": 0,
            "weather": self.weather,
            "start_point": self.start,
            "end_point": self.goal,
        }

    def summary(self) -> dict[str, object]:
        return {
            **self.which(),
            "result": int(self.arrived),
            "initial_distance": f"{self.initial_m:.2f}",
            "final_distance": f"{self.final_m:.2f}",
            "final_time": f"{self.secs:.1f}",
            "time_out": f"{self.limit_secs:.1f}",
        }

    def line(self) -> str:
        end = "arrived" if self.arrived else f"{self.final_m:.0f} m from the goal"
        ways = f"{self.start} to {self.goal}, weather {self.weather}"
        return f"{self.task}: {ways}: {end} after {self.secs:.0f} s"


class Results:
    """The folder of a run. ValueError if it holds another run that is not to go on."""

    def __init__(self, folder: Path, *, goes_on: bool) -> None:
        self._folder = folder
        self._done = rows(folder / "summary.csv")
        if self._done and not goes_on:
            raise ValueError(f"{folder} has results: --continue-experiment, or another --log_name")
        folder.mkdir(parents=True, exist_ok=True)
        # An episode without a line in the summary was not written whole.
        known = {self._key(row) for row in self._done}
        frames = [row for row in rows(folder / "measurements.csv") if self._key(row) in known]
        write(folder / "measurements.csv", FRAME, frames)
        write(folder / "summary.csv", SUMMARY, self._done)

    @staticmethod
    def _key(row: dict[str, Any]) -> tuple[str, ...]:
        return tuple(str(row[name]) for name in ("exp_id", "weather", "start_point", "end_point"))

    def has(self, task: str, weather: int, start: int, goal: int) -> bool:
        return (task, str(weather), str(start), str(goal)) in map(self._key, self._done)

    def add(self, episode: Episode) -> None:
        write(self._folder / "measurements.csv", FRAME, episode.frames, mode="a")
        write(self._folder / "summary.csv", SUMMARY, [episode.summary()], mode="a")
        self._done.append({name: str(value) for name, value in episode.summary().items()})

    def metrics(self) -> list[dict[str, Any]]:
        """One row for each task and weather, in the order of the summary."""
        frames = rows(self._folder / "measurements.csv")
        order = list(dict.fromkeys((row["exp_id"], row["weather"]) for row in self._done))
        return [self._metrics(task, weather, frames) for task, weather in order]

    def _metrics(self, task: str, weather: str, frames: list[dict[str, str]]) -> dict[str, Any]:
        done = [row for row in self._done if (row["exp_id"], row["weather"]) == (task, weather)]
        completed = [
            1.0 - float(row["final_distance"]) / float(row["initial_distance"]) for row in done
        ]
        driven_km, counts = 0.0, dict.fromkeys(infractions.RULES, 0)
        own = [row for row in frames if (row["exp_id"], row["weather"]) == (task, weather)]
        for _, group in itertools.groupby(own, key=self._key):
            episode = list(group)
            places = [(float(row["pos_x"]), float(row["pos_y"])) for row in episode]
            driven_km += sum(map(math.dist, places, places[1:])) / 1000.0
            for name, rule in infractions.RULES.items():
                counts[name] += infractions.count(
                    [float(row[rule.column]) for row in episode], rule
                )
        return {
            "task": task,
            "weather": int(weather),
            "episodes": len(done),
            "success": sum(int(row["result"]) for row in done) / len(done),
            "completion": sum(completed) / len(done),
            "driven_km": round(driven_km, 4),
            "infractions": counts,
        }

    def table(self) -> str:
        """The metrics for people; saves them, too. Kilometres are those between two infractions."""
        found = self.metrics()
        (self._folder / "metrics.json").write_text(json.dumps(found, indent=1) + "\n")
        heads = ("task", "weather", "success", "way done", *infractions.RULES)
        lines = [(*heads[:4], *(f"km/{name}" for name in heads[4:]))]
        for row in found:
            shares = f"{row['success']:.0%}", f"{row['completion']:.0%}"
            between = (apart(name, row) for name in infractions.RULES)
            lines.append((row["task"], str(row["weather"]), *shares, *between))
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        return "\n".join(
            "  ".join(word.rjust(width) for word, width in zip(line, widths, strict=True))
            for line in lines
        )


def apart(name: str, row: dict[str, Any]) -> str:
    count, driven_km = row["infractions"][name], row["driven_km"]
    return f"{driven_km / count:.2f}" if count else f"> {driven_km:.2f}"


def rows(path: Path) -> list[dict[str, str]]:
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write(
    path: Path, columns: tuple[str, ...], lines: Iterable[dict[str, Any]], mode: str = "w"
) -> None:
    with path.open(mode, newline="") as file:
        writer = csv.DictWriter(file, columns)
        if mode == "w":
            writer.writeheader()
        writer.writerows(lines)
