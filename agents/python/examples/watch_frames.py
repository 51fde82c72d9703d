"""Prints the speed of every vehicle of every running world, as the frames come.

causeway up
python examples/watch_frames.py
"""

from __future__ import annotations

import argparse
import sys

from causeway import frames
from causeway.bus import DEFAULT_ENDPOINT, DEFAULT_TENANT, subscribe


def main() -> int:
    options = parse_arguments()
    try:
        with subscribe(
            options.endpoint, tenant=options.tenant, world=options.world
        ) as subscription:
            for _ in range(options.count):
                print(describe(subscription.receive(timeout_secs=options.timeout_secs)), flush=True)
                if subscription.dropped:
                    print(f"  {subscription.dropped} frames dropped so far")
    except KeyboardInterrupt:
        return 0
    except (ConnectionError, TimeoutError) as error:
        print(f"watch_frames: {error}", file=sys.stderr)
        return 1
    return 0


def parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--endpoint", default=DEFAULT_ENDPOINT, help="default: %(default)s")
    parser.add_argument("--tenant", default=DEFAULT_TENANT, help="default: %(default)s")
    parser.add_argument("--world", type=int, help="one world's number; default: all")
    parser.add_argument(
        "--count", type=int, default=100, help="frames to print; default: %(default)s"
    )
    parser.add_argument(
        "--timeout-secs", type=float, help="give up after this time without a frame"
    )
    return parser.parse_args()


def describe(frame: frames.Frame) -> str:
    cars = frame.actors["kind"] == frames.VEHICLE
    speeds = ", ".join(f"{speed:.1f}" for speed in frame.speeds_mps()[cars])
    return (
        f"world {frame.world} tick {frame.tick} ({frame.time_secs:.2f} s): "
        f"vehicles at {speeds or 'none'} m/s, {len(frame.collisions)} contacts"
    )


if __name__ == "__main__":
    sys.exit(main())
