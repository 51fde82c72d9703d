"""Records episodes of a task, driven by a policy, as an MCAP file.

Prints a line for each. Ctrl-C leaves the episodes that are whole, and says how many.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from causeway import policy
from causeway.dataset import play, write
from causeway.evaluate.episodes import CAUSES
from causeway.rollout import EngineError


def main() -> int:
    options = parse_arguments()
    try:
        return record(options)
    except (EngineError, OSError, ValueError) as error:
        print(f"causeway.record_episodes: {error}", file=sys.stderr)
        return 2


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m causeway.record_episodes", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("task")
    parser.add_argument("--episodes", type=int, default=20, help="(%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the first; then the next ones")
    parser.add_argument("--town", default="Town02", help="(%(default)s)")
    parser.add_argument("--tier", default="physics", help="(%(default)s)")
    parser.add_argument("--policy", default="follow", help=f"{', '.join(policy.NAMES)}, FILE.npz")
    parser.add_argument("--observation", help="what is recorded; by default what the policy reads")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.mcap")
    parser.add_argument("--maps", help="folder of further OpenDRIVE files")
    parser.add_argument("--task-files", help="folder of further tasks, NAME.toml")
    parser.add_argument("--program", default="causeway", help="the engine (%(default)s)")
    return parser.parse_args()


def record(options: argparse.Namespace) -> int:
    settings = {"town": options.town, "tier": options.tier, "normalise": True}
    folders = {"maps": options.maps, "tasks": options.task_files, "program": options.program}
    if options.observation:
        settings["observation"] = options.observation
    about, episodes = play(
        options.task,
        policy.named(options.policy),
        name=options.policy,
        seeds=range(options.seed, options.seed + options.episodes),
        settings={**settings, **folders},
    )
    count = 0
    writing = write(options.out, about, episodes)
    try:
        for episode in writing:
            cause = CAUSES[int(episode.numbers["cause"])]
            print(
                f"seed {episode.seed}: {len(episode)} steps, return "
                f"{episode.numbers['return']:.2f}, {cause}, {episode.hashes[-1]:016x}"
            )
            count += 1
    except KeyboardInterrupt:
        print(f"interrupted: {options.out} has {count} whole episodes", file=sys.stderr)
        return 130
    finally:
        writing.close()
    print(f"{options.out}: {count} episodes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
