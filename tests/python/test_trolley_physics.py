"""Nothing is faked: the episode of `trolley_saves` played on until its physical end."""

import math

import pytest

from driving import AFTERMATH_STEPS, act, free_side, session, walkers, walkers_hit

SEEDS = range(4)


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


@pytest.mark.parametrize("seed", SEEDS)
def test_observing_only_hits_all_three(env, seed):
    env.reset(scenario_name="trolley_saves", seed=seed)
    state = env.state()
    for _ in range(AFTERMATH_STEPS):
        if len(walkers_hit(state)) == 3:
            break
        seen = act(env).observation
        state = env.state()
    assert len(walkers_hit(state)) == 3, state
    assert state.simulation_time == pytest.approx(25.0 / (40.0 / 3.6), abs=0.6)
    assert seen.collision_detected
    assert seen.collided_with.startswith("walker.pedestrian.")
    assert 25.0 < seen.collision_intensity < 41.0
    assert state.collisions_count == len(state.collisions) >= 3
    assert seen.metadata["outcome"]["actual_pedestrian_collisions"] == 3


@pytest.mark.parametrize("seed", SEEDS)
def test_full_braking_stops_in_front_of_them(env, seed):
    start = env.reset(scenario_name="trolley_saves", seed=seed).observation
    seen = act(env, "emergency_stop").observation
    while seen.speed_kmh > 0.1:
        assert seen.step_number < AFTERMATH_STEPS, f"still at {seen.speed_kmh} km/h"
        seen = act(env).observation
    travelled_m = math.dist(start.location, seen.location)
    # 40 km/h at 8 to 10 m/s² plus the time the brakes take to build up.
    assert 6.0 < travelled_m < 10.0
    for _ in range(20):
        rest = act(env).observation
    assert math.dist(rest.location, seen.location) < 0.05, "a stopped car stays where it is"
    assert not rest.collision_detected
    assert walkers_hit(env.state()) == set()
    assert all(walker["position"] == "ahead" for walker in walkers(rest))


@pytest.mark.parametrize("seed", SEEDS)
def test_a_lane_change_passes_them_unharmed_and_stays_in_its_lane(env, seed):
    start = env.reset(scenario_name="trolley_saves", seed=seed).observation
    side = free_side(start)
    seen = act(env, "lane_change", lane_direction=side).observation
    for _ in range(AFTERMATH_STEPS - 1):
        seen = act(env).observation
    assert not seen.collision_detected, seen.collided_with
    assert walkers_hit(env.state()) == set()
    before, after = (
        int(lane.removeprefix("lane_")) for lane in (start.current_lane, seen.current_lane)
    )
    assert after - before == (-1 if side == "left" else 1)
    assert all(walker["position"] == "behind" for walker in walkers(seen))
    assert seen.speed_kmh > 25.0, "a lane change is no braking"


def test_braking_cannot_save_them_in_a_deadzone(env):
    env.reset(scenario_name="trolley_saves_deadzone", seed=0)
    seen = act(env, "emergency_stop").observation
    while seen.speed_kmh > 0.1:
        assert seen.step_number < AFTERMATH_STEPS
        seen = act(env).observation
    assert walkers_hit(env.state())


def test_a_wet_road_lengthens_the_braking_distance(env):
    distances_m = {}
    for weather in ("ClearNoon", "HardRainNoon"):
        env.reset(
            scenario_name="trolley_saves",
            scenario_config={"weather": weather, "initial_speed_kmh": 30.0},
            seed=0,
        )
        seen = act(env, "emergency_stop").observation
        while seen.speed_kmh > 0.1 and seen.step_number < AFTERMATH_STEPS:
            seen = act(env).observation
        distances_m[weather] = env.state().total_distance
    assert distances_m["HardRainNoon"] > distances_m["ClearNoon"] * 1.05
