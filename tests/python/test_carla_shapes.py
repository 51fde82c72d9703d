"""Shapes that programs draw, in the pictures of CARLA's own client."""

import carla
import numpy as np
import pytest

from carla_site import attach

WAIT_SECS = 30.0
PX = 121
AHEAD_M = 10.0
MAGENTA = carla.Color(255, 0, 255)
# Above all roofs, looking along x: nothing but sky.
EYE = carla.Transform(carla.Location(z=150.0), carla.Rotation(pitch=20.0))


@pytest.fixture
def painted(world):
    """The pixels of the drawn colour after one more tick."""
    size = {"image_size_x": str(PX), "image_size_y": str(PX)}
    camera, pictures = attach(world, None, "sensor.camera.rgb", EYE, **size)

    def look() -> np.ndarray:
        frame = world.tick()
        image = pictures.get(timeout=WAIT_SECS)
        assert image.frame == frame
        rows = np.frombuffer(image.raw_data, np.uint8).reshape(PX, PX, 4)
        return (rows[:, :, :3] == (255, 0, 255)).all(axis=2)

    assert not look().any()
    yield look
    camera.destroy()


def before(aside_m: float = 0.0, above_m: float = 0.0) -> carla.Location:
    """A place `AHEAD_M` before the eye, from where a metre is 6 pixels."""
    place = EYE.location + EYE.get_forward_vector() * AHEAD_M
    place += EYE.get_right_vector() * aside_m
    return carla.Location(place + EYE.get_up_vector() * above_m)


def extent(mask: np.ndarray) -> list[int]:
    """Left, right, upper and lower edge."""
    rows, columns = np.nonzero(mask)
    return [columns.min(), columns.max(), rows.min(), rows.max()]


def test_a_point_is_where_it_is_drawn(world, painted):
    world.debug.draw_point(before(3.0, 2.0), 0.2, MAGENTA, 1.0)
    left, right, top, bottom = extent(painted())
    pixels_per_metre = PX / 2 / AHEAD_M
    assert (left + right) / 2 == pytest.approx(PX / 2 + 3.0 * pixels_per_metre, abs=2.0)
    assert (top + bottom) / 2 == pytest.approx(PX / 2 - 2.0 * pixels_per_metre, abs=2.0)


def test_a_line_reaches_from_end_to_end(world, painted):
    world.debug.draw_line(before(-5.0), before(5.0), 0.1, MAGENTA, 1.0)
    left, right, top, bottom = extent(painted())
    assert (left, right) == pytest.approx((PX / 2 - 30, PX / 2 + 30), abs=2.0)
    assert bottom - top < 4


def test_an_arrow_is_wider_at_its_head(world, painted):
    world.debug.draw_arrow(before(-5.0), before(5.0), 0.1, 1.0, MAGENTA, 1.0)
    mask = painted()
    high = mask.sum(axis=0)
    assert high[PX // 2 + 15 :].max() > 2 * high[PX // 2 - 20 : PX // 2].max()


def test_a_box_shows_its_edges_and_not_its_sides(world, painted):
    box = carla.BoundingBox(before(), carla.Vector3D(0.5, 4.0, 3.0))
    world.debug.draw_box(box, EYE.rotation, 0.1, MAGENTA, 1.0)
    mask = painted()
    left, right, top, bottom = extent(mask)
    assert right - left > 40 and bottom - top > 30
    assert not mask[PX // 2 - 3 : PX // 2 + 3, PX // 2 - 3 : PX // 2 + 3].any()


def test_shapes_last_as_long_as_they_were_told(world, painted):
    world.debug.draw_point(before(), 0.3, MAGENTA, 0.12)
    assert [bool(painted().any()) for _ in range(4)] == [True, True, False, False]


@pytest.mark.parametrize("life_secs", [-1.0, 0.0])
def test_shapes_without_a_time_stay_until_they_are_cleared(world, painted, life_secs):
    world.debug.draw_line(before(-2.0), before(2.0), 0.1, MAGENTA, life_secs)
    for _ in range(30):
        assert painted().any()
    world.debug.clear_debug_shape()
    assert not painted().any()


def test_a_longer_text_is_wider_and_stands_where_it_is_drawn(world, painted):
    widths = []
    for text in ("here", "here and there"):
        world.debug.draw_string(before(-8.0), text, False, MAGENTA, 0.06)
        left, right, top, bottom = extent(painted())
        assert 0 <= left < PX // 2 and abs((top + bottom) / 2 - PX / 2) < 12.0
        widths.append(right - left)
        assert not painted().any()
    assert widths[1] > 2 * widths[0]


def test_shapes_of_the_screen_are_in_no_picture(world, painted):
    draw = world.debug
    draw.draw_hud_point(before(), 0.5, MAGENTA, 1.0)
    draw.draw_hud_line(before(), before(3.0), 0.5, MAGENTA, 1.0)
    draw.draw_hud_arrow(before(), before(3.0), 0.5, 0.5, MAGENTA, 1.0)
    box = carla.BoundingBox(before(), carla.Vector3D(1.0, 1.0, 1.0))
    draw.draw_hud_box(box, EYE.rotation, 0.5, MAGENTA, 1.0)
    assert not painted().any()
