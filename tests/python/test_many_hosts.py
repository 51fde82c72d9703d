"""Goal: worlds are spread over the world services of a bus, and outlive each of them.

Method: episodes on several world services as processes of their own, one of which is killed,
compared with the same episodes that are left alone.
"""

import contextlib
import json
import os
import signal
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import causeway
import pytest

from running_site import two_free_ports
from watched import Service, bus, eventually, figures

HOSTS = 3
SESSIONS = 24
STEPS = 12
#: Each step is several ticks, so that worlds are kept by a state and what was done since.
TICKS_A_STEP = 10
CONFIG = {"num_npc_vehicles": 2, "num_pedestrians": 2, "ticks_per_step": TICKS_A_STEP}


def worlds(host: Service) -> int:
    return int(figures(host.admin)["causeway_world_worlds"])


def address_of(face: Service) -> str:
    return "http://" + face.find(r"OpenEnv face listens address=(\S+)")


def actions(lines: Path) -> Counter:
    """How often what was done, as written down."""
    return Counter(json.loads(line)["action"] for line in lines.read_text().splitlines())


def start_face(start, *flags) -> tuple[Service, str]:
    face = start("scenario", "--http", "127.0.0.1:0", *flags)
    face.until("/readyz", 200)
    return face, address_of(face)


def act(session: causeway.Session, index: int):
    """One of a few things to do, which all show in what is observed later."""
    if index % 2:
        return session.step("control", throttle=0.4, steer=0.05 * (index % 3 - 1))
    return session.step("maintain_speed", target_speed_kmh=20.0 + index)


def play(url: str, number: int, gate: threading.Barrier | None = None) -> list:
    """What an episode shows; at the gate all wait in the middle of it."""
    with causeway.Session(url) as session:
        seed = number % 4
        step = session.reset("free_roam", scenario_config=CONFIG, seed=seed, episode_id="e")
        seen = [step.observation]
        for index in range(STEPS):
            if gate and index == STEPS // 2:
                gate.wait()
                gate.wait()
            seen.append(act(session, index).observation)
        return seen


def test_worlds_are_spread_and_nobody_sees_that_a_host_was_killed(tmp_path):
    with bus(tmp_path) as start:
        hosts = [start("world", "--id", f"world-{name}") for name in "abc"]
        for host in hosts:
            host.until("/readyz", 200)
        face, url = start_face(start)
        wanted = [play(url, number) for number in range(4)]
        eventually("end of these worlds", lambda: sum(map(worlds, hosts)) == 0)
        gate = threading.Barrier(SESSIONS + 1, timeout=300)
        with ThreadPoolExecutor(SESSIONS) as pool:
            playing = [pool.submit(play, url, number, gate) for number in range(SESSIONS)]
            gate.wait()
            spread = [worlds(host) for host in hosts]
            assert sum(spread) == SESSIONS
            # A coin alone would leave a host with fewer than this in one of some hundred runs.
            assert min(spread) >= SESSIONS // HOSTS // 2, spread
            hosts[0].process.kill()
            gate.wait()
            found = [done.result(300) for done in playing]
        for number, seen in enumerate(found):
            assert seen == wanted[number % 4], number
        counted = figures(face.admin)
        assert counted["causeway_scenario_worlds_recovered_total"] == spread[0]
        assert counted["causeway_scenario_episodes_lost_total"] == 0
        eventually("no world that nobody uses", lambda: sum(map(worlds, hosts[1:])) == 0)


def test_a_host_that_joins_gets_worlds_and_a_full_one_leaves_them_to_others(tmp_path):
    with bus(tmp_path) as start:
        small = start("world", "--id", "world-a", "--worlds-max", "2")
        small.until("/readyz", 200)
        _, url = start_face(start)
        sessions = [causeway.Session(url) for _ in range(8)]
        try:
            for session in sessions[:2]:
                session.reset("trolley_saves", seed=1)
            large = start("world", "--id", "world-b")
            large.until("/readyz", 200)

            def has_reset(session: causeway.Session) -> bool:
                # The face hears a moment later that there is another one.
                with contextlib.suppress(causeway.SessionError):
                    return bool(session.reset("trolley_saves", seed=1))
                return False

            for session in sessions[2:]:
                eventually("world", lambda session=session: has_reset(session))
            assert (worlds(small), worlds(large)) == (2, 6)
            for session in sessions:
                session.step()
        finally:
            for session in sessions:
                session.close()


def test_nobody_waits_for_a_host_that_stands_still_but_who_has_a_world_there(tmp_path):
    with bus(tmp_path) as start, contextlib.ExitStack() as sessions:
        hosts = [start("world", "--id", f"world-{name}") for name in "ab"]
        for host in hosts:
            host.until("/readyz", 200)
        _, url = start_face(start)
        there: dict[int, list[causeway.Session]] = {0: [], 1: []}
        while min(map(len, there.values())) < 2:
            before = worlds(hosts[0])
            session = sessions.enter_context(causeway.Session(url))
            session.reset("free_roam", scenario_config=CONFIG, seed=1)
            there[0 if worlds(hosts[0]) > before else 1].append(session)
        with ThreadPoolExecutor(8) as pool:
            os.kill(hosts[0].process.pid, signal.SIGSTOP)
            try:
                # A few ticks each, so that steps of all sessions go together where they can.
                waiting = [pool.submit(session.step) for session in there[0]]
                time.sleep(0.5)
                begun = time.monotonic()
                for _ in range(20):
                    steps = [pool.submit(session.step) for session in there[1]]
                    assert all(step.result(60) for step in steps)
                taken_secs = time.monotonic() - begun
                assert not any(step.done() for step in waiting)
            finally:
                os.kill(hosts[0].process.pid, signal.SIGCONT)
            # Who stood still is not gone, and its worlds are as they were.
            assert all(step.result(60) for step in waiting)
        # The stopped host would be waited for until its deadline, 10 s.
        assert taken_secs < 5.0, taken_secs


def test_a_host_that_ends_gives_its_worlds_to_others_and_nobody_waits_long(tmp_path):
    with bus(tmp_path) as start:
        audits = {name: tmp_path / f"audit-{name}" for name in ("a", "b", "face")}
        hosts = [
            start("world", "--id", f"world-{name}", "--drain-secs", "120", "--audit", audits[name])
            for name in "ab"
        ]
        for host in hosts:
            host.until("/readyz", 200)
        face, url = start_face(start, "--audit", audits["face"])
        wanted = [play(url, number) for number in range(4)]
        gate = threading.Barrier(SESSIONS + 1, timeout=300)
        with ThreadPoolExecutor(SESSIONS) as pool:
            playing = [pool.submit(play, url, number, gate) for number in range(SESSIONS)]
            gate.wait()
            there = worlds(hosts[0])
            assert there > 0
            hosts[0].terminate()
            # Nobody steps: worlds move also from sessions whose clients think.
            assert hosts[0].ended() == 0
            assert "lost=0" in hosts[0].said()
            gate.wait()
            found = [done.result(300) for done in playing]
        for number, seen in enumerate(found):
            assert seen == wanted[number % 4], number
        counted = figures(face.admin)
        moved = counted["causeway_scenario_move_seconds_count"]
        assert (moved, counted["causeway_scenario_worlds_recovered_total"]) == (there, 0)
        times = "causeway_scenario_move_seconds"
        within = {ms: counted[f"{times}_bucket{{le={ms / 1e3}}}"] for ms in (10, 20, 50)}
        mean_ms = 1e3 * counted[f"{times}_sum"] / moved
        print(f"{there} worlds moved, {mean_ms:.1f} ms each on average; by ms: {within}")
        assert actions(audits["face"] / "scenario.jsonl")["move world"] == there
        did = actions(audits["a"] / "world.jsonl")
        assert min(did["make world"], did["destroy world"]) >= there
        assert did["drain to end"] == 1


def test_the_world_of_an_idle_carla_client_moves(tmp_path):
    carla_site = pytest.importorskip("carla_site", reason="the client is not installed")
    with bus(tmp_path) as start:
        old = start("world", "--id", "world-a", "--drain-secs", "120")
        old.until("/readyz", 200)
        port = two_free_ports()
        gateway = start("gateway", "--port", str(port), "--recordings", str(tmp_path / "logs"))
        gateway.until("/readyz", 200)
        world = carla_site.connect(port).get_world()
        with carla_site.synchronous(world):
            car = carla_site.spawn_car(world)
            _, measured = carla_site.attach(world, car, "sensor.other.imu")
            frame = carla_site.ticks(world, 3)
            new = start("world", "--id", "world-b")
            new.until("/readyz", 200)
            old.terminate()
            assert old.ended() == 0
            assert "lost=0" in old.said()
            assert worlds(new) == 1
            for count in range(1, 6):
                assert world.tick() == frame + count
            assert world.get_snapshot().find(car.id) is not None
            eventually("measurement", lambda: measured.get(timeout=60.0).frame == frame + 5)
        counted = figures(gateway.admin)
        assert counted["causeway_gateway_move_seconds_count"] == 1
        assert counted["causeway_gateway_worlds_recovered_total"] == 0
