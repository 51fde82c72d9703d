"""Several OpenEnv clients in one world, each with an ego of its own."""

import itertools
import math
import random
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack

import pytest
from causeway.openenv import Session, SessionError

from driving import act, session

EGOS = 12
#: Farther than that nobody is near.
NEARBY_M = 50.0


def together(sessions, *arguments, **more):
    """One step of each at the same time; their results in order."""
    with ThreadPoolExecutor(len(sessions)) as all_of_them:
        steps = [all_of_them.submit(act, env, *arguments, **more) for env in sessions]
        return [step.result().observation for step in steps]


def test_unmodified_clients_see_each_other_where_they_are(base_url):
    with ExitStack() as stack:
        egos = [stack.enter_context(session(base_url)) for _ in range(EGOS)]
        settings = {"num_egos": EGOS, "num_npc_vehicles": 0, "num_pedestrians": 0}
        made = egos[0].reset(scenario_name="free_roam_Town01", scenario_config=settings, seed=4)
        code = made.observation.metadata["world_id"]
        for number, env in enumerate(egos[1:], start=1):
            told = env.reset(join=code).observation.metadata
            assert told["ego"] == f"ego_{number}" and len(told["egos"]) == EGOS
        for _ in range(5):
            seen = together(egos, "control", throttle=0.6)
        assert len({each.metadata["sim"]["state_hash"] for each in seen}) == 1
        assert len({tuple(each.metadata["goal"]["location"]) for each in seen}) > EGOS // 2
        near = 0
        for one, other in itertools.permutations(seen, 2):
            away_m = math.dist(one.location, other.location)
            if away_m < NEARBY_M - 0.1:
                near += 1
                distances = [actor["distance"] for actor in one.nearby_actors]
                assert any(abs(distance - away_m) < 0.1 for distance in distances)
        assert near > 0, "of these egos none is near another: take another seed"
        others = [other for each in seen for other in each.metadata["others"]]
        assert len(others) == EGOS * (EGOS - 1) and all(other["live"] for other in others)


def test_who_answers_first_makes_no_difference(base_url):
    ends = []
    for seed in (1, 2):
        delays = random.Random(seed)
        with session(base_url) as first, session(base_url) as second:
            made = first.reset(scenario_name="free_roam", scenario_config={"num_egos": 2}, seed=7)
            second.reset(join=made.observation.metadata["world_id"])

            def late(env, throttle, delay_secs):
                time.sleep(delay_secs)
                return act(env, "control", throttle=throttle).observation

            with ThreadPoolExecutor(2) as both:
                for _ in range(60):
                    pair = ((first, 0.4), (second, 0.9))
                    steps = [
                        both.submit(late, env, throttle, delays.random() / 100)
                        for env, throttle in pair
                    ]
                    seen = [step.result() for step in steps]
            ends.append(seen[0].metadata["sim"]["state_hash"])
            assert seen[0].metadata["sim"]["tick"] == 60
    assert ends[0] == ends[1]


GUEST = """
import sys, time
from causeway.openenv import Session
guest = Session(sys.argv[1])
guest.reset(join=sys.argv[2])
print("here", flush=True)
guest.step("control", throttle=0.5)
print("stepped", flush=True)
time.sleep(600.0)
"""


def test_a_client_that_is_killed_holds_nobody_up_and_another_takes_its_place(base_url):
    with Session(base_url) as host:
        settings = {"num_egos": 2, "lease_secs": 300, "join_timeout_secs": 300}
        made = host.reset("free_roam", scenario_config=settings, seed=7)
        code = made.metadata["world_id"]
        guest = subprocess.Popen(
            [sys.executable, "-c", GUEST, base_url, code], stdout=subprocess.PIPE, text=True
        )
        assert guest.stdout.readline() == "here\n"
        assert host.step("control", throttle=0.5).metadata["others"][0]["live"]
        assert guest.stdout.readline() == "stepped\n"
        guest.kill()
        guest.wait()
        begun = time.monotonic()
        alone = host.step("control", throttle=0.5)
        # Of the 300 s that it would have waited for who is slow.
        assert time.monotonic() - begun < 60.0
        assert not alone.metadata["others"][0]["live"]
        with Session(base_url) as other:
            joined = other.reset(join=code, ego="ego_1")
            assert joined.metadata["sim"]["tick"] == alone.metadata["sim"]["tick"]


def test_what_cannot_be_joined_says_why(base_url):
    with Session(base_url) as session_of_one:
        with pytest.raises(SessionError, match="no such world to join"):
            session_of_one.reset(join="nowhere")
        with pytest.raises(SessionError, match=r"num_egos.*free_roam"):
            session_of_one.reset("trolley_saves", scenario_config={"num_egos": 2})
