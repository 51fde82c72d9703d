"""Goal: no episode is lost, and each is the same to the bit, while world services go.

Method: episodes of OpenEnv and of CARLA's client are played while one of two world services after
the other is killed, or told to end, and gets a successor; what is seen is compared with episodes on
a quiet site. CAUSEWAY_EPISODES=1000 plays so many; `-s` prints what steps took.
"""

import os

import pytest

from running_site import two_free_ports
from watched import bus, figures

pytest.importorskip("carla", reason="the client is not installed")

from going_hosts import SEEDS, WAYS, GoingHosts, drive, lost, play

EPISODES = int(os.environ.get("CAUSEWAY_EPISODES", "48"))
#: One of CARLA's client takes as long as some of OpenEnv.
DRIVES = max(4, EPISODES // 20)


def test_no_episode_is_lost_while_world_services_go(tmp_path, site):
    wanted = [play(site.base_url, seed) for seed in range(SEEDS)]
    wanted_drive = drive(site.carla_port)
    with bus(tmp_path) as start:
        hosts = GoingHosts(start)
        scenario = start("scenario", "--http", "127.0.0.1:0")
        port = two_free_ports()
        gateway = start("gateway", "--port", str(port), "--recordings", str(tmp_path / "logs"))
        for face in (scenario, gateway):
            face.until("/readyz", 200)
        url = "http://" + scenario.find(r"OpenEnv face listens address=(\S+)")
        played, driven = hosts.outlive(url, port, EPISODES, DRIVES)
        for way in WAYS:
            print(hosts.record.told(way))
        counted = figures(scenario.admin)
        recovered = counted["causeway_scenario_worlds_recovered_total"]
        moved = counted["causeway_scenario_move_seconds_count"]
        print(
            f"{len(played)} + {len(driven)} episodes, {recovered:.0f} recovered, {moved:.0f} moved"
        )
        assert len(played) == EPISODES
        assert len(hosts.record.gone) >= 2
        assert recovered + moved > 0
        assert lost(scenario, gateway) == 0
    for seed, seen in played:
        assert seen == wanted[seed], seed
    assert all(seen == wanted_drive for seen in driven)
