"""What `state` counts."""

import math
import uuid
from itertools import pairwise

import pytest

from driving import act, session


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


def test_before_the_first_reset_everything_is_zero(env):
    state = env.state()
    assert state.episode_id is None
    assert (state.step_count, state.num_turns, state.total_tool_calls) == (0, 0, 0)
    assert state.scenario_name == "trolley_saves"
    assert (state.collisions, state.tool_call_counts) == ([], {})


def test_every_step_message_counts_but_pictures_are_no_turns(env):
    env.reset(seed=1)
    act(env)
    act(env, "capture_image")
    act(env, "brake_vehicle", brake_intensity=0.5)
    act(env, "brake_vehicle", brake_intensity=0.5)
    state = env.state()
    assert state.step_count == 4
    assert (state.num_turns, state.total_tool_calls) == (3, 3)
    assert state.tool_call_counts == {"observe": 1, "brake_vehicle": 2}
    assert act(env).observation.step_number == 4


def test_distance_and_speeds_follow_from_the_observations(env):
    seen = [env.reset(seed=1).observation]
    seen += [act(env, "control", throttle=0.5).observation for _ in range(20)]
    state = env.state()
    path_m = sum(math.dist(a.location, b.location) for a, b in pairwise(seen))
    speeds = [one.speed_kmh for one in seen[1:]]
    assert state.total_distance == pytest.approx(path_m, rel=1e-4)
    assert state.average_speed == pytest.approx(sum(speeds) / len(speeds), rel=1e-4)
    assert state.max_speed == pytest.approx(max(speeds), rel=1e-4)
    assert state.simulation_time == pytest.approx(1.0)
    assert state.simulation_time == seen[-1].simulation_time


def test_the_total_reward_is_the_sum_until_the_end(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    rewards = [act(env).reward for _ in range(4)]
    act(env)
    assert env.state().total_reward == sum(rewards)


def test_a_requested_episode_name_and_seed_are_kept(env):
    env.reset(seed=77, episode_id="my episode")
    state = env.state()
    assert (state.episode_id, state.seed) == ("my episode", 77)


def test_an_episode_without_a_name_gets_a_new_one_each_time(env):
    names = set()
    for _ in range(3):
        env.reset()
        names.add(uuid.UUID(env.state().episode_id))
    assert len(names) == 3


def test_reset_clears_the_counters(env):
    env.reset(seed=1)
    for _ in range(60):
        act(env)
    assert env.state().collisions_count > 0
    env.reset(seed=1)
    state = env.state()
    assert (state.step_count, state.total_reward, state.total_distance) == (0, 0.0, 0.0)
    assert (state.collisions, state.collisions_count, state.max_speed) == ([], 0, 0.0)


def test_town_and_weather_are_the_actual_ones(env):
    env.reset(seed=1, scenario_config={"weather": "WetCloudySunset"})
    state = env.state()
    assert (state.town, state.weather) == ("Town10HD_Opt", "WetCloudySunset")


def test_a_refused_step_counts_nothing(env):
    from wire import wire

    with wire(env.base_url) as connection:
        connection.reset(seed=1)
        connection.step(action_type="observe")
        before = connection.state()
        refused = connection.ask({"type": "step", "data": {"throttle": 2}})
        assert refused["data"]["code"] == "VALIDATION_ERROR"
        assert connection.state() == before
