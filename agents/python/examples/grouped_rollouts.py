"""Plays groups of branches from one prefix, as GRPO does, and prints each branch's advantage.

causeway up
python examples/grouped_rollouts.py --branches 8 --prefix 10

The driver is a stand-in for a language model: it reads what a model would (the description and a
rolling history of its own turns), and writes a call of a tool as a model does.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from causeway.openenv import DEFAULT_BASE_URL, Session, SessionError, Step

#: What a model may call, and the arguments that it draws from.
TOOLS: dict[str, list[dict[str, Any]]] = {
    "observe": [{}],
    "emergency_stop": [{}],
    "brake_vehicle": [{"brake_intensity": 0.3}, {"brake_intensity": 0.7}],
    "lane_change": [{"lane_direction": "left"}, {"lane_direction": "right"}],
}


@dataclass
class History:
    """The last turns in full and the earlier ones in a line: a prompt that does not grow."""

    turns: int
    last: deque[str] = field(init=False)
    earlier: int = 0

    def __post_init__(self) -> None:
        self.last = deque(maxlen=self.turns)

    def add(self, call: str, step: Step) -> None:
        """Notes a turn and what changed by it."""
        self.earlier += len(self.last) == self.turns
        seen = step.observation
        self.last.append(f"{call} -> {seen['speed_kmh']:.0f} km/h, {seen['current_lane']}")

    def text(self) -> str:
        """What a model is told of it."""
        before = [f"({self.earlier} earlier turns)"] if self.earlier else []
        return "\n".join([*before, *self.last])


def main() -> int:
    options = parse_arguments()
    try:
        play(options)
    except (ConnectionError, SessionError) as error:
        print(f"grouped_rollouts: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--base-url", default=DEFAULT_BASE_URL, help="default: %(default)s")
    parser.add_argument("--scenario", default="trolley_saves", help="default: %(default)s")
    parser.add_argument("--groups", type=int, default=2, help="default: %(default)s")
    parser.add_argument("--branches", type=int, default=8, help="default: %(default)s")
    parser.add_argument("--prefix", type=int, default=5, help="steps that all share (%(default)s)")
    parser.add_argument("--turns", type=int, default=12, help="of a branch, at most (%(default)s)")
    parser.add_argument("--ticks", type=int, default=10, help="of a turn (%(default)s)")
    parser.add_argument("--history", type=int, default=6, help="turns told in full (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the first group (%(default)s)")
    return parser.parse_args()


def play(options: argparse.Namespace) -> None:
    """One line of JSON for each branch."""
    for group in range(options.groups):
        seed = options.seed + group
        with Session(options.base_url) as session:
            session.reset(options.scenario, seed=seed, scenario_config={"ticks_per_step": 1})
            for _ in range(options.prefix):
                session.step("observe")
            beginning = session.snapshot()
            returns = []
            for branch in range(options.branches):
                draw = random.Random(f"{seed} {branch}")
                rewarded, history = rollout(session, beginning, scripted(draw), options)
                returns.append((rewarded, history))
            session.forget(beginning)
        rewards = [rewarded for rewarded, _ in returns]
        spread = statistics.pstdev(rewards)
        for branch, (rewarded, history) in enumerate(returns):
            advantage = (rewarded - statistics.fmean(rewards)) / (spread + 1e-4)
            told = {"group": group, "branch": branch, "reward": rewarded}
            print(json.dumps({**told, "advantage": round(advantage, 3), "last": history.last[-1]}))


def rollout(
    session: Session,
    beginning: str,
    model: Callable[[str], str],
    options: argparse.Namespace,
) -> tuple[float, History]:
    """Goes on from the beginning until the episode is over; the sum of its rewards."""
    step = session.reset(snapshot_id=beginning)
    history = History(options.history)
    rewarded = 0.0
    for _ in range(options.turns):
        prompt = f"{step.observation['scene_description']}\nYour last turns:\n{history.text()}"
        text = model(prompt)
        call = json.loads(text)
        step = session.step(call["name"], **call["arguments"])
        rewarded += step.reward or 0.0
        for _ in range(options.ticks - 1):
            if step.done:
                break
            step = session.step("observe")
            rewarded += step.reward or 0.0
        history.add(text, step)
        if step.done:
            break
    return rewarded, history


def scripted(draw: random.Random) -> Callable[[str], str]:
    """A stand-in for a model: any tool, more often the one that it called before."""
    before: list[tuple[str, dict[str, Any]]] = []

    def model(prompt: str) -> str:
        del prompt
        if not before or draw.random() < 0.5:
            name = draw.choice(sorted(TOOLS))
            before[:] = [(name, draw.choice(TOOLS[name]))]
        name, arguments = before[0]
        return json.dumps({"name": name, "arguments": arguments})

    return model


if __name__ == "__main__":
    sys.exit(main())
