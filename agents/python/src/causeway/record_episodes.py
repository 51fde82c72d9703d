"""Records episodes of a task, driven by a policy, as an MCAP file.

Prints a line for each. Ctrl-C leaves the episodes that are whole, and says how many; without any
there is no file.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from causeway import policy
from causeway.bus import DEFAULT_ENDPOINT
from causeway.commands import INTERRUPTED, add_engine, ended, engine, want_new
from causeway.dataset import play
from causeway.evaluate.episodes import CAUSES
from causeway.pictures import Camera, Renderer


def main() -> int:
    options = parse_arguments()
    return ended("causeway.record_episodes", lambda: opened(options))


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m causeway.record_episodes", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("task", help="e.g. lane-keep, corl17-straight")
    parser.add_argument("--episodes", type=int, default=20, help="(%(default)s)")
    parser.add_argument("--seed", type=int, default=0, help="of the first (0); then the next ones")
    parser.add_argument("--town", default="Town02", help="(%(default)s)")
    tiers = ["kinematic", "physics"]
    parser.add_argument("--tier", default="physics", choices=tiers, help="(%(default)s)")
    names = f"{', '.join(policy.NAMES)}, FILE.npz (%(default)s)"
    parser.add_argument("--policy", default="follow", help=names)
    told = "route, drive or wide; by default what the policy reads"
    parser.add_argument("--observation", help=told)
    parser.add_argument(
        "--camera", type=camera, metavar="WIDTHxHEIGHT", help="pictures of it, in pixels"
    )
    parser.add_argument(
        "--bus", default=DEFAULT_ENDPOINT, help="of the site that draws (%(default)s)"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.mcap")
    add_engine(parser)
    return parser.parse_args()


def camera(text: str) -> Camera:
    try:
        return Camera.parse(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def opened(options: argparse.Namespace) -> int:
    want_new(options.out)
    if options.camera is None:
        return record(options, None)
    with Renderer(options.bus) as renderer:
        return record(options, (renderer, options.camera))


def record(options: argparse.Namespace, seen: tuple[Renderer, Camera] | None) -> int:
    from causeway.dataset import write

    settings = {"town": options.town, "tier": options.tier, "normalise": True}
    if options.observation:
        settings["observation"] = options.observation
    about, episodes = play(
        options.task,
        policy.named(options.policy),
        name=options.policy,
        seeds=range(options.seed, options.seed + options.episodes),
        settings={**settings, **engine(options)},
        seen=seen,
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
        left = f"{options.out} has {count} whole episodes"
        told = left if options.out.exists() else "nothing is written, as no episode is whole"
        print(f"interrupted: {told}", file=sys.stderr)
        return INTERRUPTED
    finally:
        writing.close()
    print(f"{options.out}: {count} episodes")
    return 0


if __name__ == "__main__":
    sys.exit(main())
