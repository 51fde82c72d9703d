"""Goal: a recording goes on when the world service that has its world is killed, exactly.

Method: kill it while a client records, then replay the recording to the bit and branch from before
and after its death.
"""

import math
import os
import re
import signal

import carla
import pytest

from carla_log import POSITION
from carla_site import STEP_SECS, fresh, synchronous, ticks
from recorded_drive import drive, finished, seen, shows
from running_site import child
from test_exact_recordings import folder, told

TICKS = 100
KILLED_BEFORE = (30, 60)
SAID = "a world is made again"


@pytest.fixture
def interrupted(start_site):
    """A recording whose world service was killed twice, its cars, and the client."""
    site = start_site("--no-render")
    client = fresh(site.carla_port)
    with synchronous(client.get_world()) as world:
        cars = drive(world)
        ticks(world, 2)
        client.start_recorder("interrupted.log", True)
        for tick in range(TICKS):
            if tick in KILLED_BEFORE:
                os.kill(child(site, "world"), signal.SIGKILL)
            cars[0].apply_control(carla.VehicleControl(throttle=0.6, steer=0.2 * (tick % 3 - 1)))
            world.tick()
        path = folder(site) / "interrupted.log"
        log = finished(client, path)
        assert site.log.read_text(errors="replace").count(SAID) == len(KILLED_BEFORE)
        yield client, world, path, log, [car.id for car in cars]


def test_a_recording_goes_on_in_the_world_that_is_made_again(interrupted):
    _, _, path, log, cars = interrupted
    assert [frame.number for frame in log.frames] == list(range(1, TICKS + 1))
    assert all(set(cars) <= frame.by_actor(POSITION).keys() for frame in log.frames)
    assert {"journal", "2.journal", "3.journal"} == {
        name.name.removeprefix(f"{path.name}.") for name in path.parent.glob(f"{path.name}.*")
    }
    said = told("replay", path)
    compared = int(re.search(r": (\d+) frames, 0 differences", said)[1])
    missing = re.search(r"(\d+) frames more are in no journal", said)
    # What the killed service had not yet given to the disk is said.
    assert compared + (int(missing[1]) if missing else 0) == TICKS
    assert compared >= TICKS - KILLED_BEFORE[0]
    assert said.count("the same to the bit") == 1 + len(KILLED_BEFORE)


def test_a_branch_goes_on_from_before_and_after_the_death(interrupted):
    client, world, path, log, cars = interrupted
    for frame in (10, 75):
        client.replay_file(str(path), (frame - 1) * STEP_SECS, 0.0, 0)
        ticks(world, 1)
        assert shows(world, log.frames[frame], cars)
        client.stop_replayer(True)
        now = seen(world, world.tick())
        # Where the recorded world went from there.
        x, y, *_ = log.frames[frame + 1].by_actor(POSITION)[cars[1]]
        place = now[cars[1]].location
        assert math.dist((x, y), (place.x * 100, place.y * 100)) < 1.0
