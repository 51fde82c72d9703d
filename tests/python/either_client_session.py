"""What a program of CARLA sees, run in a process of its own with the client of either version.

Usage: either_client_session.py PORT MANAGER_PORT. Prints one line of JSON: `seen` is the same for
both, `own` is the client's.
"""

import hashlib
import json
import queue
import sys
import time

import carla

STEP_SECS = 0.05
SIZE = {"image_size_x": "160", "image_size_y": "90"}
SENSORS = {
    "sensor.camera.rgb": SIZE,
    "sensor.camera.depth": SIZE,
    "sensor.camera.semantic_segmentation": SIZE,
    "sensor.camera.instance_segmentation": SIZE,
    "sensor.camera.normals": SIZE,
    "sensor.camera.optical_flow": SIZE,
    "sensor.lidar.ray_cast": {},
    "sensor.lidar.ray_cast_semantic": {},
    "sensor.other.radar": {},
    "sensor.other.imu": {},
    "sensor.other.gnss": {},
    "sensor.other.collision": {},
    "sensor.other.obstacle": {"only_dynamics": "true"},
}


def numbers(value):
    """A vector, rotation or transform as numbers."""
    if isinstance(value, carla.Transform):
        return [*numbers(value.location), *numbers(value.rotation)]
    if isinstance(value, carla.Rotation):
        return [value.pitch, value.yaw, value.roll]
    return [value.x, value.y, value.z]


def box(value):
    return [*numbers(value.location), *numbers(value.extent), *numbers(value.rotation)]


def measured(data):
    """What a measurement says, pictures and points by their digest."""
    told = {"frame": data.frame, "at": numbers(data.transform), "time": data.timestamp}
    if isinstance(data, carla.CollisionEvent):
        who = [data.actor.type_id, data.other_actor.type_id, numbers(data.normal_impulse)]
        return {**told, "collision": who}
    if isinstance(data, carla.ObstacleDetectionEvent):
        return {**told, "obstacle": [data.other_actor.type_id, data.distance]}
    if isinstance(data, carla.IMUMeasurement):
        felt = [*numbers(data.accelerometer), *numbers(data.gyroscope), data.compass]
        return {**told, "felt": felt}
    if isinstance(data, carla.GnssMeasurement):
        return {**told, "place": [data.latitude, data.longitude, data.altitude]}
    raw = bytes(data.raw_data)
    return {**told, "bytes": len(raw), "digest": hashlib.sha256(raw).hexdigest()}


def connected(port):
    client = carla.Client("127.0.0.1", port)
    client.set_timeout(60.0)
    return client


class Session:
    def __init__(self, port):
        self.client = connected(port)
        self.own = {
            "client": self.client.get_client_version(),
            "server": self.client.get_server_version(),
        }
        self.world = self.client.get_world()
        self.settings = self.world.get_settings()
        self.settings.synchronous_mode = True
        self.settings.fixed_delta_seconds = STEP_SECS
        self.world.apply_settings(self.settings)
        # From its beginning on nothing depends on time.
        self.client.load_world("Town02", False)
        # One of 0.10 keeps the navigation of the map that it found, and ends its process when it is
        # dropped right after a load.
        self.first = self.client
        self.client = connected(port)
        self.world = self.client.get_world()
        # Before the first settings a world counts frames by the clock.
        self.first_frame = self.world.tick()
        self.library = self.world.get_blueprint_library()
        self.places = self.world.get_map().get_spawn_points()

    def ticks(self, count):
        for _ in range(count):
            self.world.tick()

    def counted(self, data):
        """What a measurement says, with frames counted from the first tick."""
        told = measured(data)
        return {**told, "frame": told["frame"] - self.first_frame}

    def refusal(self, call):
        try:
            call()
        except RuntimeError as error:
            return str(error)
        return None

    def content(self):
        """The map, the library, scenery and lights."""
        world = self.world
        weather = world.get_weather()
        weather.cloudiness = 33.0
        world.set_weather(weather)
        world.tick()
        settings = world.get_settings()
        wheels = self.library.find("vehicle.lincoln.mkz").get_attribute("number_of_wheels")
        light = world.get_actors().filter("traffic.traffic_light")[0]
        light.set_state(carla.TrafficLightState.Yellow)
        light.set_green_time(3.0)
        world.tick()
        ray = world.cast_ray(carla.Location(0.0, 0.0, 50.0), carla.Location(1.0, 0.0, -50.0))
        return {
            "map": world.get_map().name,
            "places": [numbers(place) for place in self.places],
            "settings": [settings.synchronous_mode, settings.fixed_delta_seconds],
            "cloudiness": world.get_weather().cloudiness,
            "wheels": wheels.as_int(),
            "snapshot": len(world.get_snapshot()),
            "light": [str(light.state), light.get_green_time(), light.get_pole_index()],
            "group": len(light.get_group_traffic_lights()),
            "light boxes": [box(one) for one in light.get_light_boxes()],
            "boxes": [box(one) for one in world.get_level_bbs(carla.CityObjectLabel.Any)],
            "objects": [[one.id, one.name] for one in world.get_environment_objects()],
            "ray": [[*numbers(one.location), str(one.label)] for one in ray],
            "layers": str(world.get_spectator().type_id),
            "maps": list(self.client.get_available_maps()),
        }

    def drive(self):
        """A car that is driven, what it is, and what its sensors say until it runs into another."""
        world = self.world
        blueprint = self.library.find("vehicle.lincoln.mkz")
        blueprint.set_attribute("role_name", "hero")
        blueprint.set_attribute("color", "10,20,30")
        car = world.spawn_actor(blueprint, self.places[0])
        world.tick()
        second = world.try_spawn_actor(blueprint, self.places[0])
        refused = self.refusal(lambda: world.spawn_actor(blueprint, self.places[0]))
        self.own["refusal"] = refused
        physics = car.get_physics_control()
        physics.mass = 1500.0
        car.apply_physics_control(physics)
        lights = carla.VehicleLightState.LowBeam | carla.VehicleLightState.Fog
        car.set_light_state(carla.VehicleLightState(lights))
        forward = car.get_transform().get_forward_vector()
        ahead = car.get_transform()
        ahead.location += forward * 12.0 + carla.Location(z=0.3)
        other = world.spawn_actor(self.library.find("vehicle.tesla.model3"), ahead)
        world.debug.draw_box(
            carla.BoundingBox(ahead.location, carla.Vector3D(1.0, 2.0, 3.0)),
            ahead.rotation,
            thickness=0.2,
            life_time=10.0,
        )
        heard = {kind: queue.Queue() for kind in SENSORS}
        sensors = []
        for kind, attributes in SENSORS.items():
            wanted = self.library.find(kind)
            for name, value in attributes.items():
                wanted.set_attribute(name, value)
            height_m = 0.7 if kind == "sensor.other.obstacle" else 2.4
            at = carla.Transform(carla.Location(x=2.0, z=height_m))
            sensor = world.spawn_actor(wanted, at, car, carla.AttachmentType.Rigid)
            sensor.listen(heard[kind].put)
            sensors.append(sensor)
        car.apply_control(carla.VehicleControl(throttle=0.6, steer=0.01))
        self.ticks(3)
        # Pictures of every tick, or the world waits for them.
        first = {kind: self.counted(heard[kind].get(timeout=30.0)) for kind in list(SENSORS)[:-2]}
        states = []
        for _ in range(100):
            world.tick()
            control = car.get_control()
            motion = [car.get_velocity(), car.get_angular_velocity(), car.get_acceleration()]
            states.append(
                [
                    *numbers(car.get_transform()),
                    *(number for vector in motion for number in numbers(vector)),
                    *(control.throttle, control.steer, control.brake, control.gear),
                ]
            )
        met = {kind: self.counted(heard[kind].get(timeout=30.0)) for kind in list(SENSORS)[-2:]}
        # A client ends when it stops while a message is on its way.
        for kind in list(SENSORS)[:-2]:
            while heard[kind].get(timeout=30.0).frame < world.get_snapshot().frame:
                pass
        time.sleep(0.5)
        for sensor in sensors:
            sensor.stop()
        world.tick()
        gone = [sensor.destroy() for sensor in sensors]
        self.car, self.other = car, other
        self.own["mass"] = car.get_physics_control().mass
        return {
            "attributes": car.attributes,
            "box": box(car.bounding_box),
            "tags": list(car.semantic_tags),
            "second": second,
            "wheels": len(physics.wheels),
            "torque": [[point.x, point.y] for point in physics.torque_curve],
            "lights": int(car.get_light_state()),
            "limit": car.get_speed_limit(),
            "traffic light": str(car.get_traffic_light_state()),
            "first": first,
            "met": met,
            "states": states,
            "gone": gone,
        }

    def batch(self):
        """Many commands at once, among them what is attached and what follows a spawn."""
        command = carla.command
        blueprint = self.library.find("vehicle.audi.tt")
        control = carla.VehicleControl(hand_brake=True)
        physics = self.other.get_physics_control()
        physics.mass = 1600.0
        told = self.client.apply_batch_sync(
            [
                command.SpawnActor(blueprint, self.places[5]).then(
                    command.ApplyVehicleControl(command.FutureActor, control)
                ),
                command.SpawnActor(blueprint, self.places[5]),
                command.SpawnActor(
                    self.library.find("sensor.other.gnss"), carla.Transform(), self.car.id
                ),
                command.ApplyVehiclePhysicsControl(self.other.id, physics),
                command.ApplyTransform(self.other.id, self.places[7]),
                command.SetSimulatePhysics(self.other.id, True),
                command.DestroyActor(999_999),
            ],
            True,
        )
        self.world.tick()
        self.own["second mass"] = self.other.get_physics_control().mass
        made = self.world.get_actor(told[0].actor_id)
        return {
            "told": [[one.actor_id, one.error] for one in told],
            "held": made.get_control().hand_brake,
            "carrier": self.world.get_actor(told[2].actor_id).parent.id,
            "moved": numbers(self.other.get_transform()),
            "destroyed": made.destroy(),
        }

    def others(self, manager_port):
        """The Traffic Manager and walkers, who are the client's own."""
        world = self.world
        manager = self.client.get_trafficmanager(manager_port)
        manager.set_synchronous_mode(True)
        manager.set_random_device_seed(3)
        blueprint = self.library.find("vehicle.audi.tt")
        command = carla.command
        spawn = [
            command.SpawnActor(blueprint, place).then(
                command.SetAutopilot(command.FutureActor, True, manager_port)
            )
            for place in self.places[20:24]
        ]
        told = self.client.apply_batch_sync(spawn, True)
        cars = [world.get_actor(one.actor_id) for one in told]
        world.set_pedestrians_seed(1)
        models, walkers = self.library.filter("walker.pedestrian.*"), []
        while len(walkers) < 3:
            place = world.get_random_location_from_navigation() + carla.Location(z=1.0)
            walker = world.try_spawn_actor(models[len(walkers)], carla.Transform(place))
            walkers += [walker] if walker else []
        world.tick()
        kind = self.library.find("controller.ai.walker")
        controllers = [world.spawn_actor(kind, carla.Transform(), one) for one in walkers]
        world.tick()
        for controller in controllers:
            controller.start()
            controller.go_to_location(world.get_random_location_from_navigation())
            controller.set_max_speed(1.4)
        begins = [actor.get_location() for actor in cars + walkers]
        self.ticks(200)
        ways = [
            actor.get_location().distance(begin)
            for actor, begin in zip(cars + walkers, begins, strict=True)
        ]
        self.own["driven"], self.own["walked"] = ways[: len(cars)], ways[len(cars) :]
        self.own["bones"] = len(walkers[0].get_bones().bone_transforms)
        for controller in controllers:
            controller.stop()
        for car in cars:
            car.set_autopilot(False, manager_port)
        world.tick()
        # Its thread and the one that loads a map would begin an episode of the client both.
        manager.shut_down()

    def recorded(self):
        self.client.start_recorder("either.log", True)
        self.ticks(5)
        self.client.stop_recorder()
        info = self.client.show_recorder_file_info("either.log", False).splitlines()
        told = self.client.replay_file("either.log", 0.0, 0.0, 0, False)
        self.ticks(2)
        self.client.stop_replayer(False)
        self.ticks(1)
        self.own["recording"], self.own["replay"] = info[:2], told.splitlines()[0]

    def end(self):
        self.settings.synchronous_mode = False
        self.settings.fixed_delta_seconds = None
        self.world.apply_settings(self.settings)
        self.own["loaded"] = self.client.load_world("Town01").get_map().name


def main(port, manager_port):
    session = Session(port)
    seen = {"content": session.content(), "drive": session.drive(), "batch": session.batch()}
    session.others(manager_port)
    session.recorded()
    session.end()
    print(json.dumps({"seen": seen, "own": session.own}), flush=True)
    time.sleep(1.0)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
