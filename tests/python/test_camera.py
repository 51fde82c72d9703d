"""`capture_image`: what the renderer draws, and that time stands still meanwhile."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

from driving import act, session


@pytest.fixture
def env(base_url):
    with session(base_url) as env:
        yield env


def capture(env):
    """The picture as bytes of a JPEG file."""
    result = act(env, "capture_image")
    assert result.observation.camera_image is not None, result.observation.metadata
    return base64.b64decode(result.observation.camera_image, validate=True)


def pixels(jpeg):
    """Shape `(height, width, 3)`, row 0 at the top."""
    with Image.open(io.BytesIO(jpeg)) as image:
        assert image.format == "JPEG"
        return np.asarray(image.convert("RGB"), dtype=np.float64)


def test_the_picture_is_a_jpeg_of_640_by_360(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    jpeg = capture(env)
    assert pixels(jpeg).shape == (360, 640, 3)
    assert len(jpeg) < 700_000, "the reply with its base64 must stay below 1 MiB"


def test_the_picture_shows_a_scene(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    scene = pixels(capture(env))
    # Between the houses.
    sky = scene[:60, 250:370].mean(axis=(0, 1))
    road = scene[300:, 200:440].mean(axis=(0, 1))
    assert scene.std() > 15.0, "a blank picture"
    assert sky[2] > road[2] + 60.0, (
        f"at noon the sky {sky} is bluer and brighter than the road {road}"
    )


def test_the_picture_shows_people_only_where_there_are_some(env):
    """The same place with and without people: their pixels differ, most others do not."""
    pictures = []
    for count in (5, 0):
        env.reset(scenario_name="bias_5v0", scenario_config={"center_count": count}, seed=3)
        pictures.append(pixels(capture(env)))
    changed = np.abs(pictures[0] - pictures[1]).max(axis=2) > 40.0
    middle = changed[120:260, 160:480]
    assert middle.sum() > 100, "five people 25 m ahead cover more than a hundred pixels"
    assert changed.sum() < 0.1 * changed.size, "people do not change the rest of the town"


def test_a_picture_takes_no_time_and_is_no_turn(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    before = act(env).observation
    result = act(env, "capture_image")
    seen = result.observation
    assert (result.reward, result.done, seen.rubric_reward) == (0.0, False, None)
    unchanged = ("simulation_time", "step_number", "location", "speed_kmh", "nearby_actors")
    for field in unchanged:
        assert getattr(seen, field) == getattr(before, field), field
    after = act(env).observation
    assert after.step_number == before.step_number + 1
    assert after.camera_image is None


def test_the_same_state_gives_the_same_bytes(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    first = capture(env)
    assert capture(env) == first
    env.reset(scenario_name="trolley_saves", seed=1)
    assert capture(env) == first


def test_the_picture_follows_the_car(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    before = pixels(capture(env))
    for _ in range(20):
        act(env)
    after = pixels(capture(env))
    assert np.abs(after - before).mean() > 2.0


def test_pictures_can_be_taken_after_the_end(env):
    env.reset(scenario_name="trolley_saves", seed=1)
    for _ in range(5):
        result = act(env)
    assert result.done
    picture = act(env, "capture_image")
    assert picture.done
    assert picture.observation.camera_image


def test_size_is_a_setting_and_stays(env):
    env.reset(seed=1, scenario_config={"camera_width": 1280, "camera_height": 720})
    assert pixels(capture(env)).shape == (720, 1280, 3)
    env.reset(seed=1, scenario_config={"camera_width": 320})
    assert pixels(capture(env)).shape == (720, 320, 3)
    env.reset(seed=1)
    assert pixels(capture(env)).shape == (720, 320, 3)


def test_quality_and_field_of_view_are_settings(env):
    env.reset(seed=1)
    normal = capture(env)
    env.reset(seed=1, scenario_config={"jpeg_quality": 20})
    coarse = capture(env)
    assert len(coarse) < 0.7 * len(normal)
    env.reset(seed=1, scenario_config={"reset_defaults": True, "camera_fov": 40})
    assert np.abs(pixels(capture(env)) - pixels(normal)).mean() > 2.0


def test_without_a_renderer_everything_else_works_and_the_answer_says_why(start_site):
    with session(start_site("--no-render").base_url) as env:
        env.reset(scenario_name="trolley_saves", seed=1)
        result = act(env, "capture_image")
        assert result.observation.camera_image is None
        assert "render" in result.observation.metadata["camera_error"]
        assert result.reward == 0.0
        assert act(env).observation.step_number == 1


def bright(env) -> tuple[int, int]:
    """How many pixels of the present view are as red as a lamp that is lit, and as green."""
    red, green, blue = pixels(capture(env)).transpose(2, 0, 1)
    reds = (red > 180) & (green < 110) & (blue < 110)
    greens = (green > 180) & (red < 130) & (blue < 190)
    return int(reds.sum()), int(greens.sum())


def test_who_waits_at_a_light_sees_it_red_and_then_green(env):
    settings = {"max_steps": 3000, "camera_width": 960, "camera_height": 540}
    env.reset(scenario_name="free_roam_Town10HD_Opt_v0_p0", scenario_config=settings, seed=6)
    act(env, "init_navigation_agent", navigation_behavior="normal")
    seen = {}
    for _ in range(800):
        now = act(env, "follow_route", route_steps=2).observation
        light = now.metadata.get("traffic_light") or {"state": None}
        if now.speed_kmh < 1.0 and light["state"] in ("red", "green") and light["distance"] < 8.0:
            seen.setdefault(light["state"], bright(env))
        if "red" in seen and "green" in seen:
            break
    (reds, green_beside_red), (red_beside_green, greens) = seen["red"], seen["green"]
    # Lamps of other lights are seen too, smaller or aslant.
    assert reds > max(50, 3 * green_beside_red), seen
    assert greens > max(50, 3 * red_beside_green), seen
