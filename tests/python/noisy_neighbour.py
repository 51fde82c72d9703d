"""One who takes as much as the site gives, in a process of its own, to be killed.

Usage: noisy_neighbour.py BASE_URL CARLA_PORT KIND. Says "noisy" when its first work is done.
"""

import contextlib
import itertools
import queue
import sys

import carla
import causeway

CROWD = 200
TICKS_PER_STEP = 200
CAMERAS = 8
WIDE_PX, HIGH_PX = 1920, 1080
#: A frame of CARLA of so long is ten of the world's longest ticks, each cut as finely as may be.
FRAME_SECS = 1.0
#: Lidars whose ticks take longer than a world at its own pace has for them.
LIDARS = 6
LIDAR_POINTS_PER_SECOND = 1_300_000
SUBSTEP_SECS = 0.001
#: CARLA takes no more.
SUBSTEPS = 16


def crowd(base_url: str, _: int) -> None:
    """A session with as many others as may be, and as many ticks a step."""
    others = {"num_npc_vehicles": CROWD, "num_pedestrians": CROWD}
    with causeway.Session(base_url, connect_timeout_secs=60.0) as session:
        session.reset("free_roam", scenario_config={**others, "ticks_per_step": TICKS_PER_STEP})
        for _ in go_on():
            session.step()


def pictures(base_url: str, _: int) -> None:
    """A session that takes one large picture after the other."""
    size = {"camera_width": 4096, "camera_height": 4095}
    with causeway.Session(base_url, connect_timeout_secs=60.0) as session:
        session.reset("free_roam", scenario_config=size)
        for _ in go_on():
            session.capture()


def carla_crowd(_: str, port: int) -> None:
    """A world of CARLA with many who move, in long frames of many substeps."""
    world = synchronous(port)
    library = world.get_blueprint_library()
    cars, people = library.filter("vehicle.*"), library.filter("walker.pedestrian.*")
    brain = library.find("controller.ai.walker")
    with contextlib.suppress(IndexError):
        for count, place in enumerate(itertools.cycle(world.get_map().get_spawn_points())):
            place.location.z += 3.0 * (count // 70)
            car = world.try_spawn_actor(cars[count % len(cars)], place)
            if car is not None:
                car.apply_control(carla.VehicleControl(throttle=0.5, steer=0.2))
            if count >= CROWD:
                break
    walkers = 0
    while walkers < CROWD:
        at = carla.Transform(world.get_random_location_from_navigation())
        walker = world.try_spawn_actor(people[walkers % len(people)], at)
        if walker is not None:
            world.spawn_actor(brain, carla.Transform(), walker)
            walkers += 1
    world.tick()
    for one in world.get_actors().filter("controller.ai.walker"):
        one.start()
        one.go_to_location(world.get_random_location_from_navigation())
    for _ in go_on():
        world.tick(120.0)


def film(_: str, port: int) -> None:
    """Eight large cameras."""
    world = synchronous(port, frame_secs=0.05)
    blueprint = world.get_blueprint_library().find("sensor.camera.rgb")
    blueprint.set_attribute("image_size_x", str(WIDE_PX))
    blueprint.set_attribute("image_size_y", str(HIGH_PX))
    taken, cameras = queue.Queue(), []
    for place in world.get_map().get_spawn_points()[:CAMERAS]:
        place.location.z += 2.0
        cameras.append(world.spawn_actor(blueprint, place))
        cameras[-1].listen(lambda image: taken.put(image.frame))
    for _ in go_on():
        world.tick(120.0)
        for _ in range(CAMERAS):
            taken.get(timeout=120.0)


def overload(_: str, port: int) -> None:
    """A world at its own pace that cannot keep it."""
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(120.0)
    world = client.get_world()
    blueprint = world.get_blueprint_library().find("sensor.lidar.ray_cast")
    for name, value in {
        "points_per_second": LIDAR_POINTS_PER_SECOND,
        "channels": 64,
        "rotation_frequency": 20,
        "range": 100,
    }.items():
        blueprint.set_attribute(name, str(value))
    measured, lidars = queue.Queue(), []
    for place in world.get_map().get_spawn_points()[:LIDARS]:
        place.location.z += 2.0
        lidars.append(world.spawn_actor(blueprint, place))
        lidars[-1].listen(lambda scan: measured.put(scan.frame))
    for _ in go_on():
        measured.get(timeout=120.0)


def synchronous(port: int, frame_secs: float = FRAME_SECS) -> carla.World:
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(120.0)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = frame_secs
    settings.max_substep_delta_time = SUBSTEP_SECS
    settings.max_substeps = SUBSTEPS
    world.apply_settings(settings)
    return world


def go_on():
    """For ever; says so when the first round is over."""
    yield
    print("noisy", flush=True)
    while True:
        yield


KINDS = {kind.__name__: kind for kind in (crowd, pictures, carla_crowd, film, overload)}

if __name__ == "__main__":
    KINDS[sys.argv[3]](sys.argv[1], int(sys.argv[2]))
