"""Whoever subscribes to frames and then stands still holds up nobody's steps.

Method: eight sessions step without a pause; one subscriber of every kind that a stranger may be is
started beside them, hears frames, and is stopped by SIGSTOP, as a debugger or a full machine does;
then all of them at once. Each round beside one that is stopped is followed by a quiet one; `-s`
prints both. Whoever is stopped loses its links, as the processes that served it tell.
"""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from causeway import bus

from neighbours import Neighbours, Round, median_ratio

STRANGER = Path(__file__).with_name("stopping_subscriber.py")
KINDS = [("client", "no"), ("client", "yes"), ("peer", "no"), ("peer", "yes"), ("router", "no")]
SESSIONS = 8
#: A link that stands still is closed after two seconds.
LOOK_SECS = float(os.environ.get("CAUSEWAY_LOOK_SECS", "3"))
# Beside a stopped low-latency subscriber steps took 20 s, and none was done meanwhile.
RATIO_MAX = 3.0
#: Of the 99th percentile, which a busy machine spoils more.
RATIO_P99_MAX = 10.0
STEP_SECS_MAX = 10.0
#: A busy machine gets so much longer to close a link.
CLOSED_SECS_MAX = 60.0
# What else the machine does may spoil a round.
ATTEMPTS = 3
#: So many that every thread that serves links ends one of theirs at the same time.
CROWD = 12
#: From when they are stopped until their links have ended, and a little more.
CROWD_SECS = 15.0
# A socket whose other end takes nothing took ten seconds to close.
NEWCOMER_SECS_MAX = 6.0


def held_up(beside: Round, quiet: Round) -> bool:
    longest_secs = max(beside.steps_secs)
    return longest_secs > STEP_SECS_MAX or len(beside.steps_secs) < len(quiet.steps_secs) / 5


def established(process: int) -> set[tuple[int, int]]:
    """Connections that are open on this machine, by local and remote port."""
    found = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/{process}/net/{table}").read_text().splitlines()[1:]:
            _, here, there, state, *_ = line.split()
            if state == "01":
                found.add(tuple(int(address.rsplit(":", 1)[1], 16) for address in (here, there)))
    return found


def links_of(process: int) -> set[tuple[int, int]]:
    """Of a process, by local and remote port."""
    inodes = set()
    for handle in Path(f"/proc/{process}/fd").iterdir():
        with contextlib.suppress(OSError):
            inodes.add(os.readlink(handle))
    found = set()
    for line in Path(f"/proc/{process}/net/tcp").read_text().splitlines()[1:]:
        _, here, there, state, *_, inode = line.split()[:10]
        if state == "01" and f"socket:[{inode}]" in inodes:
            found.add(tuple(int(address.rsplit(":", 1)[1], 16) for address in (here, there)))
    return found


def assert_all_end(process: int, links: set[tuple[int, int]]) -> None:
    """Whoever serves these links of a process that is stopped closes them."""
    served = {(there, here) for here, there in links}
    assert links
    deadline = time.monotonic() + CLOSED_SECS_MAX
    while served & established(process):
        assert time.monotonic() < deadline, f"still open: {served & established(process)}"
        time.sleep(0.1)


@contextlib.contextmanager
def stopped_subscriber(endpoint: str, mode: str, low_latency: str):
    command = [sys.executable, STRANGER, endpoint, mode, low_latency]
    stranger = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert stranger.stdout.readline() == "hears\n", (mode, low_latency)
        links = links_of(stranger.pid)
        stranger.send_signal(signal.SIGSTOP)
        yield
        assert_all_end(stranger.pid, links)
    finally:
        stranger.kill()
        stranger.wait()


def test_subscribers_of_every_kind_that_are_stopped_hold_up_no_step(start_site):
    site = start_site("--no-render")
    beside, quiet = [], []
    with Neighbours(site.base_url, SESSIONS) as neighbours:
        for kinds in [*([kind] for kind in KINDS), KINDS]:
            for attempt in range(ATTEMPTS):
                with contextlib.ExitStack() as strangers:
                    for kind in kinds:
                        strangers.enter_context(stopped_subscriber(site.endpoint, *kind))
                    beside.append(neighbours.look(LOOK_SECS))
                quiet.append(neighbours.look(LOOK_SECS))
                print(f"{kinds}: beside them {beside[-1]}; then {quiet[-1]}")
                if not held_up(beside[-1], quiet[-1]):
                    break
                assert attempt + 1 < ATTEMPTS, (kinds, str(beside[-1]), str(quiet[-1]))
    p99 = median_ratio(beside, quiet, 0.99)
    print(f"p99 beside who is stopped / quiet: {p99:.2f}")
    assert median_ratio(beside, quiet, 0.5) < RATIO_MAX
    assert p99 < RATIO_P99_MAX


def test_who_comes_to_the_bus_while_links_of_many_that_stand_still_end_is_served(start_site):
    site = start_site("--no-render")
    waited = []
    with Neighbours(site.base_url, SESSIONS), contextlib.ExitStack() as strangers:
        for _ in range(CROWD):
            strangers.enter_context(stopped_subscriber(site.endpoint, "client", "no"))
        until = time.monotonic() + CROWD_SECS
        while time.monotonic() < until:
            begun = time.monotonic()
            with bus.subscribe(site.endpoint, connect_timeout_secs=60.0) as frames:
                frames.receive(timeout_secs=60.0)
            waited.append(time.monotonic() - begun)
    print(f"{len(waited)} newcomers; the longest waited {max(waited):.2f} s for a frame")
    assert max(waited) < NEWCOMER_SECS_MAX
