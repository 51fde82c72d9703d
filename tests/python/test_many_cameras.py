"""Goal: however many cameras are due in a tick, each sends its picture of that tick.

Method: more cameras, and more pixels, than one job of a renderer may have, in one synchronous tick.
"""

import queue

import carla
import pytest

from carla_site import synchronous

WAIT_SECS = 120.0
TINY_PX = (8, 6)
LARGE_PX = (1920, 1080)
#: Most cameras of one world.
CAMERAS_MAX = 1_024


def blueprint_of(world: carla.World, kind: str, size_px: tuple[int, int]) -> carla.ActorBlueprint:
    blueprint = world.get_blueprint_library().find(f"sensor.camera.{kind}")
    for name, pixels in zip(("image_size_x", "image_size_y"), size_px, strict=True):
        blueprint.set_attribute(name, str(pixels))
    return blueprint


def place(world: carla.World) -> carla.Transform:
    start = world.get_map().get_spawn_points()[0]
    return carla.Transform(start.location + carla.Location(z=2.0), start.rotation)


def pictures_of_one_tick(world: carla.World, sizes_px: list[tuple[int, int]]) -> None:
    """Each of so many cameras sends one picture, of the tick's frame and of its size."""
    at = place(world)
    cameras, arrivals = [], []
    with synchronous(world):
        try:
            for size_px in sizes_px:
                camera = world.spawn_actor(blueprint_of(world, "rgb", size_px), at)
                cameras.append(camera)
                arrived = queue.Queue()
                camera.listen(arrived.put)
                arrivals.append(arrived)
            for _ in range(2):
                frame = world.tick()
                for arrived, size_px in zip(arrivals, sizes_px, strict=True):
                    image = arrived.get(timeout=WAIT_SECS)
                    assert (image.frame, image.width, image.height) == (frame, *size_px)
                    assert len(image.raw_data) == 4 * size_px[0] * size_px[1]
        finally:
            for camera in cameras:
                camera.destroy()
    assert all(arrived.empty() for arrived in arrivals)


def test_more_cameras_than_one_job_may_have_all_send_the_pictures_of_a_tick(world):
    pictures_of_one_tick(world, [TINY_PX] * 70)


def test_more_pixels_than_one_job_may_have_all_come_with_the_tick(world):
    pictures_of_one_tick(world, [LARGE_PX] * 9)


def test_a_picture_that_can_never_be_drawn_is_refused_when_its_camera_is_spawned(world):
    with pytest.raises(RuntimeError, match=r"at most 16773120 pixels, found 4096 times 4096"):
        world.spawn_actor(blueprint_of(world, "rgb", (4096, 4096)), place(world))
    camera = world.spawn_actor(blueprint_of(world, "depth", (4096, 4094)), place(world))
    camera.destroy()


def test_cameras_are_bounded_and_the_refusal_says_so(client, world):
    blueprint, at = blueprint_of(world, "rgb", TINY_PX), place(world)
    spawn = carla.command.SpawnActor(blueprint, at)
    answers = client.apply_batch_sync([spawn] * (CAMERAS_MAX + 6), False)
    refused = [answer.error for answer in answers if answer.has_error()]
    made = [answer.actor_id for answer in answers if not answer.has_error()]
    client.apply_batch_sync([carla.command.DestroyActor(actor) for actor in made], False)
    assert len(made) == CAMERAS_MAX
    assert len(refused) == 6
    assert all("found 1024 cameras" in text and "destroy some" in text for text in refused)
