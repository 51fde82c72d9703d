"""What calls to CARLA's Traffic Manager change about speeds, gaps, lanes and ways."""

import math

from carla_site import ticks
from manager_stage import (
    MIDDLE_LANE,
    MOTORWAY,
    SETTLE_TICKS,
    Stage,
    fork_of,
    gap_m,
    speed_kmh,
)


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


def global_speed_difference(stage: Stage) -> dict:
    car = stage.car(100.0, driven=False)
    car.set_autopilot(True, stage.port)
    stage.manager.global_percentage_speed_difference(60.0)
    ticks(stage.world, 300)
    slow_kmh = speed_kmh(car)
    stage.manager.global_percentage_speed_difference(0.0)
    return {"kmh": slow_kmh, "limit_kmh": car.get_speed_limit()}


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


def offsets(stage: Stage) -> dict:
    manager = stage.manager
    own, follows = stage.car(100.0), stage.car(300.0)
    manager.vehicle_lane_offset(own, 0.8)
    manager.global_lane_offset(-0.6)
    # In a bend CARLA's controllers pass 0.15 m inside of what they are told, and the motorway
    # bends.
    ticks(stage.world, 2 * SETTLE_TICKS)
    found = {"vehicle_m": stage.right_of_middle(own), "global_m": stage.right_of_middle(follows)}
    manager.global_lane_offset(0.0)
    return found


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


DRIVING = (
    speed_differences,
    global_speed_difference,
    distances,
    collisions,
    walkers,
    overtaking,
    lane_changes,
    offsets,
    paths,
    routes,
)
