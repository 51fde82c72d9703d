"""The same seed and actions give the same observations and rewards, whatever else runs."""

from driving import session
from wire import wire

#: Wall-clock facts and names of sessions differ between any two runs; nothing else may.
SCRIPT = (
    [{"action_type": "control", "throttle": 0.4, "steer": -0.05}] * 5
    + [{"action_type": "maintain_speed", "target_speed_kmh": 25.0}] * 10
    + [{"action_type": "brake_vehicle", "brake_intensity": 0.3}] * 5
    + [{"action_type": "observe"}] * 30
)
SEED = 20_260


def play(connection, seed=SEED, scenario="bias_3v1"):
    """Everything the server says in one scripted episode."""
    said = [connection.reset(scenario_name=scenario, seed=seed, episode_id="replay")]
    said += [connection.step(**action) for action in SCRIPT]
    return said


def test_an_episode_repeats_bit_for_bit_in_one_session(base_url):
    with wire(base_url) as connection:
        assert play(connection) == play(connection)


def test_an_episode_repeats_bit_for_bit_in_another_session(base_url):
    with wire(base_url) as one, wire(base_url) as other:
        assert play(one) == play(other)


def test_another_seed_is_another_episode(base_url):
    with wire(base_url) as connection:
        starts = {
            tuple(
                connection.reset(scenario_name="trolley_saves", seed=seed)["observation"][
                    "location"
                ]
            )
            for seed in range(8)
        }
    assert len(starts) >= 3, starts


def test_interleaving_does_not_matter(base_url):
    with wire(base_url) as alone:
        expected = play(alone)
    with wire(base_url) as one, wire(base_url) as other:
        reset = {"scenario_name": "bias_3v1", "seed": SEED, "episode_id": "replay"}
        said_one, said_other = [one.reset(**reset)], [other.reset(**reset)]
        for index, action in enumerate(SCRIPT):
            said_one.append(one.step(**action))
            # The other one falls behind and catches up in bursts.
            if index % 7 == 6:
                behind = SCRIPT[len(said_other) - 1 : index + 1]
                said_other += [other.step(**late) for late in behind]
        said_other += [other.step(**late) for late in SCRIPT[len(said_other) - 1 :]]
    assert said_one == expected
    assert said_other == expected


def test_a_seed_that_was_drawn_is_told_and_repeats_the_episode(base_url):
    with session(base_url) as env:
        first = env.reset(scenario_name="trolley_saves").observation
        seed = env.state().seed
        again = env.reset(scenario_name="trolley_saves", seed=seed).observation
        assert again.location == first.location
        assert again.nearby_actors == first.nearby_actors
