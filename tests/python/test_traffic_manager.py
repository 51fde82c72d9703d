"""CARLA's own Traffic Manager drives fifty cars, each run in a process of its own."""

import contextlib
import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest

from running_site import healthy, stop, two_free_ports, wait_for

pytest.importorskip("carla", reason="the client is not installed")

SESSION = Path(__file__).parent / "traffic_session.py"
CHANGING = Path(__file__).parent / "changing_session.py"
LOADING = Path(__file__).parent / "loading_session.py"
LEAVING = Path(__file__).parent / "leaving_session.py"
#: What a car may stand over the edge of its lane in a curve: the client looks at its middle.
OVER_THE_EDGE_M = 1.5
#: The Traffic Manager brakes behind the sign, not before it.
SLOWING_DOWN_SECS = 4.0
ATTEMPTS = 3


def drive(
    site,
    name: str,
    *,
    vehicles: int,
    ticks: int,
    mode: str = "synchronous",
    tm_port: int | None = None,
    environment: dict | None = None,
) -> dict:
    ports = [str(site.carla_port), str(tm_port or two_free_ports())]
    command = [sys.executable, SESSION, *ports, name, str(vehicles), str(ticks), mode]
    environment = os.environ | (environment or {})
    run = subprocess.run(command, capture_output=True, text=True, timeout=600, env=environment)
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout.splitlines()[-1]) | {"said": run.stderr}


@pytest.mark.parametrize("name", ["Town03", "Town10HD"])
def test_fifty_cars_keep_to_the_road_the_limits_and_the_lights(site, name):
    cars = drive(site, name, vehicles=50, ticks=2000)["cars"]
    assert len(cars) == 50
    standing = [car for car in cars if car["way_m"] < 50.0]
    assert not standing, standing
    astray = [car for car in cars if car["off_road_m"] > OVER_THE_EDGE_M]
    assert not astray, astray
    fast = [car for car in cars if car["too_fast_secs"] > SLOWING_DOWN_SECS]
    assert not fast, fast
    assert not [car for car in cars if car["reds_run"]]
    hurt = [car for car in cars if any(hit.startswith("static.") for hit in car["hits"])]
    assert not hurt, hurt


def test_two_hundred_cars_drive_for_a_thousand_ticks(site):
    cars = drive(site, "Town05", vehicles=200, ticks=1000)["cars"]
    assert len(cars) == 200
    standing = [car for car in cars if car["way_m"] < 20.0]
    assert len(standing) < 20, standing


def test_the_same_seed_drives_the_same_way(site):
    first, second = (drive(site, "Town10HD", vehicles=20, ticks=200)["trace"] for run in range(2))
    assert first == second


def losing_signals(folder: Path, every: int) -> dict:
    source, library = SESSION.with_name("lose_signals.c"), folder / "lose_signals.so"
    subprocess.run(["cc", "-shared", "-fPIC", source, "-o", library, "-ldl"], check=True)
    return {"LD_PRELOAD": str(library), "LOSE_EVERY": str(every)}


def test_a_signal_that_the_client_loses_stops_nobody(site, tmp_path):
    town = {"name": "Town10HD", "vehicles": 10, "ticks": 150}
    losing, trace = losing_signals(tmp_path, every=60), drive(site, **town)["trace"]
    # On a machine that is busy, a step that was waited for may come a frame late.
    for _ in range(ATTEMPTS):
        disturbed = drive(site, **town, environment=losing)
        assert disturbed["said"].count("lost signal") >= 2
        if disturbed["trace"] == trace:
            return
    pytest.fail(f"{ATTEMPTS} drives with lost signals went another way than one without")


def test_a_signal_that_is_lost_when_settings_change_stops_nobody(site, tmp_path):
    # The last signal of this drive is that of its change back to asynchronous mode.
    losing = losing_signals(tmp_path, every=22)
    disturbed = drive(site, "Town10HD", vehicles=5, ticks=18, environment=losing)
    assert disturbed["said"].count("lost signal") == 1


def test_far_cars_are_led_and_keep_to_the_road(site):
    cars = drive(site, "Town10HD", vehicles=30, ticks=500, mode="hybrid")["cars"]
    assert min(car["way_m"] for car in cars) > 5.0
    assert max(car["off_road_m"] for car in cars) < OVER_THE_EDGE_M


def test_cars_drive_at_the_worlds_own_pace(site):
    cars = drive(site, "Town10HD", vehicles=20, ticks=200, mode="asynchronous")["cars"]
    moving = [car for car in cars if car["way_m"] > 5.0]
    assert len(moving) > 10, cars
    assert max(car["off_road_m"] for car in cars) < OVER_THE_EDGE_M


@pytest.mark.parametrize("mode", ["synchronous", "asynchronous"])
def test_a_traffic_manager_drives_on_each_map_that_its_client_loads(site, mode):
    ports = [str(site.carla_port), str(two_free_ports())]
    command = [sys.executable, CHANGING, *ports, mode]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert run.returncode == 0, run.stderr[-2000:]
    seen = json.loads(run.stdout.splitlines()[-1])
    assert [town["town"].rsplit("/", 1)[-1] for town in seen] == [
        "Town02",
        "Town10HD_Opt",
        "Town10HD_Opt",
        "Town01",
    ]
    assert all(town["longest_way_m"] > 3.0 for town in seen), seen
    assert all(town["farthest_m"] < OVER_THE_EDGE_M for town in seen), seen


def test_two_clients_load_at_once_while_a_traffic_manager_runs_in_each(site):
    """One that is about a new map when that is replaced ends its client."""
    runs = []
    for seed in ("8165", "8166"):
        ports = [str(site.carla_port), str(two_free_ports())]
        command = [sys.executable, LOADING, *ports, seed]
        runs.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
    said = [run.communicate(timeout=600)[0] for run in runs]
    assert [run.returncode for run in runs] == [0, 0]
    assert said == ["4\n", "4\n"]


def test_a_car_can_be_destroyed_while_a_traffic_manager_drives_it(site):
    """The client ends when its Traffic Manager is in the middle of a step with the car."""
    command = [sys.executable, LEAVING, str(site.carla_port), str(two_free_ports())]
    run = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert (run.returncode, run.stdout) == (0, "12\n"), run.stderr[-2000:]


def test_a_traffic_manager_may_have_the_port_of_the_openenv_face(start_site):
    """Both have port 8000 by default, on the same machine."""
    site = start_site("--no-render")
    port = int(site.base_url.rsplit(":", 1)[1])
    connected = httpx.Client(
        base_url=site.base_url, timeout=60.0, limits=httpx.Limits(keepalive_expiry=600.0)
    )
    assert connected.get("/health").json() == {"status": "healthy"}
    drive(site, "Town10HD", vehicles=2, ticks=5, tm_port=port)
    # Who was connected before stays so, and the door opens again.
    assert connected.get("/health").json() == {"status": "healthy"}
    wait_for(site, time.monotonic() + 60.0, lambda: healthy(site.base_url))


def test_sites_with_the_same_port_lend_it_one_after_the_other(start_site):
    """The second one waits for the port, and lends it as soon as it has it, without a restart."""
    port = usual_port()
    flags = ("--no-render", "--http", f"127.0.0.1:{port}")
    first, second = start_site(*flags), start_site(*flags)
    assert "another program has the port" in second.said()
    drive(second, "Town10HD", vehicles=2, ticks=5, tm_port=port)
    wait_for(first, time.monotonic() + 60.0, lambda: healthy(first.base_url))
    stop(first)
    wait_for(second, time.monotonic() + 60.0, lambda: healthy(second.base_url))
    drive(second, "Town10HD", vehicles=2, ticks=5, tm_port=port)
    wait_for(second, time.monotonic() + 60.0, lambda: healthy(second.base_url))


def usual_port() -> int:
    """The one that the wheel's Traffic Manager has when nobody says another one, if it is free."""
    with socket.socket() as probe, contextlib.suppress(OSError):
        probe.bind(("0.0.0.0", 8000))
        return 8000
    return two_free_ports()


def test_who_forgets_to_tell_the_traffic_manager_of_synchronous_mode_is_told_of_it(start_site):
    """Nothing stands still meanwhile."""
    site = start_site("--no-render")
    warning = "a Traffic Manager is in asynchronous mode while its client ticks"
    drive(site, "Town10HD", vehicles=20, ticks=100)
    assert warning not in site.log.read_text(errors="replace")
    drive(site, "Town10HD", vehicles=20, ticks=40, mode="forgotten")
    assert warning in site.log.read_text(errors="replace")
