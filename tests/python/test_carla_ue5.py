"""CARLA's client of Unreal Engine 5 sees what that of Unreal Engine 4 sees."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from running_site import two_free_ports

HERE = Path(__file__).parent


def run(port, folder=None, program=HERE / "either_client_session.py"):
    """A session with the client in a folder, or the one that the tests have."""
    path = [str(folder)] if folder else []
    return subprocess.run(
        [sys.executable, program, str(port), str(two_free_ports())],
        env={**os.environ, "PYTHONPATH": os.pathsep.join([*path, str(HERE)])},
        capture_output=True,
        text=True,
        timeout=300,
    )


@pytest.fixture
def both(start_site):
    """Ports of two endpoints of one site, and the site: for clients of 0.9 and of 0.10."""
    old, new = two_free_ports(), two_free_ports()
    return old, new, start_site("--carla", f"{old},{new}@0.10")


#: Which reason a client can tell for a place that is taken.
REFUSALS = {
    "0.9.16": "Spawn failed because of collision at spawn position",
    "0.10.0": "std::exception",
}


def test_both_clients_see_the_same(both, ue5_client):
    old, new, site = both
    runs = {"0.9.16": run(old), "0.10.0": run(new, ue5_client)}
    told = {}
    for version, session in runs.items():
        assert session.returncode == 0, f"{version}: {session.stderr[-4000:]}"
        # No warning that versions differ.
        assert "mismatch" not in session.stderr, session.stderr
        told[version] = json.loads(session.stdout.splitlines()[-1])
        own = told[version]["own"]
        assert (own["client"], own["server"]) == (version, version)
        assert (own["mass"], own["second mass"]) == (1500.0, 1600.0)
        assert min(own["driven"]) > 5.0 and min(own["walked"]) > 2.0, own
        assert own["bones"] > 50
        assert own["refusal"] == REFUSALS[version]
        assert own["recording"] == ["Version: 2", "Map: Town02"]
        assert own["replay"].startswith("Replaying File: ")
        assert own["loaded"].endswith("Town01")
    assert REFUSALS["0.9.16"] in site.log.read_text(), "who cannot say it has it in the log"
    seen = [session["seen"] for session in told.values()]
    assert seen[0].keys() == seen[1].keys()
    for part, old_seen in seen[0].items():
        new_seen = seen[1][part]
        differing = [name for name in old_seen if old_seen[name] != new_seen[name]]
        assert not differing, {name: (old_seen[name], new_seen[name]) for name in differing}


def test_the_log_says_which_endpoint_a_client_wants_that_ends_at_the_first_frame(
    both, ue5_client, tmp_path
):
    old, new, site = both
    program = tmp_path / "wrong_endpoint.py"
    program.write_text(
        "import sys, carla\n"
        "client = carla.Client('127.0.0.1', int(sys.argv[1]))\n"
        "client.set_timeout(20.0)\n"
        "client.get_world()\n"
        "print('alive')\n"
    )
    for port, folder, wanted in [(old, ue5_client, "PORT@0.10"), (new, None, "PORT@0.9")]:
        session = run(port, folder, program)
        assert "Version mismatch detected" in session.stderr
        # By `std::bad_array_new_length` or a segmentation fault.
        assert session.returncode != 0 and "alive" not in session.stdout
        deadline = time.monotonic() + 20.0
        while wanted not in site.log.read_text():
            assert time.monotonic() < deadline, site.said()
            time.sleep(0.1)
    for port, folder in [(old, None), (new, ue5_client)]:
        assert "alive" in run(port, folder, program).stdout


def test_a_program_finds_the_vehicles_of_0_10_by_their_ids(both, ue5_client, tmp_path):
    old, new, _ = both
    program = tmp_path / "names.py"
    program.write_text(
        "import json, sys, carla\n"
        "client = carla.Client('127.0.0.1', int(sys.argv[1]))\n"
        "client.set_timeout(60.0)\n"
        "world = client.get_world()\n"
        "library = world.get_blueprint_library()\n"
        "told = {}\n"
        "names = ['vehicle.mini.cooper', 'vehicle.taxi.ford', 'vehicle.ford.crown']\n"
        "places = world.get_map().get_spawn_points()\n"
        "for name, place in zip(names, places):\n"
        "    if len(library.filter(name)) == 1:\n"
        "        car = world.spawn_actor(library.find(name), place)\n"
        "        told[name] = [car.type_id, world.get_actor(car.id).type_id]\n"
        "        told[name].append(car.attributes['ros_name'])\n"
        "ids = [blueprint.id for blueprint in library]\n"
        "assert len(set(ids)) == len(ids)\n"
        "print(json.dumps(told))\n"
    )
    names = ["vehicle.mini.cooper", "vehicle.taxi.ford", "vehicle.ford.crown"]
    for port, folder, known in [(new, ue5_client, names), (old, None, names[2:])]:
        session = run(port, folder, program)
        assert session.returncode == 0, session.stderr
        told = json.loads(session.stdout.splitlines()[-1])
        assert told == {name: [name] * 3 for name in known}
