"""Whoever subscribes to frames and then stands still holds up nobody's steps.

Method: eight sessions step without a pause; one subscriber of every kind that a stranger may be is
started beside them, hears frames, and is stopped by SIGSTOP, as a debugger or a full machine does.
Each round beside one that is stopped is followed by a quiet one; `-s` prints both.
"""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

from neighbours import Neighbours, Round, median_ratio

STRANGER = Path(__file__).with_name("stopping_subscriber.py")
KINDS = [("client", "no"), ("client", "yes"), ("peer", "no"), ("peer", "yes")]
SESSIONS = 8
#: A link that stands still is closed after two seconds.
LOOK_SECS = float(os.environ.get("CAUSEWAY_LOOK_SECS", "3"))
# Beside a stopped low-latency subscriber steps took 20 s, and none was done meanwhile.
RATIO_MAX = 3.0
STEP_SECS_MAX = 10.0
# What else the machine does may spoil a round.
ATTEMPTS = 3


def held_up(beside: Round, quiet: Round) -> bool:
    longest_secs = max(beside.steps_secs)
    return longest_secs > STEP_SECS_MAX or len(beside.steps_secs) < len(quiet.steps_secs) / 5


@contextlib.contextmanager
def stopped_subscriber(endpoint: str, mode: str, low_latency: str):
    command = [sys.executable, STRANGER, endpoint, mode, low_latency]
    stranger = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert stranger.stdout.readline() == "hears\n", (mode, low_latency)
        stranger.send_signal(signal.SIGSTOP)
        yield
    finally:
        stranger.kill()
        stranger.wait()


def test_subscribers_of_every_kind_that_are_stopped_hold_up_no_step(start_site):
    site = start_site("--no-render")
    beside, quiet = [], []
    with Neighbours(site.base_url, SESSIONS) as neighbours:
        for kind in KINDS:
            for attempt in range(ATTEMPTS):
                with stopped_subscriber(site.endpoint, *kind):
                    beside.append(neighbours.look(LOOK_SECS))
                quiet.append(neighbours.look(LOOK_SECS))
                print(f"{kind}: beside it {beside[-1]}; then {quiet[-1]}")
                if not held_up(beside[-1], quiet[-1]):
                    break
                assert attempt + 1 < ATTEMPTS, (kind, str(beside[-1]), str(quiet[-1]))
    print(f"p99 beside one that is stopped / quiet: {median_ratio(beside, quiet, 0.99):.2f}")
    assert median_ratio(beside, quiet, 0.5) < RATIO_MAX
