"""Each call to CARLA's Traffic Manager changes what its vehicles do."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from running_site import two_free_ports

pytest.importorskip("carla", reason="the client is not installed")

SESSION = Path(__file__).parent / "manager_session.py"
#: Position, low beam and fog lamps, by CARLA's flags.
NIGHT = 1 | 2 | 128


@pytest.fixture(scope="module")
def seen(site):
    """What the session measured, by experiment."""
    command = [sys.executable, SESSION, str(site.carla_port), str(two_free_ports())]
    run = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert run.returncode == 0, run.stderr[-2000:]
    return json.loads(run.stdout.splitlines()[-1])


def test_a_vehicle_drives_at_its_share_of_the_limit_or_its_own_speed(seen):
    kmh = seen["speed_differences"]
    assert kmh["limit"] == 70.0
    assert kmh["slower_25"] == pytest.approx(52.5, rel=0.1)
    assert kmh["slower_50"] == pytest.approx(35.0, rel=0.1)
    assert kmh["slower_80"] == pytest.approx(14.0, rel=0.1)
    assert kmh["desired_15"] == pytest.approx(15.0, rel=0.1)


def test_a_global_difference_holds_for_vehicles_without_their_own(seen):
    found = seen["global_speed_difference"]
    assert found["kmh"] == pytest.approx(0.4 * found["limit_kmh"], rel=0.1)


def test_a_vehicle_keeps_its_distance_to_the_one_ahead(seen):
    gaps_m = seen["distances"]
    assert gaps_m["vehicle_2"] == pytest.approx(2.0, abs=1.0)
    assert gaps_m["vehicle_5"] - gaps_m["vehicle_2"] == pytest.approx(3.0, abs=0.3)
    assert gaps_m["global_4"] - gaps_m["vehicle_2"] == pytest.approx(2.0, abs=0.3)


def test_a_vehicle_hits_only_whom_it_was_told_to_ignore(seen):
    pushed_m = seen["collisions"]
    assert pushed_m["default"] < 1.0
    assert min(pushed_m["collision_detection"], pushed_m["ignore_vehicles"]) > 5.0


def test_a_vehicle_stops_for_a_walker_unless_it_ignores_walkers(seen):
    past_m = seen["walkers"]
    assert -10.0 < past_m["default"] < -2.0
    assert past_m["ignore_walkers"] > 10.0


def test_a_vehicle_overtakes_where_it_may_change_lanes(seen):
    assert seen["overtaking"] == {"False": [-3], "True": [-3, -4]}


def test_lane_changes_go_where_they_were_asked_for(seen):
    assert seen["lane_changes"] == {
        "force_right": [-3, -4],
        "force_left": [-3, -2],
        "random_left": [-3, -2],
        "random_right": [-3, -4],
        "keep_slow_lane": [-3, -4],
        "nothing": [-3],
    }


def test_offsets_count_to_the_right_of_the_lanes_middle(seen):
    assert seen["offsets"]["vehicle_m"] == pytest.approx(0.8, abs=0.15)
    assert seen["offsets"]["global_m"] == pytest.approx(-0.6, abs=0.15)


def test_a_vehicle_waits_at_a_red_light_unless_it_ignores_lights(seen):
    past_m = seen["lights"]
    assert -6.0 < past_m["default"] < 0.5
    assert past_m["ignore_lights"] > 10.0


def test_a_vehicle_stops_at_a_stop_sign_unless_it_ignores_signs(seen):
    signs = seen["stop_signs"]
    assert signs["default"]["lowest_kmh"] < 0.5
    assert signs["ignore_signs"]["lowest_kmh"] > 5.0
    assert signs["default"]["last_kmh"] > 10.0


def test_lamps_burn_by_night_where_they_are_left_to_the_traffic_manager(seen):
    assert seen["night_lights"] == {"told": NIGHT, "other": 0}


def test_in_hybrid_mode_only_cars_near_the_hero_have_engines(seen):
    near, far = seen["hybrid"]["near"], seen["hybrid"]["far"]
    assert near["throttle"] and not far["throttle"]
    # 36 km/h for 5 s, from rest and at once.
    assert 10.0 < near["way_m"] < far["way_m"] == pytest.approx(50.0, abs=1.0)


def test_nobody_is_respawned_on_a_map_without_dormant_vehicles(seen):
    found = seen["dormant_vehicles"]
    assert not found["dormant"]
    # From rest to 36 km/h in 5 s, without a jump.
    assert 10.0 < found["way_m"] < 50.0


def test_a_vehicle_follows_its_path_over_a_lane_change(seen):
    assert max(seen["paths"]["nearest_m"]) < 2.0
    assert seen["paths"]["lane"] == -4


def test_a_route_names_the_turn_at_a_junction(seen):
    turns = {name: turn["deg"] for name, turn in seen["routes"].items()}
    assert turns["Left"] == pytest.approx(-90.0, abs=25.0)
    assert turns["Right"] == pytest.approx(90.0, abs=25.0)


def test_actions_tell_what_comes_next(seen):
    assert seen["actions"]["next"] == ["str", "Waypoint"]
    assert seen["actions"]["all"] == ["LaneFollow"]


def test_every_traffic_manager_has_the_port_it_was_asked_for(seen):
    assert seen["ports"] == {"own": 0, "other": 1}


def test_a_second_client_has_its_car_driven_by_the_firsts_traffic_manager(seen):
    assert seen["shared_port"]["kmh"] == pytest.approx(18.0, rel=0.1)


def test_a_traffic_manager_left_asynchronous_drives_in_a_synchronous_world(seen):
    assert seen["left_asynchronous"]["way_m"] > 20.0


def test_a_car_at_a_dead_end_goes_in_open_street_map_mode(seen):
    assert seen["dead_ends"] == {"False": True, "True": False}
