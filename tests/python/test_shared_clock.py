"""Several clients of CARLA in synchronous mode tick one world together."""

import subprocess
import sys
from pathlib import Path

import pytest

from carla_site import connect, synchronous

CLIENT = Path(__file__).parent / "ticking_client.py"
LEASE_SECS = 3.0
TICKS = 100


@pytest.fixture
def port(start_site):
    return start_site("--share-clock", str(LEASE_SECS)).carla_port


@pytest.fixture
def drivers(port):
    """Two clients that each have a car and have not ticked yet."""
    started = [
        subprocess.Popen(
            [sys.executable, CLIENT, str(port), str(place), str(TICKS)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for place in (0, 5)
    ]
    try:
        yield started
    finally:
        for driver in started:
            driver.kill()
            driver.wait()


def test_the_world_advances_once_when_all_have_ticked(port, drivers):
    with synchronous(connect(port).get_world()):
        for driver in drivers:
            assert driver.stdout.readline() == "ready\n"
        for driver in drivers:
            print("go", file=driver.stdin, flush=True)
        asked, metres = zip(
            *((d.stdout.readline().split(), float(d.stdout.readline())) for d in drivers),
            strict=True,
        )
    first, second = ([int(frame) for frame in frames] for frames in asked)
    both = set(first) & set(second)
    # Whoever ticks first is alone until the other's first tick.
    assert len(both) >= TICKS // 2, (first, second)
    together = sorted(both)
    assert together == list(range(together[0], together[-1] + 1))
    assert all(far > 3.0 for far in metres)


def test_who_crashes_is_waited_for_no_longer(port, drivers):
    with synchronous(connect(port).get_world()):
        for driver in drivers:
            assert driver.stdout.readline() == "ready\n"
        drivers[0].kill()
        print("go", file=drivers[1].stdin, flush=True)
        assert len(drivers[1].stdout.readline().split()) == TICKS
