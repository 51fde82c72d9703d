"""Textures on things of the map, through CARLA's own client: what cameras show before and after."""

import queue

import carla
import numpy as np
import pytest

from carla_site import MAP, ticks
from test_carla_layers import house_and_view

WAIT_SECS = 60.0
WIDE_PX, HIGH_PX = 160, 90
DIFFUSE, EMISSIVE = carla.MaterialParameter.Diffuse, carla.MaterialParameter.Emissive
RED, GREEN, BLUE = carla.Color(220, 0, 0), carla.Color(0, 220, 0), carla.Color(0, 0, 220)


def texture(left: carla.Color, right: carla.Color, size: int = 64) -> carla.TextureColor:
    """Of one colour to the left and another to the right."""
    made = carla.TextureColor(size, size)
    for x in range(size):
        for y in range(size):
            made.set(x, y, left if x < size // 2 else right)
    return made


class Eye:
    """Cameras of some kinds at one place."""

    def __init__(self, world: carla.World, place: carla.Transform, *kinds: str):
        self.world, self.seen = world, []
        for kind in kinds:
            blueprint = world.get_blueprint_library().find(f"sensor.camera.{kind}")
            blueprint.set_attribute("image_size_x", str(WIDE_PX))
            blueprint.set_attribute("image_size_y", str(HIGH_PX))
            camera, pictures = world.spawn_actor(blueprint, place), queue.Queue()
            camera.listen(pictures.put)
            self.seen.append((camera, pictures))

    def look(self) -> list[np.ndarray]:
        """A picture of each after the next tick, as rows of red, green, blue."""
        self.world.tick()
        taken = [pictures.get(timeout=WAIT_SECS) for _, pictures in self.seen]
        rows = [np.reshape(bytearray(one.raw_data), (HIGH_PX, WIDE_PX, 4)) for one in taken]
        return [one[:, :, 2::-1].astype(int) for one in rows]

    def close(self):
        for camera, _ in self.seen:
            camera.stop()
            camera.destroy()


@pytest.fixture
def house(world):
    """A house and an eye on one of its walls, after the first frame."""
    house, place = house_and_view(world)
    eye = Eye(world, place, "rgb")
    eye.look()
    yield house, eye
    eye.close()


def changed(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Where pixels are not what they were."""
    return np.abs(before - after).max(axis=2) > 0


def beside(mask: np.ndarray) -> np.ndarray:
    """Pixels of a mask and their neighbours: edges are soft."""
    wide = np.pad(mask, 1)
    across = wide[1:-1, :-2] | wide[1:-1, 2:]
    return mask | across | wide[:-2, 1:-1] | wide[2:, 1:-1]


def within(mask: np.ndarray) -> np.ndarray:
    """Pixels of a mask whose neighbours are in it, too."""
    return ~beside(~mask)


def is_mostly(picture: np.ndarray, channel: int) -> np.ndarray:
    """Where one of red, green and blue is far above the others."""
    others = np.delete(picture, channel, axis=2).max(axis=2)
    return picture[:, :, channel] > 2 * others + 20


def test_a_house_shows_a_texture_the_right_way_round_and_nothing_else_does(world, house):
    house, eye = house
    (before,) = eye.look()
    world.apply_color_texture_to_object(house.name, DIFFUSE, texture(RED, BLUE))
    (after,) = eye.look()
    painted = changed(before, after)
    red, blue = is_mostly(after, 0) & painted, is_mostly(after, 2) & painted
    assert painted.mean() > 0.25 and (red | blue)[within(painted)].mean() > 0.98
    # The eye looks at the middle of the house.
    assert red[:, : WIDE_PX // 4].sum() > 5 * blue[:, : WIDE_PX // 4].sum()
    assert blue[:, -WIDE_PX // 4 :].sum() > 5 * red[:, -WIDE_PX // 4 :].sum()
    world.apply_color_texture_to_object(house.name, DIFFUSE, texture(GREEN, GREEN))
    (again,) = eye.look()
    assert is_mostly(again, 1)[within(painted)].mean() > 0.98
    assert not changed(before, again)[~beside(painted)].any()


def test_depth_and_tags_are_as_without_a_texture(world):
    house, place = house_and_view(world)
    eye = Eye(world, place, "rgb", "depth", "semantic_segmentation", "instance_segmentation")
    eye.look()
    before = eye.look()
    shine = carla.TextureFloatColor(1, 1)
    shine.set(0, 0, carla.FloatColor(3.0, 0.0, 0.0, 1.0))
    empty = carla.TextureFloatColor(0, 0)
    world.apply_textures_to_object(house.name, texture(RED, BLUE), shine, empty, empty)
    after = eye.look()
    eye.close()
    assert changed(before[0], after[0]).mean() > 0.1
    for plain, painted in zip(before[1:], after[1:], strict=True):
        assert not changed(plain, painted).any()


def test_each_thing_has_its_own(world, house):
    house, eye = house
    (before,) = eye.look()
    world.apply_color_texture_to_objects([house.name, "no such thing"], DIFFUSE, texture(RED, RED))
    (one,) = eye.look()
    others = [name for name in world.get_names_of_all_objects() if name != house.name]
    world.apply_color_texture_to_objects(others, DIFFUSE, texture(GREEN, GREEN))
    (both,) = eye.look()
    assert changed(before, one).mean() > 0.25
    # Edges of what stands before the house take on some of it.
    assert changed(one, both)[within(changed(before, one))].mean() < 0.02
    assert is_mostly(both, 1)[within(changed(one, both))].mean() > 0.95


def test_light_of_a_texture_is_seen_by_night(world, house):
    house, eye = house
    world.set_weather(carla.WeatherParameters(sun_altitude_angle=-90.0))
    (dark,) = eye.look()
    shine = carla.TextureFloatColor(2, 2)
    for x in range(2):
        for y in range(2):
            shine.set(x, y, carla.FloatColor(0.0, 2.0, 0.0, 1.0))
    world.apply_float_color_texture_to_object(house.name, EMISSIVE, shine)
    (lit,) = eye.look()
    bright = (lit[:, :, 1] > 200) & is_mostly(lit, 1)
    assert dark.mean() < 100 and bright.mean() > 0.25


def test_names_that_nothing_has_are_left_out_unless_none_is_left(world):
    name = world.get_names_of_all_objects()[0]
    world.apply_color_texture_to_objects(["nothing", name], DIFFUSE, texture(RED, RED, 2))
    for names in (["nothing"], []):
        with pytest.raises(RuntimeError, match="unable to find Actor to apply the texture"):
            world.apply_color_texture_to_objects(names, DIFFUSE, texture(RED, RED, 2))
    with pytest.raises(RuntimeError, match="no pixels"):
        world.apply_color_texture_to_object(name, DIFFUSE, carla.TextureColor(0, 0))
    bumps = carla.TextureFloatColor(2, 2)
    for parameter in (
        carla.MaterialParameter.Normal,
        carla.MaterialParameter.AO_Roughness_Metallic_Emissive,
    ):
        world.apply_float_color_texture_to_object(name, parameter, bumps)


def test_one_texture_is_on_many_things_and_many_are_refused(world):
    names = [one.name for one in world.get_environment_objects(carla.CityObjectLabel.Buildings)]
    assert len(names) > 20
    wide = carla.TextureColor(600, 512)
    for _ in range(3):
        world.apply_color_texture_to_objects(names, DIFFUSE, wide)
    refusals = 0
    for at, name in enumerate(names[:14]):
        wide.set(0, 0, carla.Color(10 * at + 9, 0, 0))
        wide.set(1, 0, carla.Color(10 * at + 9, 0, 0))
        try:
            world.apply_color_texture_to_object(name, DIFFUSE, wide)
        except RuntimeError as error:
            refusals += 1
            assert "no room for more paint" in str(error) and "8388608" in str(error)
    assert refusals == 5


def test_a_new_map_has_no_paint(client):
    world = client.load_world(MAP)
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    house, place = house_and_view(world)
    world.apply_color_texture_to_object(house.name, DIFFUSE, texture(RED, RED))
    eye = Eye(world, place, "rgb")
    ticks(world, 1)
    assert is_mostly(eye.look()[0], 0).mean() > 0.1
    eye.close()
    world = client.reload_world(reset_settings=False)
    eye = Eye(world, place, "rgb")
    ticks(world, 1)
    assert is_mostly(eye.look()[0], 0).mean() < 0.01
    eye.close()
    settings.synchronous_mode = False
    world.apply_settings(settings)
