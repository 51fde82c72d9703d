"""Goal: a session and a camera of CARLA's clients say how finely their pictures are drawn.

Method: one site that draws on processors, as a GPU has one quality; the same place in both.
"""

import base64
import io
import queue

import carla
import numpy as np
import pytest
from PIL import Image

from carla_site import fresh, synchronous
from driving import act, session

WAIT_SECS = 60.0


@pytest.fixture(scope="module")
def drawing(tmp_path_factory):
    from running_site import start, stop

    site = start(tmp_path_factory.mktemp("quality") / "log", CAUSEWAY_ADAPTER="cpu")
    yield site
    stop(site)


def is_coarser(low: np.ndarray, high: np.ndarray) -> bool:
    """Of the same place, and with less in it."""
    off = np.abs(low.astype(float) - high.astype(float))
    return 0.0 < off.mean() < 20.0 and (off > 0.0).mean() > 0.01


def drawn(env, **settings) -> bytes:
    """The first picture of an episode, the same one in every session."""
    env.reset(scenario_name="trolley_saves", scenario_config=settings, seed=1)
    result = act(env, "capture_image")
    return base64.b64decode(result.observation.camera_image, validate=True)


def pixels(jpeg: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(jpeg)) as image:
        return np.asarray(image.convert("RGB"))


@pytest.mark.parametrize("flags", [("-quality-level=Low",), ("--quality", "low")])
def test_a_site_says_how_its_pictures_are_drawn(drawing, start_site, flags):
    coarse = start_site(*flags, CAUSEWAY_ADAPTER="cpu")
    with session(drawing.base_url) as fine, session(coarse.base_url) as env:
        high = drawn(fine)
        low = drawn(env)
        assert is_coarser(pixels(low), pixels(high))
        assert low == drawn(fine, camera_quality="low")
        assert drawn(env, camera_quality="high") == high


def test_a_session_says_how_its_pictures_are_drawn(drawing):
    with session(drawing.base_url) as env:
        as_the_site = drawn(env)
        low, high = drawn(env, camera_quality="low"), drawn(env, camera_quality="high")
        assert high == as_the_site
        assert is_coarser(pixels(low), pixels(high))
        # It lasts until something else is said.
        assert drawn(env, camera_quality="low") == drawn(env) == low
        assert drawn(env, camera_quality=None) == as_the_site
    with (
        session(drawing.base_url) as env,
        pytest.raises(RuntimeError, match=r"camera_quality.*low, high or null.*best"),
    ):
        env.reset(scenario_config={"camera_quality": "best"})


def test_a_camera_of_carlas_clients_says_how_its_pictures_are_drawn(drawing):
    world = fresh(drawing.carla_port).get_world()
    start = world.get_map().get_spawn_points()[0]
    place = carla.Transform(start.location + carla.Location(z=2.0), start.rotation)
    library = world.get_blueprint_library()

    def camera(quality: str) -> carla.Sensor:
        blueprint = library.find("sensor.camera.rgb")
        for name, value in {"image_size_x": "320", "image_size_y": "180"}.items():
            blueprint.set_attribute(name, value)
        blueprint.set_attribute("picture_quality", quality)
        return world.spawn_actor(blueprint, place)

    with synchronous(world):
        drawn = {}
        for quality in ("low", "high", "site"):
            pictures = queue.Queue()
            eye = camera(quality)
            eye.listen(pictures.put)
            frame = world.tick()
            while (image := pictures.get(timeout=WAIT_SECS)).frame < frame:
                pass
            drawn[quality] = np.frombuffer(image.raw_data, np.uint8).copy()
            eye.destroy()
        assert is_coarser(drawn["low"], drawn["high"])
        # Between two of them time passes, and shadows move a little.
        assert np.abs(drawn["site"].astype(float) - drawn["high"]).mean() < 0.1
        with pytest.raises(RuntimeError, match=r"best.*: wanted one of site, low, high"):
            camera("best")
