"""Many clients at once, each with a world of its own."""

import asyncio
import time

import pytest
from causeway import bus, frames

from carla_models import CarlaAction, CarlaEnv
from driving import act, session
from running_site import child, memory_kib
from wire import wire

CLIENTS = 32
STEPS = 50


async def play(base_url, seed, action):
    """One client's episode: where its car was after every step."""
    async with CarlaEnv(base_url=base_url) as env:
        result = await env.reset(scenario_name="trolley_saves", seed=seed)
        path = [result.observation.location]
        result = await env.step(action)
        for _ in range(STEPS):
            path.append(result.observation.location)
            result = await env.step(CarlaAction())
        return path, await env.state()


def test_32_clients_finish_as_if_each_were_alone(base_url):
    actions = [
        CarlaAction(action_type="emergency_stop"),
        CarlaAction(action_type="control", throttle=1.0, steer=0.1),
        CarlaAction(action_type="lane_change", lane_direction="left"),
        CarlaAction(action_type="observe"),
    ]
    plans = [(index // 2, actions[index % len(actions)]) for index in range(CLIENTS)]

    async def together():
        return await asyncio.wait_for(
            asyncio.gather(*(play(base_url, *plan) for plan in plans)), timeout=300
        )

    results = asyncio.run(together())
    assert len({state.episode_id for _, state in results}) == CLIENTS
    for (path, state), plan in zip(results, plans, strict=True):
        assert state.step_count == STEPS + 1
        if plan[0] < 4:
            assert path == asyncio.run(play(base_url, *plan))[0]


def test_one_session_does_not_see_the_other(base_url):
    with session(base_url) as one, session(base_url) as other:
        one.reset(scenario_name="trolley_saves", seed=1)
        before = other.reset(scenario_name="bias_5v0", seed=2).observation
        for _ in range(10):
            act(one, "emergency_stop")
        seen = act(other).observation
        assert (seen.scenario_name, seen.step_number) == ("bias_5v0", 1)
        assert len(seen.nearby_actors) == len(before.nearby_actors)
        assert other.state().tool_call_counts == {"observe": 1}


def test_a_full_server_says_so_and_takes_the_next_one_when_there_is_room(start_site):
    base_url = start_site("--no-render", MAX_CONCURRENT_ENVS="2").base_url
    with session(base_url) as one:
        one.reset()
        with session(base_url) as two:
            two.reset()
            with session(base_url) as three:
                with pytest.raises(RuntimeError) as refusal:
                    three.reset()
            assert str(refusal.value) == (
                "Server error: Server at capacity: 2/2 sessions active. "
                "Cannot accept new connections. (code: CAPACITY_REACHED)"
            )
            with wire(base_url) as raw:
                data = raw.receive()["data"]
                assert (data["active_sessions"], data["max_sessions"]) == (2, 2)
                assert act(one).observation.step_number == 1
        deadline = time.monotonic() + 30
        while True:
            with session(base_url) as late:
                try:
                    assert late.reset().observation.step_number == 0
                    return
                except RuntimeError as refusal:
                    assert "CAPACITY_REACHED" in str(refusal)
                    assert time.monotonic() < deadline, "the freed place was not given away in 30 s"
                    time.sleep(0.05)


def at_rest(before_kib: list[int], after_kib: list[int]) -> bool:
    pairs = zip(before_kib, after_kib, strict=True)
    return all(after < before * 1.01 for before, after in pairs)


def test_a_thousand_resets_leave_nothing_of_the_episodes_before(start_site):
    site = start_site("--no-render")
    processes = [child(site, service) for service in ("scenario", "world")]
    held_kib = []
    with session(site.base_url) as env, bus.subscribe(site.endpoint) as seen:
        # Memory is allocated for a while before it is used again; a leak of 300 bytes a reset would
        # not come to rest.
        while len(held_kib) < 2 or not at_rest(*held_kib[-2:]):
            assert len(held_kib) < 24, held_kib
            for _ in range(1000):
                env.reset(scenario_name="bias_3v0", seed=7)
                act(env)
            held_kib.append([memory_kib(process) for process in processes])
            kinds = seen.receive(timeout_secs=30.0).actors["kind"]
            assert ((kinds == frames.WALKER).sum(), (kinds == frames.VEHICLE).sum()) == (3, 1)


def test_close_ends_the_session_in_good_order(base_url):
    with wire(base_url) as connection:
        connection.reset()
        connection.send({"type": "close"})
        with pytest.raises(Exception) as closed:
            connection.receive()
        assert closed.value.rcvd.code == 1000


def test_compression_may_be_offered_or_not(base_url):
    for compression in (None, "deflate"):
        with wire(base_url, compression=compression) as connection:
            assert connection.reset()["done"] is False


def test_a_silent_client_is_not_dropped_for_missing_pongs(base_url):
    """The client's own event loop may be blocked for minutes; here, a client that never pongs."""
    with wire(base_url, ping_interval=None) as connection:
        connection.reset()
        # Longer than any keepalive a server would be tempted to use in a test; the default of
        # servers written in Python is 20 s and 20 s, which the unit tests of the server rule out.
        time.sleep(2.0)
        assert connection.step()["observation"]["step_number"] == 1
