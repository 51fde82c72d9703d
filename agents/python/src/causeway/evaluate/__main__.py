"""Drives tasks with policies and says how well, with intervals.

Writes `results.json` and `report.html` to the folder of `--out`.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from causeway import policy, program
from causeway.commands import add_engine, ended, engine, want_folder
from causeway.evaluate.compare import compare, sentences, want_common
from causeway.evaluate.conditions import by_condition
from causeway.evaluate.conditions import table as conditions_table
from causeway.evaluate.episodes import Cell, play
from causeway.evaluate.results import NOTHING_KEPT, REPORT, RESULTS, read, write
from causeway.evaluate.summary import summarise, table


def main() -> int:
    options = parse_arguments()
    return ended("causeway.evaluate", lambda: evaluate(options), interrupted=NOTHING_KEPT)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m causeway.evaluate",
        description=(__doc__ or "").splitlines()[0],
        epilog="Ends with 1 where --fail-under is not reached, with 2 for what cannot be.",
    )
    several: dict[str, Any] = {"nargs": "+", "metavar": "NAME"}
    tasks = ["corl17-straight", "corl17-one-turn"]
    parser.add_argument("--tasks", default=tasks, help=f"({' '.join(tasks)})", **several)
    parser.add_argument("--towns", default=["Town02"], help="(Town02)", **several)
    parser.add_argument(
        "--weathers",
        default=["training"],
        help="training and test, which are the task's, or presets of CARLA's (training)",
        **several,
    )
    parser.add_argument(
        "--training-towns",
        default=["Town01"],
        help="others are new towns in the table by condition (Town01)",
        **several,
    )
    tiers = ["kinematic", "physics"]
    told = f"{', '.join(tiers)} (kinematic)"
    parser.add_argument("--tiers", default=["kinematic"], choices=tiers, help=told, **several)
    parser.add_argument(
        "--policies",
        default=["follow"],
        help=f"{', '.join(policy.NAMES)}, FILE.npz, or NAME=FILE.npz (follow)",
        **several,
    )
    parser.add_argument("--episodes", type=int, default=25, help="of each seed (%(default)s)")
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2], help="(1 2)")
    parser.add_argument("--out", type=Path, help="folder of the files; without: none is written")
    parser.add_argument("--against", type=Path, help="results.json of another run to compare with")
    parser.add_argument("--fail-under", type=share, help="least success of every cell, 0 to 1")
    add_engine(parser)
    return parser.parse_args()


def evaluate(options: argparse.Namespace) -> int:
    policies = [_policy(text) for text in options.policies]
    _once("policies", [name for name, _ in policies], "; NAME=FILE.npz gives a file another name")
    for flag in ("tasks", "towns", "weathers", "tiers", "seeds"):
        _once(flag, getattr(options, flag))
    _want_towns(options)
    cells = [
        (Cell(task, town, tier, name, weathers), driver)
        for tier in options.tiers
        for town in options.towns
        for weathers in options.weathers
        for task in options.tasks
        for name, driver in policies
    ]
    before = read(options.against) if options.against else None
    if before is not None:
        known = {cell for cell, _ in cells}
        want_common(
            before,
            lambda one: (
                one.cell in known and one.seed in options.seeds and one.number < options.episodes
            ),
        )
    if options.out:
        want_folder(options.out, (RESULTS, REPORT))
    settings = engine(options)
    episodes = play(cells, seeds=options.seeds, episodes=options.episodes, settings=settings)
    summaries = summarise(episodes)
    print(table(summaries))
    conditions = by_condition(episodes, options.training_towns)
    if len({(one.cell.town, one.cell.weathers) for one in summaries}) > 1 and conditions:
        print(f"\nSuccess by condition, %:\n{conditions_table(conditions)}")
    differences = [] if before is None else compare(episodes, before)
    if differences:
        print(sentences(differences))
    if options.out:
        write(options.out, episodes, differences, conditions=conditions)
    least = min(one.success for one in summaries)
    if options.fail_under is not None and least < options.fail_under:
        print(f"success {least:.3f} is below {options.fail_under}", file=sys.stderr)
        return 1
    return 0


def share(text: str) -> float:
    value = float(text)
    if not 0.0 <= value <= 1.0:
        raise argparse.ArgumentTypeError(f"wanted a share of episodes, 0 to 1, found {text}")
    return value


def _once(flag: str, values: Sequence[Any], advice: str = "") -> None:
    """Refuses what comes twice: its episodes would be counted as one cell's."""
    for at, value in enumerate(values):
        if value in values[:at]:
            raise ValueError(f"--{flag} has {value} twice{advice}")


def _want_towns(options: argparse.Namespace) -> None:
    """Refuses training towns that are no map: all others would be new. The engine looks at those
    that are driven in."""
    asked = [town for town in options.training_towns if town not in options.towns]
    if not asked:
        return
    maps = [] if options.maps is None else ["--maps", options.maps]
    command = [program.find(options.program), "map", "list", *maps]
    listed = subprocess.run(command, capture_output=True, text=True)
    if listed.returncode != 0:
        raise ValueError(listed.stderr.strip())
    known = [line.split()[0] for line in listed.stdout.splitlines()]
    for town in asked:
        if town not in known:
            raise ValueError(f"--training-towns: wanted {', '.join(known)}, found {town}")


def _policy(text: str) -> tuple[str, policy.Policy]:
    """With the name that results have it by."""
    name, _, file = text.rpartition("=")
    if name:
        return name, policy.named(file)
    return (Path(text).stem if text.endswith(".npz") else text), policy.named(text)


if __name__ == "__main__":
    sys.exit(main())
