"""Each action does what its fields say."""

import math

import pytest

from driving import act, session

TICK_SECS = 0.05


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


def test_a_stronger_brake_slows_down_more(env):
    slowed_kmh = []
    for intensity in (0.1, 0.25, 0.5, 0.75, 1.0):
        env.reset(scenario_name="bias_0v0", seed=1)
        for _ in range(10):
            seen = act(env, "brake_vehicle", brake_intensity=intensity).observation
        slowed_kmh.append(40.0 - seen.speed_kmh)
    assert slowed_kmh == sorted(slowed_kmh)
    # Half a second, of which the brakes need a part to build up.
    assert slowed_kmh[0] < 5.0 and slowed_kmh[-1] > 9.0, slowed_kmh


@pytest.mark.parametrize("wanted_kmh", [15.0, 30.0, 55.0])
def test_a_wanted_speed_is_held_within_2_kmh_after_ten_seconds(env, wanted_kmh):
    # No car on a motorway is stopped by a corner.
    settings = {"map_name": "Town04", "max_steps": 10_000}
    env.reset(scenario_name="bias_0v0", scenario_config=settings, seed=1)
    act(env, "maintain_speed", target_speed_kmh=wanted_kmh)
    for _ in range(200):
        seen = act(env).observation
    for _ in range(40):
        assert seen.speed_kmh == pytest.approx(wanted_kmh, abs=2.0)
        seen = act(env).observation


def test_the_lane_that_an_observation_names_can_be_asked_for(env):
    start = env.reset(scenario_name="bias_0v0", seed=1).observation
    own = int(start.current_lane.removeprefix("lane_"))
    side = start.metadata["info"]["side_directions"][0]
    target = f"lane_{own + (1 if side == 'right' else -1)}"
    seen = act(env, "lane_change", target_lane_id=target).observation
    assert "events" not in seen.metadata or not seen.metadata["events"]
    for _ in range(60):
        seen = act(env).observation
    assert seen.current_lane == target


def test_a_lane_that_is_not_there_is_named_and_the_own_one_kept(env):
    start = env.reset(scenario_name="bias_0v0", seed=1).observation
    for lane in ("lane_17", start.current_lane, "17"):
        seen = act(env, "lane_change", target_lane_id=lane).observation
        assert any("names no other lane" in event for event in seen.metadata["events"]), lane
    for _ in range(60):
        seen = act(env).observation
    assert seen.current_lane == start.current_lane


def cruise(env, behaviour: str) -> float:
    """The highest speed on the way to the goal, in km/h."""
    settings = {"max_steps": 2000, "route_distance_max": 250}
    env.reset(scenario_name="free_roam_Town10HD_Opt_v0_p0", scenario_config=settings, seed=3)
    act(env, "init_navigation_agent", navigation_behavior=behaviour)
    fastest = 0.0
    for _ in range(60):
        result = act(env, "follow_route", route_steps=5)
        fastest = max(fastest, result.observation.speed_kmh)
        if result.done:
            break
    return fastest


def test_who_is_more_aggressive_drives_faster_on_the_same_way(env):
    simple, cautious, normal, aggressive = (
        cruise(env, behaviour) for behaviour in ("basic", "cautious", "normal", "aggressive")
    )
    assert simple == pytest.approx(20.0, abs=2.0)
    assert simple < cautious - 1.0 < cautious < normal - 1.0 < normal < aggressive - 1.0


def closest(env, behaviour: str) -> float:
    """How near it comes to who drives ahead in its lane, middle to middle, in metres."""
    settings = {"max_steps": 3000, "route_distance_max": 400}
    env.reset(scenario_name="free_roam_Town10HD_Opt_v60_p0", scenario_config=settings, seed=3)
    act(env, "init_navigation_agent", navigation_behavior=behaviour)
    gaps = []
    for _ in range(150):
        seen = act(env, "follow_route", route_steps=5).observation
        gaps += [
            other["longitudinal"]
            for other in seen.nearby_actors
            if other["type"].startswith("vehicle.")
            and other["longitudinal"] > 0.0
            and abs(other["lateral"]) < 1.0
            and seen.speed_kmh > 10.0
        ]
    return min(gaps)


def test_who_is_more_aggressive_keeps_less_distance_behind_the_same_cars(env):
    cautious, normal, aggressive = (
        closest(env, behaviour) for behaviour in ("cautious", "normal", "aggressive")
    )
    assert cautious > normal + 0.3 > normal > aggressive + 0.3, (cautious, normal, aggressive)


def test_an_agent_drives_to_the_destination_that_it_is_given(env):
    settings = {"max_steps": 5000, "success_radius": 1}
    env.reset(scenario_name="free_roam_Town10HD_Opt_v0_p0", scenario_config=settings, seed=3)
    goal = env.state().scenario_data["goal_location"]
    act(env, "init_navigation_agent", navigation_behavior="normal")
    for height in ({"destination_z": 0.0}, {}):
        events = act(
            env, "set_destination", destination_x=goal[0], destination_y=goal[1], **height
        ).observation.metadata.get("events")
        assert not events, events
    for _ in range(500):
        seen = act(env, "follow_route", route_steps=10).observation
        if math.dist(seen.location[:2], goal[:2]) < 5.0 and seen.speed_kmh < 1.0:
            break
    assert math.dist(seen.location[:2], goal[:2]) < 5.0


def test_a_destination_far_off_the_map_is_an_error_and_no_step(env):
    env.reset(scenario_name="free_roam_Town10HD_Opt_v0_p0", seed=3)
    act(env, "init_navigation_agent")
    # The last is more than four bytes hold.
    for far_m in (1e6, 1e39):
        with pytest.raises(RuntimeError, match="place is out of range"):
            act(env, "set_destination", destination_x=far_m, destination_y=far_m)
    assert act(env).observation.step_number == env.state().step_count
