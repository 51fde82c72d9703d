"""Worlds whose ticks take longer than their period: everybody is served, nobody pays in vain.

Method: a client adds lidars until the world is many times slower than its period on this machine.
"""

import os
import time
from pathlib import Path

import pytest
from causeway import bus

from carla_site import connect
from running_site import wait_for
from test_carla_clients import another_client, child, eventually

FPS = 300
CALLS = 10
#: A call waits for at most one tick; on a busy machine such a tick may take a second.
BOUND_SECS = 5.0
SOON_SECS = 60.0
STILL_SECS = 2.0
FRAMES = 60


def cpu_secs(process: int) -> float:
    """What a process has computed so far."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def cpu_secs_per_frame(process: int, world) -> float:
    """What a world's frames cost at its own pace, which is the same on a busy machine."""
    before, first = cpu_secs(process), world.wait_for_tick().frame
    while (last := world.wait_for_tick().frame) < first + FRAMES:
        pass
    return (cpu_secs(process) - before) / (last - first)


@pytest.fixture
def overloaded(start_site):
    """A site whose world cannot keep up, and the client for whom it measures."""
    site = start_site("--no-render", f"-fps={FPS}")
    with another_client(site.carla_port, "overloading", str(FPS)) as client:
        yield site, client


def test_calls_are_answered_while_ticks_take_longer_than_their_period(overloaded):
    site, _ = overloaded
    world = connect(site.carla_port).get_world()
    waits = []
    for _ in range(CALLS):
        began = time.monotonic()
        world.get_weather()
        waits.append(time.monotonic() - began)
    assert max(waits) < BOUND_SECS, waits
    log = site.log
    wait_for(site, time.monotonic() + SOON_SECS, lambda: "slower than time" in log.read_text())


def test_a_world_that_everybody_has_left_stands_still_and_serves_who_comes(overloaded):
    site, client = overloaded
    with bus.subscribe(site.endpoint) as frames:
        assert frames.receive(timeout_secs=SOON_SECS).actors.size
        client.kill()
        deadline = time.monotonic() + SOON_SECS
        with pytest.raises(TimeoutError):
            while time.monotonic() < deadline:
                frames.receive(timeout_secs=STILL_SECS)
    world = eventually(connect(site.carla_port).get_world)
    frame = world.wait_for_tick().frame
    assert world.wait_for_tick().frame > frame


def test_sensors_whose_listener_has_gone_measure_nothing(start_site):
    """Another client stays, and the world goes on."""
    site = start_site("--no-render")
    service = child(site, "world")
    world = connect(site.carla_port).get_world()
    with another_client(site.carla_port, "measuring"):
        measuring_secs = cpu_secs_per_frame(service, world)
    deadline = time.monotonic() + SOON_SECS
    while (left_secs := cpu_secs_per_frame(service, world)) > measuring_secs / 3:
        assert time.monotonic() < deadline, (measuring_secs, left_secs)
