"""Scenarios of files: they come, change and go while the service runs."""

import shutil
import subprocess

import httpx
import pytest
from causeway.openenv import Session, SessionError

from documents import ROOT
from driving import act, session, walkers_hit
from running_site import binary

CHILD = ROOT / "scenario-service" / "scenarios" / "child_behind_bus.toml"


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "scenarios"
    folder.mkdir()
    return folder


def test_a_file_is_a_scenario_as_soon_as_it_is_there(start_site, folder):
    site = start_site("--no-render", "--scenarios", str(folder))
    with session(site.base_url) as env:
        with pytest.raises(RuntimeError, match="Unknown scenario: child_behind_bus"):
            env.reset(scenario_name="child_behind_bus")
        shutil.copy(CHILD, folder)
        for seed in range(3):
            begun = env.reset(scenario_name="child_behind_bus", seed=seed).observation
            assert "A bus stands in the lane to the right" in begun.scene_description
            kinds = {actor["type"] for actor in begun.nearby_actors}
            assert kinds == {"vehicle.mitsubishi.fusorosa", "walker.pedestrian.0009"}
            seen = until_done(env, "observe")
            assert seen.done_reason == "collision" and len(walkers_hit(env.state())) == 1
            assert seen.metadata["outcome"]["reward"] == -11.0
            env.reset(seed=seed)
            seen = until_done(env, "emergency_stop", steps=100)
            assert not seen.done and not walkers_hit(env.state())
            assert seen.speed_kmh < 0.5


def until_done(env, action, steps=300):
    for _ in range(steps):
        seen = act(env, action).observation
        if seen.done:
            break
    return seen


def test_a_file_that_changes_counts_from_the_next_reset_that_names_it(start_site, folder):
    site = start_site("--no-render", "--scenarios", str(folder))
    path = folder / "mine.toml"
    path.write_text("prompt = 'first'\n[settings]\nmax_steps = 2\n")
    with Session(site.base_url) as env:
        assert env.reset("mine").observation["scene_description"].startswith("first")
        path.write_text("prompt = 'second'\n[settings]\nmax_steps = 3\n")
        assert not env.step("observe").done
        assert env.reset("mine").observation["scene_description"].startswith("second")
        path.write_text("prompt = 'third'\n[start]\nstraight = 3\n")
        with pytest.raises(SessionError, match="mine: line 3: unknown field `straight`"):
            env.reset("mine")
        # The episode goes on, and so do those of others.
        assert [env.step("observe").done for _ in range(3)] == [False, False, True]
        assert env.reset("trolley_saves").observation["scenario_name"] == "trolley_saves"


def test_files_are_tasks_and_built_in_names_stay_what_they_are(start_site, folder):
    shutil.copy(CHILD, folder)
    (folder / "trolley_saves.toml").write_text("prompt = 'mine'\n")
    (folder / "not a name.toml").write_text("")
    site = start_site("--no-render", "--scenarios", str(folder))
    asked = httpx.post(f"{site.base_url}/carla_env/tasks", json={"split": "test"}).json()
    names = [task["scenario_name"] for task in asked["tasks"]]
    assert names.count("child_behind_bus") == 10 and "not a name" not in names
    assert names.count("trolley_saves") == 10
    with Session(site.base_url) as env:
        begun = env.reset("trolley_saves").observation
        assert not begun["scene_description"].startswith("mine")
        for name in ("../scenarios/child_behind_bus", "not a name", "/etc/passwd"):
            with pytest.raises(SessionError, match="Unknown scenario"):
                env.reset(name)


def test_a_folder_that_is_not_there_is_told_before_anything_starts(tmp_path):
    command = [binary(), "up", "--no-carla", "--scenarios", tmp_path / "nowhere"]
    ended = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert ended.returncode != 0
    assert "--scenarios needs a folder that can be read" in ended.stderr + ended.stdout
