"""A short visit of a client of CARLA: loads a map, drives a little, measures, clears up, goes.

Usage: visiting_client.py PORT MAP
"""

import os
import queue
import sys

import carla

CARS = 5
TICKS = 30
SENSORS = {
    "sensor.camera.rgb": {"image_size_x": "160", "image_size_y": "90"},
    "sensor.lidar.ray_cast": {"points_per_second": "50000"},
    "sensor.other.imu": {},
}


def visit(port: int, map_name: str) -> None:
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    world = client.load_world(map_name)
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, 0.05
    world.apply_settings(settings)
    library = world.get_blueprint_library()
    places = world.get_map().get_spawn_points()
    cars = [world.spawn_actor(library.filter("vehicle.*")[0], one) for one in places[:CARS]]
    measured, sensors = queue.Queue(), []
    for name, attributes in SENSORS.items():
        blueprint = library.find(name)
        for key, value in attributes.items():
            blueprint.set_attribute(key, value)
        above = carla.Transform(carla.Location(z=2.0))
        sensors.append(world.spawn_actor(blueprint, above, attach_to=cars[0]))
        sensors[-1].listen(lambda data: measured.put(data.frame))
    for car in cars:
        car.apply_control(carla.VehicleControl(throttle=0.5))
    for _ in range(TICKS):
        frame = world.tick(60.0)
        # Without a renderer for a moment, a camera has no picture of this frame.
        for _ in SENSORS:
            assert measured.get(timeout=60.0) <= frame
    for sensor in sensors:
        sensor.stop()
        sensor.destroy()
    client.apply_batch_sync([carla.command.DestroyActor(car) for car in cars])
    world.tick(60.0)
    settings.synchronous_mode, settings.fixed_delta_seconds = False, None
    world.apply_settings(settings)


if __name__ == "__main__":
    visit(int(sys.argv[1]), sys.argv[2])
    # The client library sometimes ends the process when it takes itself apart.
    os._exit(0)
