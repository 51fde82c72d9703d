"""What every call to CARLA's Traffic Manager changes, tried one after the other in one process.

Usage: manager_session.py PORT TM_PORT. Prints one line of JSON: by experiment, what it measured.
"""

import json
import math
import os
import subprocess
import sys
import time

import carla

from faulty_maps import document, road
from carla_site import STEP_SECS, spawn_at, synchronous, ticks

TOWN = "Town04"
#: A motorway of this town: lanes -1 to -3 from left to right, 1.5 km, limit 100 km/h.
MOTORWAY = 15
MIDDLE_LANE = -2
SPEED_KMH = 36.0
SETTLE_TICKS = 160
EXPERIMENTS = {}
#: One road that leads nowhere.
DEAD_END = document(road(length=80))
#: A second client, whose car the Traffic Manager of the first one drives.
GUEST = """
import os, sys, carla
client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(20.0)
world, port = client.get_world(), int(sys.argv[2])
place = world.get_map().get_waypoint_xodr(15, -2, 100.0).transform
place.location.z += 0.3
car = world.spawn_actor(world.get_blueprint_library().find("vehicle.lincoln.mkz_2020"), place)
car.set_autopilot(True, port)
client.get_trafficmanager(port).set_desired_speed(car, 18.0)
print(car.id, flush=True)
os._exit(0)
"""


def experiment(function):
    EXPERIMENTS[function.__name__] = function
    return function


class Stage:
    """A world on the motorway's town and the Traffic Manager that drives in it."""

    def __init__(self, client: carla.Client, world: carla.World, port: int, client_port: int = 0):
        self.client = client
        self.client_port = client_port
        self.world = world
        self.town = world.get_map()
        self.port = port
        self.manager = client.get_trafficmanager(port)
        self.manager.set_synchronous_mode(True)
        self.manager.set_random_device_seed(7)
        self.cars = []

    def car(self, at_m: float, lane: int = MIDDLE_LANE, driven: bool = True, **attributes: str):
        """A car on the motorway; driven ones keep to 36 km/h and to their lane."""
        place = self.town.get_waypoint_xodr(MOTORWAY, lane, at_m)
        return self.car_at(place, driven, **attributes)

    def car_at(self, place: carla.Waypoint, driven: bool = True, **attributes: str):
        car = spawn_at(self.world, place, **attributes)
        self.cars.append(car)
        if driven:
            self.drive(car)
        return car

    def drive(self, car: carla.Vehicle) -> None:
        car.set_autopilot(True, self.port)
        self.manager.auto_lane_change(car, False)
        self.manager.set_desired_speed(car, SPEED_KMH)

    def clear(self) -> None:
        for car in self.cars:
            car.set_autopilot(False, self.port)
        self.world.tick()
        destroy = [carla.command.DestroyActor(car) for car in self.cars]
        self.client.apply_batch_sync(destroy, True)
        self.cars = []

    def lane(self, car: carla.Vehicle) -> int:
        return self.town.get_waypoint(car.get_location()).lane_id

    def lanes(self, car: carla.Vehicle, count: int) -> list[int]:
        """The lanes that a car is on in the next ticks, without repetition."""
        seen = [self.lane(car)]
        for _ in range(count):
            self.world.tick()
            lane = self.lane(car)
            if lane != seen[-1]:
                seen.append(lane)
        return seen

    def right_of_middle(self, car: carla.Vehicle) -> float:
        """How far a car is to the right of the middle of its lane, in metres."""
        lane = self.town.get_waypoint(car.get_location()).transform
        away = car.get_location() - lane.location
        right = lane.get_right_vector()
        return away.x * right.x + away.y * right.y


def speed_kmh(car: carla.Vehicle) -> float:
    return 3.6 * car.get_velocity().length()


def gap_m(behind: carla.Vehicle, ahead: carla.Vehicle) -> float:
    """Between the bumpers."""
    middle_m = behind.get_location().distance(ahead.get_location())
    return middle_m - behind.bounding_box.extent.x - ahead.bounding_box.extent.x


@experiment
def speed_differences(stage: Stage) -> dict:
    """Speeds in km/h, the fastest car first on the road."""
    percentages = {"slower_25": 25.0, "slower_50": 50.0, "slower_80": 80.0}
    cars = {name: stage.car(700.0 - 150.0 * at) for at, name in enumerate(percentages)}
    for name, car in cars.items():
        stage.manager.vehicle_percentage_speed_difference(car, percentages[name])
    cars["desired_15"] = stage.car(100.0)
    stage.manager.set_desired_speed(cars["desired_15"], 15.0)
    ticks(stage.world, 300)
    limit_kmh = cars["slower_50"].get_speed_limit()
    return {"limit": limit_kmh} | {name: speed_kmh(car) for name, car in cars.items()}


@experiment
def global_speed_difference(stage: Stage) -> dict:
    car = stage.car(100.0, driven=False)
    car.set_autopilot(True, stage.port)
    stage.manager.global_percentage_speed_difference(60.0)
    ticks(stage.world, 300)
    slow_kmh = speed_kmh(car)
    stage.manager.global_percentage_speed_difference(0.0)
    return {"kmh": slow_kmh, "limit_kmh": car.get_speed_limit()}


@experiment
def distances(stage: Stage) -> dict:
    """Gaps to a car that stands before one."""
    manager = stage.manager
    gaps = {}
    for name, setting in (
        ("vehicle_2", lambda car: manager.distance_to_leading_vehicle(car, 2.0)),
        ("vehicle_5", lambda car: manager.distance_to_leading_vehicle(car, 5.0)),
        ("global_4", lambda _: manager.set_global_distance_to_leading_vehicle(4.0)),
    ):
        ahead, follower = stage.car(130.0, driven=False), stage.car(100.0)
        manager.set_desired_speed(follower, 18.0)
        setting(follower)
        ticks(stage.world, 240)
        gaps[name] = gap_m(follower, ahead)
        stage.clear()
    manager.set_global_distance_to_leading_vehicle(2.0)
    return gaps


@experiment
def collisions(stage: Stage) -> dict:
    """How far a car pushes one that stands before it, by what it was told."""
    manager = stage.manager
    told = {
        "default": lambda car, ahead: None,
        "collision_detection": lambda car, ahead: manager.collision_detection(car, ahead, False),
        "ignore_vehicles": lambda car, ahead: manager.ignore_vehicles_percentage(car, 100.0),
    }
    pushed_m = {}
    for name, tell in told.items():
        ahead, car = stage.car(140.0, driven=False), stage.car(100.0)
        tell(car, ahead)
        stage.world.tick()
        stood = ahead.get_location()
        ticks(stage.world, 200)
        pushed_m[name] = ahead.get_location().distance(stood)
        stage.clear()
    return pushed_m


@experiment
def walkers(stage: Stage) -> dict:
    """How far behind or before a walker on its lane a car ends, by what it was told."""
    ends = {}
    for name, percentage in (("default", 0.0), ("ignore_walkers", 100.0)):
        car = stage.car(100.0)
        place = stage.town.get_waypoint_xodr(MOTORWAY, MIDDLE_LANE, 140.0).transform
        place.location.z += 1.0
        blueprint = stage.world.get_blueprint_library().filter("walker.pedestrian.*")[0]
        walker = stage.world.spawn_actor(blueprint, place)
        stage.manager.ignore_walkers_percentage(car, percentage)
        ticks(stage.world, 200)
        ends[name] = stage.town.get_waypoint(car.get_location()).s - 140.0
        walker.destroy()
        stage.clear()
    return ends


@experiment
def overtaking(stage: Stage) -> dict:
    """The lanes of a car behind a slower one, by whether it may change."""
    lanes = {}
    for allowed in (False, True):
        slow, car = stage.car(130.0), stage.car(100.0)
        stage.manager.set_desired_speed(slow, 12.0)
        stage.manager.set_desired_speed(car, 54.0)
        stage.manager.auto_lane_change(car, allowed)
        stage.world.tick()
        lanes[str(allowed)] = stage.lanes(car, 140)
        stage.clear()
    return lanes


@experiment
def lane_changes(stage: Stage) -> dict:
    """The lanes of a car that begins in the middle, by what it was told once it drives."""
    manager = stage.manager
    told = {
        "force_right": lambda car: manager.force_lane_change(car, True),
        "force_left": lambda car: manager.force_lane_change(car, False),
        "random_left": lambda car: manager.random_left_lanechange_percentage(car, 100.0),
        "random_right": lambda car: manager.random_right_lanechange_percentage(car, 100.0),
        "keep_slow_lane": lambda car: manager.keep_slow_lane_rule_percentage(car, 100.0),
        "nothing": lambda car: None,
    }
    lanes = {}
    for name, tell in told.items():
        car = stage.car(100.0)
        ticks(stage.world, 80)
        tell(car)
        lanes[name] = stage.lanes(car, 160)
        stage.clear()
    return lanes


@experiment
def offsets(stage: Stage) -> dict:
    manager = stage.manager
    own, follows = stage.car(100.0), stage.car(300.0)
    manager.vehicle_lane_offset(own, 0.8)
    manager.global_lane_offset(-0.6)
    ticks(stage.world, SETTLE_TICKS)
    found = {"vehicle_m": stage.right_of_middle(own), "global_m": stage.right_of_middle(follows)}
    manager.global_lane_offset(0.0)
    return found


@experiment
def lights(stage: Stage) -> dict:
    """How far past a red light cars get, by what they were told."""
    stage.world.freeze_all_traffic_lights(True)
    light = stage.world.get_actors().filter("traffic.traffic_light")[0]
    stop = light.get_stop_waypoints()[0]
    light.set_state(carla.TrafficLightState.Red)
    past_m = {}
    for name, percentage in (("default", 0.0), ("ignore_lights", 100.0)):
        car = stage.car_at(stop.previous(25.0)[0])
        stage.manager.ignore_lights_percentage(car, percentage)
        way_m = travelled(stage.world, car, 240)
        past_m[name] = way_m - 25.0
        stage.clear()
    stage.world.freeze_all_traffic_lights(False)
    return past_m


@experiment
def stop_signs(stage: Stage) -> dict:
    """The lowest speed of cars around a stop sign, by what they were told."""
    landmark = stage.town.get_all_landmarks_of_type(carla.LandmarkType.StopSign)[0]
    first_lane = landmark.get_lane_validities()[0][0]
    line = stage.town.get_waypoint_xodr(landmark.road_id, first_lane, landmark.s)
    lowest = {}
    for name, percentage in (("default", 0.0), ("ignore_signs", 100.0)):
        car = stage.car_at(line.previous(25.0)[0])
        stage.manager.ignore_signs_percentage(car, percentage)
        ticks(stage.world, 60)
        speeds = []
        for _ in range(180):
            stage.world.tick()
            speeds.append(speed_kmh(car))
        lowest[name] = {"lowest_kmh": min(speeds), "last_kmh": speeds[-1]}
        stage.clear()
    return lowest


@experiment
def night_lights(stage: Stage) -> dict:
    before = stage.world.get_weather()
    stage.world.set_weather(carla.WeatherParameters.ClearNight)
    told, other = stage.car(100.0), stage.car(300.0)
    stage.manager.update_vehicle_lights(told, True)
    ticks(stage.world, 10)
    states = {"told": int(told.get_light_state()), "other": int(other.get_light_state())}
    stage.world.set_weather(before)
    return states


@experiment
def hybrid(stage: Stage) -> dict:
    """Whether cars near and far from the hero are driven by their engines, and their ways."""
    manager = stage.manager
    hero = stage.car(500.0, role_name="hero")
    near, far = stage.car(470.0), stage.car(100.0)
    manager.set_hybrid_physics_mode(True)
    manager.set_hybrid_physics_radius(60.0)
    stage.world.tick()
    starts = [car.get_location() for car in (near, far)]
    ticks(stage.world, 100)
    found = {
        name: {
            "throttle": car.get_control().throttle > 0.0,
            "way_m": car.get_location().distance(start),
        }
        for name, car, start in zip(("near", "far"), (near, far), starts, strict=True)
    }
    manager.set_hybrid_physics_mode(False)
    assert hero.is_alive
    return found


@experiment
def dormant_vehicles(stage: Stage) -> dict:
    """No vehicle is dormant on a map that is not large, so that none is moved to the hero."""
    stage.manager.set_respawn_dormant_vehicles(True)
    stage.manager.set_boundaries_respawn_dormant_vehicles(20.0, 60.0)
    stage.car(700.0, role_name="hero")
    car = stage.car(100.0)
    way_m = travelled(stage.world, car, 100)
    stage.manager.set_respawn_dormant_vehicles(False)
    return {"way_m": way_m, "dormant": car.is_dormant}


@experiment
def paths(stage: Stage) -> dict:
    """How far from the points of its path a car passes."""
    begin = stage.town.get_waypoint_xodr(MOTORWAY, MIDDLE_LANE, 100.0)
    beside = begin.get_right_lane().next(70.0)[0]
    points = [begin.next(20.0)[0], beside, beside.next(30.0)[0]]
    car = stage.car(100.0)
    stage.manager.set_path(car, [point.transform.location for point in points])
    nearest = [math.inf] * len(points)
    for _ in range(320):
        stage.world.tick()
        at = car.get_location()
        nearest = [
            min(known, at.distance(point.transform.location))
            for known, point in zip(nearest, points, strict=True)
        ]
    return {"nearest_m": nearest, "lane": stage.lane(car)}


@experiment
def routes(stage: Stage) -> dict:
    """The turn that a car takes at a junction with several ways, by its route."""
    fork = fork_of(stage.town)
    turns = {}
    for turn in ("Left", "Right", "Straight"):
        if turn not in fork["ways"]:
            continue
        car = stage.car_at(fork["before"])
        stage.manager.ignore_lights_percentage(car, 100.0)
        stage.manager.ignore_signs_percentage(car, 100.0)
        stage.manager.set_route(car, [turn])
        stage.world.tick()
        next_action = stage.manager.get_next_action(car)
        heading = fork["before"].transform.rotation.yaw
        was_inside = False
        for _ in range(500):
            stage.world.tick()
            inside = stage.town.get_waypoint(car.get_location()).is_junction
            if was_inside and not inside:
                break
            was_inside = inside
        turned = (car.get_transform().rotation.yaw - heading + 180.0) % 360.0 - 180.0
        turns[turn] = {"deg": turned, "next": str(next_action[0])}
        stage.clear()
    return turns


@experiment
def actions(stage: Stage) -> dict:
    car = stage.car(100.0)
    ticks(stage.world, 20)
    return {
        "next": [type(part).__name__ for part in stage.manager.get_next_action(car)],
        "all": [str(action[0]) for action in stage.manager.get_all_actions(car)],
    }


@experiment
def ports(stage: Stage) -> dict:
    other = stage.client.get_trafficmanager(stage.port + 1)
    port = other.get_port()
    other.shut_down()
    found = {"own": stage.manager.get_port() - stage.port, "other": port - stage.port}
    again = stage.client.get_trafficmanager(stage.port + 1)
    again.shut_down()
    return found


@experiment
def shared_port(stage: Stage) -> dict:
    """A second process has this one's Traffic Manager drive its car."""
    arguments = [str(stage.client_port), str(stage.port)]
    run = subprocess.run(
        [sys.executable, "-c", GUEST, *arguments], capture_output=True, text=True, timeout=60
    )
    stage.world.tick()
    car = stage.world.get_actor(int(run.stdout))
    stage.cars.append(car)
    ticks(stage.world, SETTLE_TICKS)
    return {"kmh": speed_kmh(car)}


@experiment
def left_asynchronous(stage: Stage) -> dict:
    """Who forgets the Traffic Manager's synchronous mode drives all the same."""
    stage.manager.set_synchronous_mode(False)
    car = stage.car(100.0)
    stage.world.tick()
    start = car.get_location()
    for _ in range(200):
        stage.world.tick()
        # The Traffic Manager steps by itself.
        time.sleep(0.001)
    way_m = car.get_location().distance(start)
    stage.manager.set_synchronous_mode(True)
    stage.world.tick()
    return {"way_m": way_m}


def dead_ends(stage: Stage) -> dict:
    """Whether a car is still there at the end of its road, by OpenStreetMap mode."""
    remains = {}
    for mode in (False, True):
        stage.manager.set_osm_mode(mode)
        car = stage.car_at(stage.town.get_waypoint_xodr(1, -1, 20.0))
        ticks(stage.world, 120)
        remains[str(mode)] = car.id in [actor.id for actor in stage.world.get_actors()]
        if not remains[str(mode)]:
            stage.cars.remove(car)
        stage.clear()
    return remains


def fork_of(town: carla.Map) -> dict:
    """A place 30 m before a junction with ways in at least two directions, and these."""
    for place in town.generate_waypoints(20.0):
        ahead = place.next(30.0)
        if place.is_junction or any(step.is_junction for step in place.next(25.0)):
            continue
        if len(ahead) < 2 or not all(step.is_junction for step in ahead):
            continue
        ways = set()
        for step in ahead:
            end = step
            while end.is_junction:
                end = end.next(2.0)[0]
            turn = end.transform.rotation.yaw - place.transform.rotation.yaw
            turn = (turn + 180.0) % 360.0 - 180.0
            ways.add("Straight" if abs(turn) < 45.0 else "Right" if turn > 0.0 else "Left")
        if {"Left", "Right"} <= ways:
            return {"before": place, "ways": ways}
    raise LookupError("no junction to turn at")


def travelled(world: carla.World, car: carla.Vehicle, count: int) -> float:
    way_m, last = 0.0, None
    for _ in range(count):
        world.tick()
        at = car.get_location()
        way_m += at.distance(last) if last else 0.0
        last = at
    return way_m


def main(port: str, tm_port: str) -> None:
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(30.0)
    found = {}
    with synchronous(client.load_world(TOWN), STEP_SECS) as world:
        stage = Stage(client, world, int(tm_port), int(port))
        for name, run in EXPERIMENTS.items():
            found[name] = run(stage)
            stage.clear()
        stage.manager.shut_down()
    with synchronous(client.generate_opendrive_world(DEAD_END), STEP_SECS) as world:
        found["dead_ends"] = dead_ends(Stage(client, world, int(tm_port) + 2))
    print(json.dumps(found), flush=True)
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
