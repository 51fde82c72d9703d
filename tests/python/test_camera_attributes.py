"""Goal: what a program sets on a colour camera is done to its pictures.

Method: a camera that stands, set in one way after the other through CARLA's own client, beside one
that is as it comes.
"""

import carla
import numpy as np
import pytest

from carla_site import attach

WAIT_SECS = 60.0
SIZE = {"image_size_x": "320", "image_size_y": "180"}
#: Exposure of a manual camera that shows noon as a plain one does: EV100 is 12.5.
MANUAL = {"exposure_mode": "manual", "fstop": "1.4", "iso": "100.0", "shutter_speed": "3000.0"}


class Studio:
    """Pictures of one place at noon."""

    def __init__(self, world: carla.World) -> None:
        self.world = world
        noon = carla.WeatherParameters.ClearNoon
        world.set_weather(noon)
        start = world.get_map().get_spawn_points()[0]
        self.place = carla.Transform(start.location + carla.Location(z=2.0), start.rotation)

    def take(self, turn_deg: float = 0.0, **attributes: str) -> np.ndarray:
        """Rows of red, green, blue; of a camera that turned since the frame before."""
        camera, pictures = attach(
            self.world, None, "sensor.camera.rgb", self.place, **{**SIZE, **attributes}
        )
        try:
            self.world.tick()
            image = pictures.get(timeout=WAIT_SECS)
            if turn_deg:
                rotation = carla.Rotation(yaw=self.place.rotation.yaw + turn_deg)
                camera.set_transform(carla.Transform(self.place.location, rotation))
                self.world.tick()
                image = pictures.get(timeout=WAIT_SECS)
            flat = np.frombuffer(image.raw_data, np.uint8)
            return flat.reshape(image.height, image.width, 4)[:, :, 2::-1].astype(float)
        finally:
            camera.destroy()


@pytest.fixture
def studio(world):
    return Studio(world)


def sharpness(picture: np.ndarray) -> float:
    """How much neighbours in a row differ."""
    return float(np.abs(np.diff(picture, axis=1)).mean())


def test_exposure_brightens_and_darkens(studio):
    plain = studio.take().mean()
    brighter = studio.take(exposure_compensation="1.5").mean()
    darker = studio.take(exposure_compensation="-1.5").mean()
    assert darker + 20.0 < plain and plain + 20.0 < brighter, (darker, plain, brighter)
    manual = studio.take(**MANUAL).mean()
    assert manual == pytest.approx(plain, abs=2.0)
    assert studio.take(**{**MANUAL, "iso": "400.0"}).mean() > manual + 20.0
    assert studio.take(**{**MANUAL, "shutter_speed": "12000.0"}).mean() < manual - 20.0
    # By day the light asks for an EV100 of 12.
    bounded = {"exposure_min_bright": "14.0", "exposure_max_bright": "16.0"}
    assert studio.take(**bounded).mean() < plain - 20.0
    off = studio.take(exposure_compensation="1.5", enable_postprocess_effects="False")
    assert off.mean() == pytest.approx(plain, abs=2.0)


def test_gamma_bends_the_picture(studio):
    low, plain, high = (studio.take(gamma=gamma).mean() for gamma in ("1.6", "2.2", "2.8"))
    assert low + 10.0 < plain and plain + 10.0 < high, (low, plain, high)


def test_a_lens_bends_what_is_far_from_the_middle_alone(studio):
    plain = studio.take()
    own = {"lens_circle_multiplier": "1.0", "lens_circle_falloff": "2.0"}
    bent = studio.take(lens_k="-2.0", lens_kcube="0.5", **own)
    off = np.abs(bent - plain).mean(axis=2)
    middle, corners = off[80:100, 150:170].mean(), off[[0, 0, -1, -1], [0, -1, 0, -1]].mean()
    assert off.mean() > 4.0, off.mean()
    assert middle < off.mean() / 2.0, (middle, corners)


def test_motion_blur_draws_out_what_moves_and_leaves_what_stands(studio):
    blur = {"motion_blur_intensity": "1.0", "motion_blur_max_distortion": "10.0"}
    assert np.abs(studio.take(**blur) - studio.take()).mean() < 1.0
    sharp, drawn_out = studio.take(turn_deg=6.0), studio.take(turn_deg=6.0, **blur)
    assert sharpness(drawn_out) < 0.7 * sharpness(sharp)
