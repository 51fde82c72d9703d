"""Goal: the world of CARLA's clients outlives the service that has it, and they cannot tell.

Method: do the same twice, once on a quiet site and once on one whose world service is killed now
and then, and compare everything that clients see, bit for bit.
"""

import os
import queue
import re
import signal
import threading
import time

import carla
import pytest

from carla_site import attach, connect, fresh, spawn_car, synchronous, ticks_until
from running_site import child
from test_traffic_manager import drive as drive_traffic

#: More than one state is good for.
TICKS = 260
#: Ticks before which the world service is killed; the last one comes after a new state was kept.
KILLED_BEFORE = (5, 6, 40, 230)
SENSOR_SECS = 60.0
SAID = "a world is made again"


def kill(site) -> None:
    os.kill(child(site, "world"), signal.SIGKILL)


def seen(actor: carla.ActorSnapshot) -> tuple:
    """All that a snapshot says of an actor, but for its id."""
    pose, moves = actor.get_transform(), (actor.get_velocity(), actor.get_angular_velocity())
    numbers = (pose.location, pose.rotation, *moves, actor.get_acceleration())
    names = ("x", "y", "z", "pitch", "yaw", "roll")
    return tuple(getattr(it, name) for it in numbers for name in names if hasattr(it, name))


def drive(site, before_tick=lambda tick: None) -> list:
    """Two cars and a sensor; what is seen of them in every tick.

    Without an autopilot: its Traffic Manager would stay in this process, and when worlds of other
    sites are loaded later the client library may free a stream that it is just opening.
    """
    trace = []
    client = fresh(site.carla_port)
    world = client.get_world()
    with synchronous(world):
        car, other = spawn_car(world, 3), spawn_car(world, 5)
        imu, measured = attach(world, car, "sensor.other.imu", noise_gyro_stddev_x="0.1")
        first_id, first_frame = car.id, world.tick()
        measured.get(timeout=SENSOR_SECS)
        for tick in range(TICKS):
            before_tick(tick)
            steer = 0.3 if tick % 40 < 20 else -0.3
            car.apply_control(carla.VehicleControl(throttle=0.6, steer=steer))
            if tick == 30:
                other.apply_control(carla.VehicleControl(throttle=1.0))
            frame = world.tick()
            snapshot = world.get_snapshot()
            assert snapshot.frame == frame
            datum = measured.get(timeout=SENSOR_SECS)
            assert datum.frame == frame
            told = [seen(snapshot.find(actor.id)) for actor in (car, other, imu)]
            gyroscope, felt = datum.gyroscope, datum.accelerometer
            told.append((gyroscope.x, gyroscope.y, gyroscope.z, felt.x, felt.y, felt.z))
            trace.append((frame - first_frame, other.id - first_id, len(world.get_actors()), told))
        physics = car.get_physics_control()
        trace.append((physics.mass, [wheel.tire_friction for wheel in physics.wheels]))
        imu.stop()
    return trace


def test_no_client_sees_that_the_world_service_was_killed(site, start_site):
    disturbed = start_site("--no-render")

    def kill_now_and_then(tick: int) -> None:
        if tick in KILLED_BEFORE:
            kill(disturbed)

    wanted = drive(site)
    assert drive(disturbed, kill_now_and_then) == wanted
    said = disturbed.log.read_text(errors="replace")
    assert said.count(SAID) == len(KILLED_BEFORE)


def test_a_traffic_manager_drives_on_in_a_world_that_is_made_again(site, start_site):
    disturbed = start_site("--no-render")
    # Seconds of driving on any machine, so that there is somebody to kill.
    traffic = {"vehicles": 20, "ticks": 1_500}
    wanted = drive_traffic(site, "Town10HD", **traffic)["trace"]
    over = threading.Event()

    def kill_now_and_then() -> None:
        while not over.wait(2.0):
            kill(disturbed)

    killing = threading.Thread(target=kill_now_and_then)
    killing.start()
    try:
        found = drive_traffic(disturbed, "Town10HD", **traffic)["trace"]
    finally:
        over.set()
        killing.join()
    assert SAID in disturbed.log.read_text(errors="replace")
    assert found == wanted


def test_clients_that_do_not_tick_see_time_go_on(start_site):
    site = start_site("--no-render")
    world = connect(site.carla_port).get_world()
    car = spawn_car(world)
    before = world.wait_for_tick()
    kill(site)
    for _ in range(30):
        after = world.wait_for_tick(SENSOR_SECS)
    assert after.frame >= before.frame + 30
    assert after.timestamp.elapsed_seconds > before.timestamp.elapsed_seconds
    assert after.find(car.id) is not None
    assert re.search(SAID, site.log.read_text(errors="replace"))


def test_maps_that_clients_brought_along_come_back(site, start_site):
    disturbed = start_site("--no-render")
    client = connect(disturbed.carla_port)
    text = connect(site.carla_port).get_world().get_map().to_opendrive()
    world = client.generate_opendrive_world(text)
    with synchronous(world):
        car = spawn_car(world)
        world.tick()
        kill(disturbed)
        for _ in range(3):
            world.tick()
        assert world.get_snapshot().find(car.id) is not None
    assert SAID in disturbed.log.read_text(errors="replace")


def test_without_memory_for_it_the_world_is_lost(start_site):
    site = start_site("--no-render", CAUSEWAY_RECOVERY_MIB="0")
    world = connect(site.carla_port).get_world()
    with synchronous(world):
        world.tick()
        kill(site)
        time.sleep(0.1)
        with pytest.raises(RuntimeError, match="world is gone"):
            for _ in range(3):
                world.tick()
        # A client that is dropped right after a load may end its process.
        client = connect(site.carla_port)
        client.reload_world().wait_for_tick()


def test_a_listener_is_told_as_often_as_before(start_site):
    """A lidar goes on where it was, also one that began before any state was kept."""
    site = start_site("--no-render")
    world = connect(site.carla_port).get_world()
    with synchronous(world):
        car = spawn_car(world)
        lidar, scans = attach(world, car, "sensor.lidar.ray_cast", points_per_second="20000")
        ticks_until(world, lambda: not scans.empty())
        with pytest.raises(queue.Empty):
            while True:
                scans.get(timeout=1.0)
        kill(site)
        for _ in range(5):
            frame = world.tick()
            assert scans.get(timeout=SENSOR_SECS).frame == frame
        lidar.stop()
