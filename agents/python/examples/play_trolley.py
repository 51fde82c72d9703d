"""Plays one trolley episode, saves the picture before and after, and prints what came of it.

causeway up
python examples/play_trolley.py --policy brake --out pictures
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

from causeway.openenv import DEFAULT_BASE_URL, Session, SessionError, Step

POLICIES = ("observe", "brake", "swerve")


def main() -> int:
    options = parse_arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    try:
        with Session(options.base_url) as session:
            play(session, options)
    except (ConnectionError, SessionError) as error:
        print(f"play_trolley: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--base-url", default=DEFAULT_BASE_URL, help="default: %(default)s")
    parser.add_argument("--scenario", default="trolley_saves", help="default: %(default)s")
    parser.add_argument("--policy", choices=POLICIES, default="brake")
    parser.add_argument("--seed", type=int, help="the same seed plays the same episode")
    parser.add_argument(
        "--steps", type=int, default=60, help="steps to play, 0.05 s each; default: %(default)s"
    )
    parser.add_argument("--out", type=Path, default=Path("."), help="folder for the two pictures")
    return parser.parse_args()


def play(session: Session, options: argparse.Namespace) -> None:
    step = session.reset(options.scenario, seed=options.seed)
    print(step.observation["scene_description"])
    save(session, options.out / "before.jpg")

    step = decide(session, options.policy, step)
    verdict = step if step.done else None
    # The episode is decided within a few steps; the world goes on and shows what follows.
    for _ in range(options.steps - 1):
        step = session.step("observe")
        verdict = verdict or (step if step.done else None)
    save(session, options.out / "after.jpg")
    report(verdict, step, session.state())


def decide(session: Session, policy: str, start: Step) -> Step:
    """The one decision of a policy; what it starts goes on while the car is only observed."""
    if policy == "brake":
        return session.step("emergency_stop")
    if policy == "swerve":
        side = start.metadata["info"]["side_directions"][0]
        return session.step("lane_change", lane_direction=side)
    return session.step("observe")


def save(session: Session, path: Path) -> None:
    path.write_bytes(session.capture())
    print(f"saved {path}")


def report(verdict: Step | None, last: Step, state: dict[str, Any]) -> None:
    if verdict is None:
        print("the episode is not over; play more --steps")
    else:
        seconds = verdict.observation["simulation_time"]
        print(f"verdict after {seconds:.2f} s: reward {verdict.rubric_reward}")
    victims = [hit for hit in state["collisions"] if hit["actor_type"].startswith("walker.")]
    print(f"speed at the end: {last.observation['speed_kmh']:.1f} km/h")
    print(f"pedestrians hit: {len(victims)}")


if __name__ == "__main__":
    sys.exit(main())
