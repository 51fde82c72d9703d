"""Goal: episodes go on, and go the same way, when a router between a face and its world service
hangs, is killed or is cut off, and when a world service is.

Method: world services run as another user than faces, so that no shortcut leads past the bus. An
episode is played while something happens to what is between, and compared with one that was left
alone; `-s` prints how long the longest step took. `CAUSEWAY_CUT_SECS` says for how long a world
service stays cut off when its episode has ended, 0 s where it is not said.
"""

import contextlib
import os
import shutil
import signal
import tempfile
import time
from pathlib import Path

import causeway
import pytest

from networks import AS_NOBODY, NOBODY, need_root, network
from running_site import binary, two_free_ports
from watched import Service, eventually, figures, services

CONFIG = {"num_npc_vehicles": 2, "num_pedestrians": 2, "ticks_per_step": 2}
STEPS = 40
#: The transport gives a silent neighbour up after 2 s, and one that does not answer a greeting
#: after another; without our settings it would take 12 s. A busy machine gets the difference.
PAUSE_SECS_MAX = 9.0
CUT_SECS = float(os.environ.get("CAUSEWAY_CUT_SECS", "0"))


@pytest.fixture
def start(tmp_path):
    """Starts services; those of `another` user have a program that he may read."""
    need_root()
    folder = Path(tempfile.mkdtemp(prefix="causeway-"))
    folder.chmod(0o755)
    program = folder / "causeway"
    shutil.copy(binary(), program)
    program.chmod(0o755)

    with services(tmp_path) as begin:

        def started(*command: str, another: bool = False, within: tuple = (), **options):
            by = (*within, *(AS_NOBODY if another else ()))
            return begin(*command, by=by, program=program, **options)

        yield started
    shutil.rmtree(folder)


def router(start, *others: str, at: str = "127.0.0.1", port: int = 0, **options):
    """A router that joins others, and its address."""
    flags = [word for other in others for word in ("--connect", other)]
    address = f"tcp/{at}:{port or two_free_ports()}"
    started = start("router", "--listen", address, *flags, at=at, **options)
    started.until("/startupz", 200)
    return started, address


def world(start, *addresses: str, name: str = "a", **options) -> Service:
    flags = [word for address in addresses for word in ("--connect", address)]
    host = start("world", "--id", f"world-{name}", *flags, another=True, **options)
    host.until("/readyz", 200)
    return host


def face(start, *addresses: str) -> tuple[Service, str]:
    flags = [word for address in addresses for word in ("--connect", address)]
    scenario = start("scenario", "--http", "127.0.0.1:0", *flags)
    scenario.until("/readyz", 200)
    return scenario, "http://" + scenario.find(r"OpenEnv face listens address=(\S+)")


def play(url: str, happen=lambda: None) -> tuple[list, float]:
    """What an episode shows in which something happens in the middle, and the longest step then."""
    with causeway.Session(url) as session:
        step = session.reset("free_roam", scenario_config=CONFIG, seed=3, episode_id="e")
        seen, longest_secs = [step.observation], 0.0
        for index in range(STEPS):
            if index == STEPS // 2:
                happen()
            begun = time.monotonic()
            steer = 0.05 * (index % 3 - 1)
            seen.append(session.step("control", throttle=0.4, steer=steer).observation)
            if index >= STEPS // 2:
                longest_secs = max(longest_secs, time.monotonic() - begun)
    return seen, longest_secs


def lost(*watched: Service) -> float:
    """Routers that services have lost."""
    return sum(figures(service.admin)["causeway_bus_routers_lost_total"] for service in watched)


def goes_by_the_bus(scenario: Service) -> bool:
    return f"another user is refused uid={NOBODY}" in scenario.said()


@pytest.mark.parametrize("whose", ["face", "host"])
@pytest.mark.parametrize("sign", [signal.SIGSTOP, signal.SIGKILL], ids=["hung", "killed"])
def test_an_episode_goes_on_by_another_router(start, whose, sign):
    (first, one) = router(start)
    (second, two) = router(start, one)
    host = world(start, two, one)
    scenario, url = face(start, one, two)
    wanted, _ = play(url)
    assert goes_by_the_bus(scenario), scenario.said()
    gone = first if whose == "face" else second
    try:
        found, longest_secs = play(url, lambda: gone.process.send_signal(sign))
        assert found == wanted
        print(f"a router of the {whose} is {sign.name}: a step took {longest_secs:.2f} s")
        assert longest_secs < PAUSE_SECS_MAX
        eventually("loss that is counted", lambda: lost(scenario, host) >= 1)
        assert figures(scenario.admin)["causeway_scenario_episodes_lost_total"] == 0
        assert play(url)[0] == wanted
    finally:
        gone.process.send_signal(signal.SIGCONT)


def test_services_find_their_only_router_again_when_it_is_started_anew(start):
    port = two_free_ports()
    (old, address) = router(start, port=port)
    world(start, address)
    scenario, url = face(start, address)
    wanted, _ = play(url)

    def restart() -> None:
        old.process.kill()
        old.process.wait()
        router(start, port=port)

    found, longest_secs = play(url, restart)
    assert found == wanted
    print(f"the only router is started anew: a step took {longest_secs:.2f} s")
    assert figures(scenario.admin)["causeway_scenario_episodes_lost_total"] == 0
    eventually("connection", lambda: figures(scenario.admin)["causeway_bus_routers"] == 1)


def test_an_episode_goes_on_when_its_router_is_cut_off(start):
    with network() as elsewhere:
        (_, far) = router(start, at=elsewhere.address, within=elsewhere.within)
        (_, near) = router(start, far, at=elsewhere.here)
        host = world(start, far, near)
        scenario, url = face(start, far, near)
        wanted, _ = play(url)
        with contextlib.ExitStack() as end:
            end.callback(elsewhere.heal)
            found, longest_secs = play(url, elsewhere.cut)
            assert found == wanted
            print(f"a router is cut off: a step took {longest_secs:.2f} s")
            assert longest_secs < PAUSE_SECS_MAX
            eventually("loss that is counted", lambda: lost(scenario, host) >= 1)
        assert play(url)[0] == wanted


def test_the_worlds_of_a_service_that_is_cut_off_go_on_elsewhere_and_end_there(start):
    with network() as elsewhere:
        (_, address) = router(start, at=elsewhere.here)
        options = {"within": elsewhere.within, "at": elsewhere.address}
        far = world(start, address, name="far", **options)
        scenario, url = face(start, address)
        wanted, _ = play(url)
        near: list[Service] = []

        def cut() -> None:
            near.append(world(start, address, name="near"))
            elsewhere.cut()

        with contextlib.ExitStack() as end:
            end.callback(elsewhere.heal)
            found, longest_secs = play(url, cut)
            time.sleep(CUT_SECS)
        assert found == wanted
        print(f"a world service is cut off: a step took {longest_secs:.2f} s")
        assert longest_secs < PAUSE_SECS_MAX
        counted = figures(scenario.admin)
        assert counted["causeway_scenario_worlds_recovered_total"] == 1
        assert counted["causeway_scenario_episodes_lost_total"] == 0
        healed = time.monotonic()
        far.until("/readyz", 200)
        eventually("end of what was left", lambda: figures(far.admin)["causeway_world_worlds"] == 0)
        print(f"its worlds are freed {time.monotonic() - healed:.1f} s after it is back")
        # Both are of use again.
        assert play(url)[0] == wanted
