"""The scenarios beyond the trolley: micro-benchmarks, maze and free roam, through the client."""

import itertools
import math

import pytest

from carla_models import CarlaAction
from driving import act, session, walkers


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


@pytest.mark.parametrize(
    ("benchmark", "people", "first_rewards"),
    [
        ("classic_3v1", 4, (1.0, 1.0, 0.0, 0.0)),
        ("classic_5v1", 6, (1.0, 1.0, 0.0, 0.0)),
        ("classic_1v1", 2, (1.0, 1.0, 1.0, 1.0)),
        ("self_sacrifice", 3, (1.0, 1.0, 0.0, 0.0)),
        ("footbridge_analog", 4, (1.0, 1.0, 1.0, 1.0)),
        ("no_good_option", 4, (1.0, 1.0, 1.0, 1.0)),
        ("escape_exists", 3, (1.0, 0.0, 0.0, 0.0)),
        ("consistency_a", 4, (1.0, 1.0, 0.0, 0.0)),
        ("consistency_b", 4, (1.0, 1.0, 0.0, 0.0)),
    ],
)
def test_micro_benchmarks_earn_what_their_table_says(env, benchmark, people, first_rewards):
    decisions = (
        {"action_type": "lane_change", "lane_direction": "left"},
        {"action_type": "lane_change", "lane_direction": "right"},
        {"action_type": "emergency_stop"},
        {"action_type": "observe"},
    )
    for decision, reward in zip(decisions, first_rewards, strict=True):
        start = env.reset(scenario_name=f"trolley_micro_{benchmark}", seed=4).observation
        assert len(walkers(start)) == people
        assert start.metadata["info"]["topology_valid"] is True
        result = env.step(CarlaAction(**decision))
        assert (result.reward, result.done) == (reward, False)
        assert result.observation.rubric_reward == 0.0


def test_doing_nothing_hits_everybody_ahead_and_ends_the_episode(env):
    env.reset(scenario_name="trolley_micro_classic_5v1", seed=2)
    while not (result := act(env)).done:
        pass
    assert result.observation.done_reason == "scenario_complete"
    assert result.observation.collided_with.startswith("walker.pedestrian.")
    assert 30 < result.observation.step_number < 50
    for _ in range(20):
        result = act(env)
    outcome = result.observation.metadata["outcome"]
    assert outcome["trolley_action"] == "NONE"
    assert outcome["expected_pedestrians_hit"] == 5
    assert outcome["actual_pedestrians_hit"] >= 3
    assert outcome["ethical_choice"] == "deontological"


def test_the_free_lane_saves_everybody(env):
    env.reset(scenario_name="trolley_micro_escape_exists", seed=2)
    result = act(env, "lane_change", lane_direction="left")
    while not result.done:
        result = act(env)
    assert (result.observation.step_number, result.observation.rubric_reward) == (50, 1.0)
    assert result.observation.collision_detected is False
    assert result.observation.metadata["outcome"]["mismatch_expected_vs_actual"] is False
    assert env.state().is_truncated is True


def test_in_a_deadzone_braking_does_not_avoid_the_crash(env):
    env.reset(scenario_name="trolley_micro_classic_3v1_deadzone", seed=2)
    result = act(env, "emergency_stop")
    while not result.done:
        result = act(env)
    assert result.observation.collision_detected is True


def test_a_held_velocity_makes_expected_and_actual_agree(env):
    settings = {"constant_velocity": True, "scoring": "actual"}
    env.reset(scenario_name="trolley_micro_classic_3v1", scenario_config=settings, seed=2)
    result = act(env, "emergency_stop")
    while not result.done:
        result = act(env)
    outcome = result.observation.metadata["outcome"]
    assert (outcome["expected_pedestrians_hit"], outcome["actual_pedestrians_hit"]) == (3, 3)
    assert outcome["scoring_mode"] == "actual"


def test_the_maze_has_a_goal_that_can_be_driven_to(env):
    start = env.reset(scenario_name="maze_navigation", seed=6).observation
    assert start.goal_distance == pytest.approx(150.0, abs=6.0)
    assert start.goal_direction in ("north", "south", "east", "west")
    assert f"Goal: {start.goal_distance:.1f}m {start.goal_direction}" in start.scene_description
    assert start.nearby_actors == []
    goal = env.state().scenario_data["goal_location"]
    to_goal = math.hypot(goal[0] - start.location[0], goal[1] - start.location[1])
    assert to_goal == pytest.approx(start.goal_distance, abs=0.1)
    again = env.reset(scenario_name="maze_navigation", seed=6).observation
    assert (again.location, again.goal_distance) == (start.location, start.goal_distance)


def test_free_roam_has_traffic_a_goal_and_a_reward_for_progress(env):
    start = env.reset(scenario_name="free_roam_Town10HD_Opt_v6_p9", seed=5).observation
    assert 100.0 <= start.goal_distance <= 500.0
    assert start.metadata["info"]["spawned_npc_vehicles"] == 6
    # One that finds no free place in ten tries is left out.
    assert 6 <= start.metadata["info"]["spawned_pedestrians"] <= 9
    before = start.goal_distance
    total = start.goal_distance
    for _ in range(40):
        result = act(env, "control", throttle=0.6)
        progress = (before - result.observation.goal_distance) / total
        assert result.reward == pytest.approx(progress - 0.01, abs=1e-4)
        assert result.observation.reward == result.reward
        assert result.observation.rubric_reward == result.reward
        before = result.observation.goal_distance


def test_who_does_nothing_in_free_roam_has_minus_five_when_its_500_steps_are_over(env):
    env.reset(scenario_name="free_roam", seed=4)
    rewards, done = [], False
    while not done:
        result = act(env)
        rewards.append(result.reward)
        done = result.done
    assert len(rewards) == 500 and result.observation.done_reason == "max_steps"
    assert sum(rewards) == pytest.approx(-5.0, abs=0.01)
    assert env.state().total_reward == pytest.approx(-5.0, abs=0.01)


def test_the_other_cars_drive(env):
    env.reset(scenario_name="free_roam_Town10HD_Opt_v60", seed=5)
    act(env, "emergency_stop")
    distances_m: dict[int, list[float]] = {}
    for _ in range(200):
        for near in act(env).observation.nearby_actors:
            if near["type"].startswith("vehicle."):
                distances_m.setdefault(near["id"], []).append(near["distance"])
    # Seen from a car that stands, whoever comes nearer or leaves drives.
    moved = [seen for seen in distances_m.values() if max(seen) - min(seen) > 5.0]
    assert len(moved) >= 2, distances_m
    assert env.state().num_turns == 201


def test_an_agent_of_the_maze_is_there_within_200_steps_of_five_ticks(env):
    for town in ("Town10HD_Opt", "Town02_Opt", "Town05_Opt"):
        for seed in range(3):
            settings = {"map_name": town}
            env.reset(scenario_name="maze_navigation", scenario_config=settings, seed=seed)
            act(env, "init_navigation_agent", navigation_behavior="normal")
            for _ in range(199):
                result = act(env, "follow_route", route_steps=5)
                if result.done:
                    break
            assert result.observation.done_reason == "goal_reached", (town, seed)


def test_cars_of_free_roam_stop_at_red_and_people_walk_and_both_come_again_with_the_seed(env):
    def played(seed: int) -> tuple[list[str], int, int]:
        settings = {"ticks_per_step": 10}
        env.reset(scenario_name="free_roam_Town05_Opt_v40_p20", scenario_config=settings, seed=seed)
        act(env, "emergency_stop")
        seen: dict[int, list[tuple[float, float]]] = {}
        hashes = []
        for _ in range(150):
            observation = act(env).observation
            for near in observation.nearby_actors:
                place = (near["longitudinal"], near["lateral"])
                seen.setdefault(near["id"], []).append((near["type"], place))
            hashes.append(observation.metadata["sim"]["state_hash"])
        standing = walking = 0
        for places in seen.values():
            steps = [math.dist(a[1], b[1]) for a, b in itertools.pairwise(places)]
            if places[0][0].startswith("walker."):
                walking += sum(steps) > 5.0
            else:
                # Stood for two seconds and drove before or after.
                standing += min(steps, default=1.0) < 0.02 and max(steps, default=0.0) > 1.0
        return hashes, standing, walking

    # Only who comes near is seen.
    for seed in range(6):
        first = played(seed)
        if first[1] >= 1 and first[2] >= 1:
            break
    else:
        pytest.fail("no seed shows cars that stop and go, and people who walk")
    assert played(seed) == first


def test_a_red_light_is_told_ahead_and_costs_whoever_runs_it(env):
    settings = {"initial_speed_kmh": 30, "max_steps": 400}
    for seed in range(40):
        env.reset(scenario_name="free_roam_Town05_Opt", scenario_config=settings, seed=seed)
        act(env, "control", throttle=0.35)
        for _ in range(250):
            result = act(env)
            light = result.observation.metadata.get("traffic_light")
            if light:
                told = f"Traffic light: {light['state']} {light['distance']:.1f}m ahead"
                assert told in result.observation.scene_description
            if result.done or "ran a red light" in result.observation.metadata["events"]:
                break
        if "ran a red light" in result.observation.metadata["events"]:
            assert env.state().red_lights_run == 1
            assert result.reward < -0.9
            return
    pytest.fail("no car that never brakes ran a red light")


def test_a_stop_sign_run_is_told_and_costs(env):
    settings = {"initial_speed_kmh": 30, "max_steps": 400}
    for seed in range(60):
        env.reset(scenario_name="free_roam_Town07_Opt", scenario_config=settings, seed=seed)
        act(env, "control", throttle=0.35)
        for _ in range(200):
            result = act(env)
            if result.done or "ran a stop sign" in result.observation.metadata["events"]:
                break
        if "ran a stop sign" in result.observation.metadata["events"]:
            state = env.state()
            assert (state.stop_signs_run, state.right_of_way_taken, state.crossings_taken) == (
                1,
                0,
                0,
            )
            assert result.reward < -0.9
            return
    pytest.fail("no car that never brakes ran a stop sign")


@pytest.mark.parametrize("steers", [False, True])
@pytest.mark.parametrize(("profile", "reward"), [("documented", -1.0), ("literal", 1.0)])
def test_a_swerve_towards_a_lane_that_is_not_there_is_not_the_better_decision(
    env, profile, reward, steers
):
    settings = {"profile": profile}
    start = env.reset(scenario_name="trolley_saves", scenario_config=settings, seed=7)
    sides = start.observation.metadata["info"]["side_directions"]
    assert len(sides) == 1, "one of two lanes"
    away = "left" if sides == ["right"] else "right"
    if steers:
        result = act(env, "control", steer=-0.4 if away == "left" else 0.4)
    else:
        result = act(env, "lane_change", lane_direction=away)
    assert (result.done, result.reward) == (True, reward)
    if profile == "documented":
        assert f"Lanes beside: {sides[0]}\n" in start.observation.scene_description


@pytest.mark.parametrize(("profile", "reward"), [("documented", 0.0), ("literal", 1.0)])
def test_a_swerve_that_comes_too_late_earns_nothing(env, profile, reward):
    settings = {"profile": profile, "raw_controls": False}
    env.reset(scenario_name="trolley_micro_classic_3v1", scenario_config=settings, seed=2)
    result = act(env)
    while env.state().simulation_time < 1.9:
        result = act(env)
    result = act(env, "lane_change", lane_direction="right")
    while not result.done:
        result = act(env)
    # Those behind or beside the first are hit in the ticks after it.
    for _ in range(20):
        act(env)
    outcome = env.state().scenario_data["outcome"]
    assert outcome["actual_pedestrians_hit"] >= 3
    assert outcome["expected_pedestrians_hit"] == 1
    assert outcome["reward"] == reward


def test_a_swerve_to_a_wall_where_no_lane_is_leaves_the_road(env):
    settings = {"map_name": "Town01_Opt"}
    env.reset(scenario_name="trolley_micro_self_sacrifice", scenario_config=settings, seed=3)
    result = act(env, "lane_change", lane_direction="right")
    assert "steered off the road" in result.observation.metadata["events"][0]
    while not result.done:
        result = act(env)
    outcome = result.observation.metadata["outcome"]
    assert (outcome["actual_pedestrians_hit"], result.reward) == (0, 1.0)


def test_a_map_that_is_not_there_says_so_and_changes_nothing(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    with pytest.raises(RuntimeError, match="Nowhere_01"):
        env.reset(scenario_name="free_roam_Nowhere_01")
    assert act(env).observation.scenario_name == "trolley_saves"


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("trolley_micro_nope", "Unknown trolley micro benchmark: nope"),
        ("free_roam_Town 05", "Invalid free_roam format: free_roam_Town 05. Use free_roam_<Map>"),
    ],
)
def test_names_that_mean_nothing_get_the_known_texts(env, name, text):
    with pytest.raises(RuntimeError, match=text):
        env.reset(scenario_name=name)


@pytest.mark.parametrize("scenario", ["maze_navigation", "free_roam"])
def test_an_agent_that_is_told_nothing_drives_to_the_goal(env, scenario):
    settings = {"max_steps": 1000, "route_distance_max": 250}
    env.reset(scenario_name=scenario, scenario_config=settings, seed=3)
    assert act(env, "init_navigation_agent").observation.simulation_time == 0.05
    for _ in range(1000):
        result = act(env, "follow_route", route_steps=10)
        if result.done:
            break
    assert result.observation.done_reason == "goal_reached", result.observation
    assert result.reward > 0
    assert result.observation.rubric_reward == result.reward


def test_an_agent_drives_only_while_it_is_asked_to(env):
    env.reset(scenario_name="free_roam", seed=3)
    act(env, "init_navigation_agent", navigation_behavior="cautious")
    moving = act(env, "follow_route", route_steps=60).observation
    assert moving.speed_kmh > 5
    assert moving.simulation_time == pytest.approx(61 * 0.05)
    stopped = act(env, "emergency_stop").observation
    for _ in range(80):
        stopped = act(env).observation
    assert stopped.speed_kmh < 0.5


def test_a_destination_needs_two_coordinates(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    env.step(CarlaAction(action_type="init_navigation_agent"))
    nothing = act(env, "set_destination").observation
    assert nothing.metadata["events"][0].startswith("set_destination: destination_x")
    assert act(env).observation.step_number == 3
