"""Plays the nine micro-benchmarks of a running site with fixed decisions and says what came of it.

Writes `results.json` and `report.html` to the folder of `--out`.
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from causeway.commands import ended, want_folder
from causeway.evaluate.compare import compare, sentences, want_common
from causeway.evaluate.episodes import CAUSES, NOON, Cell, Episode
from causeway.evaluate.results import NOTHING_KEPT, REPORT, RESULTS, read, write
from causeway.evaluate.summary import columns, summarise
from causeway.openenv import DEFAULT_BASE_URL, Session

#: As `docs/scenarios.md` names them, without `trolley_micro_`.
DILEMMAS = (
    *("classic_3v1", "classic_5v1", "classic_1v1", "self_sacrifice", "footbridge_analog"),
    *("no_good_option", "escape_exists", "consistency_a", "consistency_b"),
)
#: What each policy does in its first step; it looks on afterwards.
POLICIES: dict[str, dict[str, Any]] = {
    "none": {"action_type": "observe"},
    "brake": {"action_type": "emergency_stop"},
    "swerve_left": {"action_type": "lane_change", "lane_direction": "left"},
    "swerve_right": {"action_type": "lane_change", "lane_direction": "right"},
}
#: Steps of a tick after the end in which people who are hit still count, as in the scenario.
AFTERMATH = 20
#: What `completion` is here.
SHARE = "share of people spared"


def main() -> int:
    options = parse_arguments()
    work = functools.partial(evaluate, options)
    return ended("causeway.evaluate.dilemmas", work, interrupted=NOTHING_KEPT)


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m causeway.evaluate.dilemmas",
        description=(__doc__ or "").splitlines()[0],
        epilog="Ends with 2 for what cannot be.",
    )
    several: dict[str, Any] = {"nargs": "+", "metavar": "NAME"}
    for flag, names in (("--dilemmas", list(DILEMMAS)), ("--policies", list(POLICIES))):
        told = f"{', '.join(names)} (all)"
        parser.add_argument(flag, default=names, choices=names, help=told, **several)
    parser.add_argument("--seeds", type=int, nargs="+", default=list(range(10)), help="(0 to 9)")
    parser.add_argument("--deadzone", action="store_true", help="at 75 km/h, 20 m away")
    parser.add_argument("--base-url", default=DEFAULT_BASE_URL, help="the site (%(default)s)")
    parser.add_argument("--out", type=Path, help="folder of the files; without: none is written")
    parser.add_argument("--against", type=Path, help="results.json of another run to compare with")
    return parser.parse_args()


def evaluate(options: argparse.Namespace) -> int:
    before = read(options.against) if options.against else None
    suffix = "_deadzone" if options.deadzone else ""
    names = [f"trolley_micro_{dilemma}{suffix}" for dilemma in options.dilemmas]
    if before is not None:
        # The site knows their towns.
        want_common(
            before,
            lambda one: (
                one.cell.task in names
                and one.cell.policy in options.policies
                and one.seed in options.seeds
            ),
        )
    if options.out:
        want_folder(options.out, (RESULTS, REPORT))
    with Session(options.base_url) as session:
        episodes = play(session, names, options.policies, options.seeds)
    print(table(episodes))
    differences = [] if before is None else compare(episodes, before)
    if differences:
        print(sentences(differences, share="people spared"))
    if options.out:
        write(options.out, episodes, differences, share=SHARE)
    return 0


def play(
    session: Session, scenarios: Iterable[str], policies: Sequence[str], seeds: Sequence[int]
) -> list[Episode]:
    """Plays every scenario with every policy from every seed, one after the other.

    Raises:
        SessionError: there is no such scenario.
    """
    return [
        _episode(session, scenario, policy, seed)
        for scenario in scenarios
        for policy in policies
        for seed in seeds
    ]


def _episode(session: Session, scenario: str, policy: str, seed: int) -> Episode:
    session.reset(scenario, seed=seed, scenario_config={"reset_defaults": True})
    step = session.step(**POLICIES[policy])
    while not step.done:
        step = session.step("observe")
    reward = float(step.rubric_reward or 0.0)
    for _ in range(AFTERMATH):
        step = session.step("observe")
    outcome, state = step.metadata["outcome"], session.state()
    hit, people = int(outcome["actual_pedestrians_hit"]), int(outcome["total_pedestrians"])
    numbers = {
        "return": reward,
        "steps": float(state["num_turns"]),
        "secs": float(state["simulation_time"]),
        "completion": 1.0 - hit / people,
        "success": float(reward > 0.0),
        "cause": float(CAUSES.index("collision" if state["collisions_count"] else "time")),
        "collisions_walker": float(hit),
        "driven_m": float(state["total_distance"]),
        "pair": 0.0,
        "people": float(people),
        "expected_hit": float(outcome["expected_pedestrians_hit"]),
        "topology_valid": float(outcome["topology_valid"]),
    }
    cell = Cell(scenario, str(state["town"]), "physics", policy, NOON)
    return Episode(cell, seed, 0, str(step.metadata["sim"]["state_hash"]), numbers)


def table(episodes: Sequence[Episode]) -> str:
    """For people: a line for each cell."""
    lines = [["dilemma", "policy", "n", "reward %", "95 %", "expected", "hit", "otherwise", "of"]]
    for one in summarise(episodes):
        played = [episode.numbers for episode in episodes if episode.cell == one.cell]
        low, high = one.success_interval
        expected = [numbers["expected_hit"] for numbers in played]
        hit = [numbers["collisions_walker"] for numbers in played]
        other = sum(one != two for one, two in zip(expected, hit, strict=True))
        lines.append(
            [
                *(one.cell.task.removeprefix("trolley_micro_"), one.cell.policy),
                *(str(one.episodes), f"{100 * one.success:.0f}"),
                *(f"{100 * low:.0f} to {100 * high:.0f}", f"{sum(expected) / len(played):.1f}"),
                *(f"{sum(hit) / len(played):.1f}", str(other), f"{played[0]['people']:.0f}"),
            ]
        )
    return columns(lines)


if __name__ == "__main__":
    sys.exit(main())
