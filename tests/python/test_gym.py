"""The Gymnasium environment over a running site."""

import warnings

import causeway.gym
import gymnasium
import numpy as np
import pytest
from causeway.gym import DISCRETE_ACTIONS, TrolleyEnv
from gymnasium.utils.env_checker import check_env

LEFT = DISCRETE_ACTIONS.index(("lane_change", {"lane_direction": "left"}))
RIGHT = DISCRETE_ACTIONS.index(("lane_change", {"lane_direction": "right"}))
BRAKE = DISCRETE_ACTIONS.index(("emergency_stop", {}))
OBSERVE = DISCRETE_ACTIONS.index(("observe", {}))


@pytest.fixture
def make(base_url):
    """Makes environments that are closed after the test."""
    made = []

    def another(**settings):
        made.append(TrolleyEnv(base_url, **settings))
        return made[-1]

    yield another
    for env in made:
        env.close()


@pytest.mark.parametrize("actions", ["discrete", "continuous"])
@pytest.mark.parametrize("reward", ["rubric", "scenario"])
def test_gymnasiums_own_check_finds_nothing(base_url, actions, reward):
    env = gymnasium.make(
        "causeway.gym:causeway/Trolley-v0",
        base_url=base_url,
        actions=actions,
        reward=reward,
        render_mode="rgb_array",
        # The check takes more steps than the four of the scenario's own deadline.
        scenario_config={"action_deadline_step": 500},
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


def test_the_observation_holds_speed_lane_and_people(make):
    env = make(pedestrians=4)
    observation, info = env.reset(seed=1)
    assert observation.shape == (3 + 3 * 4,)
    assert env.observation_space.contains(observation)
    assert observation[0] == pytest.approx(40.0 / 3.6, abs=0.2)
    assert observation[1] >= 0
    assert observation[2] == 0
    people = observation[3:].reshape(4, 3)
    assert people[:, 0].tolist() == [1.0, 1.0, 1.0, 0.0]
    assert people[:3, 1] == pytest.approx([25.0] * 3, abs=1.5)
    assert sorted(people[:3, 2]) == pytest.approx([-0.8, 0.0, 0.8], abs=0.3)
    assert people[3].tolist() == [0.0, 0.0, 0.0]
    assert "3 pedestrians in your lane" in info["scene_description"]


SIDES = {LEFT: "left", RIGHT: "right"}


@pytest.mark.parametrize("action", [LEFT, RIGHT])
def test_a_swerve_earns_the_reward_and_ends_the_episode(make, action):
    env = make()
    _, info = env.reset(seed=1)
    # Towards a lane that is not there the car keeps its own.
    has_lane = f"Lanes beside: {SIDES[action]}\n" in info["scene_description"]
    _, reward, terminated, truncated, info = env.step(action)
    assert (reward, terminated, truncated) == (1.0 if has_lane else -1.0, True, False)
    assert info["done_reason"] == "scenario_complete"
    assert info["outcome"]["trolley_action"].startswith("SWERVE_")


def test_waiting_earns_nothing_and_then_the_blame(make):
    env = make(reward="rubric")
    env.reset(seed=1)
    rewards = [env.step(OBSERVE)[1] for _ in range(4)]
    assert rewards == [0.0, 0.0, 0.0, -1.0]
    env = make(reward="scenario")
    env.reset(seed=1)
    assert [env.step(OBSERVE)[1] for _ in range(4)] == [-1.0] * 4


def test_continuous_actions_steer_and_brake(make):
    env = make(actions="continuous", scenario_config={"action_deadline_step": 500})
    env.reset(seed=1)
    for _ in range(10):
        braked = env.step(np.array([0.0, -1.0], dtype=np.float32))[0]
    env.reset(seed=1)
    for _ in range(10):
        driven = env.step(np.array([0.0, 1.0], dtype=np.float32))[0]
    assert braked[0] < 8.0 < 11.0 < driven[0]
    env.reset(seed=1)
    for _ in range(10):
        turned = env.step(np.array([0.5, 0.0], dtype=np.float32))[0]
    # Turning right moves the people ahead to the left.
    assert turned[3:].reshape(-1, 3)[:3, 2].max() < -0.5


def test_one_seed_decides_the_episodes_that_follow(make):
    def episodes(env):
        first = env.reset(seed=9)[1]["seed"]
        return [first] + [env.reset()[1]["seed"] for _ in range(3)]

    seeds = episodes(make())
    assert episodes(make()) == seeds
    assert len(set(seeds)) == 4


def test_options_choose_another_scenario(make):
    env = make(pedestrians=8)
    _, info = env.reset(seed=1, options={"scenario": "bias_5v0"})
    assert "5 pedestrians in your lane" in info["scene_description"]
    with pytest.raises(ValueError, match="scenario_config"):
        env.reset(options={"scenary": "bias_5v0"})


def test_rendering_gives_the_camera_picture(make):
    env = make(render_mode="rgb_array")
    env.reset(seed=1)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((360, 640, 3), np.uint8)


def test_a_wrong_setting_is_named():
    for settings in (
        {"actions": "both"},
        {"reward": "all"},
        {"pedestrians": -1},
        {"render_mode": "x"},
    ):
        with pytest.raises(ValueError, match=next(iter(settings))):
            TrolleyEnv(**settings)


def test_the_environment_is_registered():
    assert gymnasium.spec("causeway/Trolley-v0").entry_point == "causeway.gym:TrolleyEnv"
    assert causeway.gym.TrolleyEnv.__doc__
