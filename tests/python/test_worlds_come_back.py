"""Goal: an episode outlives the service that has its world, and nobody can tell by what they see.

Method: play the same actions twice, once on a quiet site and once on one whose world service is
killed in the middle, and compare everything that is observed.
"""

import contextlib
import os
import signal
import subprocess
import threading
import time

import httpx
import pytest
from causeway import Session, SessionError

from running_site import START_SECS, binary, child, two_free_ports, wait_for

STEPS = 40
#: Steps before which the world service is killed; the last one comes after a new state was kept.
KILLED_BEFORE = (3, 4, 35)
#: So that a new state is kept before the last kill.
TICKS_A_STEP = 10
SESSIONS = 16


def play(url: str, before_step=lambda index: None, scenario: str = "free_roam") -> list:
    """What an episode shows, step by step."""
    seen = []
    with Session(url) as session:
        config = {"num_npc_vehicles": 4, "num_pedestrians": 4, "ticks_per_step": TICKS_A_STEP}
        step = session.reset(scenario, scenario_config=config, seed=7, episode_id="e")
        for index in range(STEPS):
            before_step(index)
            seen.append(step.observation)
            kind = ("observe", "maintain_speed", "brake_vehicle")[index % 3]
            arguments = {
                "observe": {},
                "maintain_speed": {"target_speed_kmh": 30.0},
                "brake_vehicle": {"brake_intensity": 0.2},
            }
            step = session.step(kind, **arguments[kind])
            if step.done:
                break
        seen.append(step.observation)
    return seen


def kill(site, service: str) -> None:
    os.kill(child(site, service), signal.SIGKILL)


def test_nobody_sees_that_the_world_service_was_killed(site, start_site):
    disturbed = start_site("--no-render")

    def kill_now_and_then(index: int) -> None:
        if index in KILLED_BEFORE:
            kill(disturbed, "world")

    wanted = play(site.base_url)
    assert play(disturbed.base_url, kill_now_and_then) == wanted
    said = disturbed.log.read_text(errors="replace")
    assert said.count("a world is made again") == len(KILLED_BEFORE)


def test_many_episodes_go_on_at_once(site, start_site):
    """All of them lose their world in the same moment."""
    disturbed = start_site("--no-render")
    wanted = play(site.base_url)
    results: dict[int, object] = {}
    # All wait before the step and go on when the service has been killed.
    gate = threading.Barrier(SESSIONS + 1, timeout=300)

    def wait_at_the_gate(index: int) -> None:
        if index in KILLED_BEFORE:
            gate.wait()
            gate.wait()

    def run(number: int) -> None:
        try:
            results[number] = play(disturbed.base_url, wait_at_the_gate)
        except BaseException as error:
            results[number] = error
            gate.abort()

    threads = [threading.Thread(target=run, args=(number,)) for number in range(SESSIONS)]
    for thread in threads:
        thread.start()
    for _ in KILLED_BEFORE:
        with contextlib.suppress(threading.BrokenBarrierError):
            gate.wait()
            kill(disturbed, "world")
            gate.wait()
    for thread in threads:
        thread.join(300)
    errors = [found for found in results.values() if isinstance(found, BaseException)]
    assert not errors, (errors, disturbed.said())
    for number in range(SESSIONS):
        assert results[number] == wanted


def test_without_memory_for_it_the_episode_ends(start_site):
    site = start_site("--no-render")
    port = two_free_ports()
    flags = ["--connect", site.endpoint, "--http", str(port), "--recovery-mib", "0"]
    process = subprocess.Popen([binary(), "scenario", *flags], stderr=subprocess.DEVNULL)
    try:
        url = f"http://127.0.0.1:{port}"
        wait_for(site, time.monotonic() + START_SECS, lambda: answers(url))
        with Session(url) as session:
            session.reset("trolley_saves", seed=7)
            kill(site, "world")
            with pytest.raises(SessionError, match="reset to start a new episode"):
                for _ in range(3):
                    session.step("observe")
            assert session.reset("trolley_saves", seed=7).observation
    finally:
        process.terminate()
        process.wait(60)


def answers(url: str) -> bool:
    try:
        return httpx.get(f"{url}/health", timeout=2.0).status_code == 200
    except httpx.HTTPError:
        return False
