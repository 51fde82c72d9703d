"""Scenarios with people who move: one crosses, one hesitates, a crowd crosses; all in the tick."""

import itertools
import math

import pytest

from driving import act, session, walkers, walkers_hit

SCENARIOS = ("pedestrian_crosses", "pedestrian_hesitates", "crowd_crosses")
SEEDS = range(4)
#: At 40 km/h a car with full brakes stands after 8 to 10 m.
BRAKES_M = 16.0


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


def in_the_way(observation, before):
    """Whether somebody is on the ego's lane before it, or walks beside it."""
    return any(
        -3.0 < walker["longitudinal"] < BRAKES_M
        and (
            abs(walker["lateral"]) < 2.4
            or abs(walker["lateral"] - before.get(walker["id"], walker["lateral"])) > 0.02
        )
        for walker in walkers(observation)
    )


def drive(env, looks):
    """How an episode at 40 km/h ends, whose driver brakes for people if it looks."""
    result = act(env, "maintain_speed", target_speed_kmh=40.0)
    before: dict[int, float] = {}
    while not result.done:
        seen = result.observation
        action = "emergency_stop" if looks and in_the_way(seen, before) else "maintain_speed"
        before = {walker["id"]: walker["lateral"] for walker in walkers(seen)}
        result = act(env, action, target_speed_kmh=40.0)
    return result


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_who_drives_on_hits_somebody_and_who_brakes_nobody(env, scenario):
    for seed in SEEDS:
        env.reset(scenario_name=scenario, seed=seed)
        result = drive(env, looks=False)
        assert (result.reward, result.observation.done_reason) == (-1.0, "collision"), seed
        assert result.observation.collided_with.startswith("walker.pedestrian.")
        assert len(walkers_hit(env.state())) >= 1
        env.reset(scenario_name=scenario, seed=seed)
        result = drive(env, looks=True)
        assert (result.reward, result.observation.done_reason) == (1.0, "goal_reached"), seed
        outcome = result.observation.metadata["outcome"]
        assert outcome["actual_pedestrians_hit"] == 0 and outcome["goal_reached"] is True
        assert walkers_hit(env.state()) == set()


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_people_begin_where_no_post_or_thing_stands(env, scenario):
    for seed in range(20):
        observation = env.reset(scenario_name=scenario, seed=seed).observation
        assert observation.scenario_name == scenario, seed


def waited(env, scenario, seed, ticks=600, each=4, **config):
    """Where walkers are after each step of an ego that stands before them, by their ids."""
    config = {"initial_speed_kmh": 0.0, "crossing_trigger_m": 200.0, "max_steps": 10_000, **config}
    config["start_distance_m"] = 30.0
    env.reset(scenario_name=scenario, scenario_config={**config, "ticks_per_step": each}, seed=seed)
    places: dict[int, list[tuple[float, float]]] = {}
    for _ in range(ticks // each):
        result = act(env, "emergency_stop")
        for walker in walkers(result.observation):
            place = (walker["longitudinal"], walker["lateral"])
            places.setdefault(walker["id"], []).append(place)
    return places, result.observation


def test_one_crosses_from_kerb_to_kerb(env):
    for seed in SEEDS:
        places, last = waited(env, "pedestrian_crosses", seed)
        (way,) = places.values()
        (_, first), (_, end) = way[0], way[-1]
        assert first * end < 0.0 and abs(end - first) > 5.0, "over the lane"
        assert max(abs(ahead - way[0][0]) for ahead, _ in way) < 0.7, "straight over"
        assert not last.collision_detected


def test_one_hesitates_and_goes_back_or_on(env):
    ends = set()
    for seed in range(8):
        places, _ = waited(env, "pedestrian_hesitates", seed)
        (way,) = places.values()
        sides = [side for _, side in way]
        stands = [
            abs(side)
            for before, side in itertools.pairwise(sides)
            if abs(side - before) < 0.01 and abs(side) < 1.2
        ]
        # At 0.2 s a step, for 1 to 2.5 s.
        assert 3 <= len(stands) <= 14 and max(stands) < 1.0, stands
        ends.add("back" if sides[0] * sides[-1] > 0.0 else "on")
        assert max(map(abs, (sides[0], sides[-1]))) > 2.0
    assert ends == {"back", "on"}


def test_a_crowd_crosses_from_both_sides_on_its_feet(env):
    for seed in SEEDS:
        places, last = waited(env, "crowd_crosses", seed, ticks=800)
        assert 4 <= len(places) <= 8
        crossed = [way[0][1] * way[-1][1] < 0.0 for way in places.values()]
        assert all(crossed), (seed, places)
        assert {way[0][1] > 0.0 for way in places.values()} == {True, False}
        assert all(math.dist(way[0], way[-1]) > 3.0 for way in places.values())
        assert not last.collision_detected


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_people_move_in_the_tick_however_long_a_step_is_and_repeat(env, scenario):
    hashes = [
        waited(env, scenario, 5, ticks=120, each=each)[1].metadata["sim"]["state_hash"]
        for each in (1, 1, 12, 120)
    ]
    assert len(set(hashes)) == 1
    other = waited(env, scenario, 6, ticks=120, each=12)[1].metadata["sim"]["state_hash"]
    assert other != hashes[0]


def test_settings_say_who_goes_and_what_cannot_be_is_refused(env):
    config = {"num_pedestrians": 3, "pedestrian_speed": 2.0}
    places, _ = waited(env, "crowd_crosses", 1, ticks=20, each=1, **config)
    assert 2 <= len(places) <= 3
    with pytest.raises(RuntimeError, match="crossing_trigger_m"):
        env.reset(
            scenario_name="pedestrian_crosses", scenario_config={"crossing_trigger_m": "near"}
        )
