"""States of episodes that trainers go on from, through clients that know nothing of them."""

import json
import time

import httpx
import pytest
from causeway.openenv import Session, SessionError

from carla_models import CarlaAction
from driving import act, session
from test_examples import run


def seen(result):
    """What a client sees, without what only an episode that was resumed has."""
    observation = result.observation.model_dump()
    sim = observation["metadata"]["sim"]
    for name in ("restored_from", "restores"):
        sim.pop(name, None)
    return observation


def test_the_unmodified_client_goes_back_and_sees_the_same_again(base_url):
    with session(base_url) as env:
        env.reset(scenario_name="trolley_saves", seed=3)
        for _ in range(3):
            before = act(env)
        kept = env.step(CarlaAction(action_type="observe", metadata={"op": "snapshot"}))
        assert kept.observation.step_number == before.observation.step_number
        name = kept.observation.metadata["snapshot_id"]
        first = [seen(act(env, "brake_vehicle", brake_intensity=0.5)) for _ in range(20)]
        picture = act(env, "capture_image").observation.camera_image
        begun = env.reset(snapshot_id=name)
        assert begun.observation.metadata["sim"]["restored_from"] == name
        assert begun.observation.location == before.observation.location
        again = [seen(act(env, "brake_vehicle", brake_intensity=0.5)) for _ in range(20)]
        assert again == first
        assert act(env, "capture_image").observation.camera_image == picture
        env.reset(snapshot_id=name)
        other = [seen(act(env, "emergency_stop")) for _ in range(20)]
        assert other[-1]["speed_kmh"] < first[-1]["speed_kmh"]


def test_64_sessions_begin_from_one_state(base_url):
    with Session(base_url) as origin:
        origin.reset("trolley_saves", seed=5)
        name = origin.snapshot()
        wanted = origin.step().observation["location"]
        branches = [Session(base_url) for _ in range(64)]
        begun = time.perf_counter()
        steps = [branch.reset(snapshot_id=name) for branch in branches]
        print(f"64 sessions from one state: {time.perf_counter() - begun:.3f} s")
        hashes = {step.metadata["sim"]["state_hash"] for step in steps}
        assert len(hashes) == 1
        assert {tuple(branch.step().observation["location"]) for branch in branches} == {
            tuple(wanted)
        }
        for branch in branches:
            branch.close()


def test_a_sealed_episode_has_no_snapshots_and_goes_on(base_url):
    with Session(base_url) as sealed:
        sealed.reset("trolley_saves", seed=5, scenario_config={"sealed": True})
        with pytest.raises(SessionError, match="SEALED"):
            sealed.snapshot()
        with pytest.raises(SessionError, match="SEALED"):
            sealed.reset(snapshot_id="any")
        assert sealed.step().observation["step_number"] == 1


def test_the_driver_is_not_told_of_snapshots(base_url):
    with Session(base_url) as env:
        step = env.reset("trolley_saves", seed=5)
        assert "snapshot" not in step.observation["scene_description"]
        with pytest.raises(SessionError, match="no such snapshot"):
            env.reset(snapshot_id="unknown")
        with pytest.raises(SessionError):
            env.step("snapshot")


def test_grouped_rollouts_differ_within_a_group_and_repeat(base_url):
    arguments = ("--base-url", base_url, "--branches", 6, "--turns", 6)
    first, second = (run("grouped_rollouts.py", *arguments) for _ in range(2))
    assert first.returncode == 0, first.stderr
    assert first.stdout == second.stdout
    branches = [json.loads(line) for line in first.stdout.splitlines()]
    assert len(branches) == 12
    for group in (0, 1):
        own = [one for one in branches if one["group"] == group]
        assert len({one["last"] for one in own}) > 1
        assert abs(sum(one["advantage"] for one in own)) < 0.05


def test_the_same_over_http(base_url):
    with httpx.Client(base_url=base_url, timeout=60.0) as http:

        def post(path, **body):
            answer = http.post(path, json=body)
            assert answer.status_code == 200, answer.text
            return answer.json()

        def drive(name, **action):
            return post("/step", session_id=name, action=action)["metadata"]["sim"]["state_hash"]

        scenario = {"scenario_name": "trolley_saves", "seed": 4}
        origin = post("/reset", session_id="", **scenario)["metadata"]["session_id"]
        here = drive(origin)
        kept = post("/snapshots", session_id=origin)
        assert kept["state_hash"] == here
        forked = post("/fork", session_id=origin, count=3)
        assert forked["state_hash"] == here and len(set(forked["session_ids"])) == 3
        wanted = drive(origin)
        ends = [drive(branch) for branch in forked["session_ids"][:2]]
        assert ends == [wanted, wanted]
        assert drive(forked["session_ids"][2], action_type="emergency_stop") != wanted
        post("/reset", session_id=origin, snapshot_id=kept["snapshot_id"])
        assert drive(origin) == wanted
        told = http.get("/snapshots").json()["snapshots"]
        assert kept["snapshot_id"] in {one["snapshot_id"] for one in told}
        assert http.delete(f"/snapshots/{kept['snapshot_id']}").status_code == 204
        sealed = post("/reset", session_id="", scenario_config={"sealed": True}, **scenario)
        refused = http.post("/fork", json={"session_id": sealed["metadata"]["session_id"]})
        assert refused.status_code == 400 and "SEALED" in refused.text
        # Sessions that nobody closes end by themselves; others may want their places before.
        for name in (origin, *forked["session_ids"], sealed["metadata"]["session_id"]):
            close = {"method": "openenv/session/close", "params": {"session_id": name}}
            assert post("/mcp", jsonrpc="2.0", id=1, **close)["result"]["closed"]
