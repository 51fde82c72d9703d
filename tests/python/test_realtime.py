"""Time that goes on while the driver thinks, with the unmodified client."""

import time

import pytest

from driving import act, session

PAUSE_SECS = 2.0


def test_two_seconds_of_thought_are_two_seconds_of_the_world(base_url):
    with session(base_url) as env:
        env.reset(scenario_name="free_roam", scenario_config={"realtime": True}, seed=5)
        before = act(env, "control", throttle=0.5).observation
        begun = time.monotonic()
        time.sleep(PAUSE_SECS)
        after = act(env).observation
        passed = after.simulation_time - before.simulation_time
        # A tick may have been under way at either end.
        assert PAUSE_SECS - 0.05 <= passed <= time.monotonic() - begun + 0.1
        assert after.metadata["events"][0].endswith(" s passed before this action")
        # It kept the throttle, which an action holds until the next one.
        assert after.speed_kmh > before.speed_kmh + 5.0
        assert after.step_number == before.step_number + 1


def test_the_world_waits_unless_it_is_asked_not_to(base_url):
    with session(base_url) as env:
        env.reset(seed=5)
        time.sleep(0.5)
        assert act(env).observation.simulation_time == 0.05


def test_egos_that_share_a_world_have_no_time_of_their_own(base_url):
    with session(base_url) as env:
        with pytest.raises(RuntimeError, match="num_egos must be 1 where realtime is true"):
            env.reset(scenario_name="free_roam", scenario_config={"realtime": True, "num_egos": 2})
