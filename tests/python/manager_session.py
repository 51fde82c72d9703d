"""What every call to CARLA's Traffic Manager changes, tried one after the other in one process.

Usage: manager_session.py PORT TM_PORT. Prints one line of JSON: by experiment, what it measured.
"""

import json
import os
import subprocess
import sys
import time

import carla

from carla_site import STEP_SECS, synchronous, ticks
from faulty_maps import document, road
from manager_driving import DRIVING
from manager_stage import (
    SETTLE_TICKS,
    TOWN,
    Stage,
    speed_kmh,
    travelled,
)

DRIVING_SECS = 60.0
#: One road that leads nowhere.
DEAD_END = document(road(length=80))
#: A second client, whose car the Traffic Manager of the first one drives.
GUEST = """
import os, sys, carla
client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(60.0)
world, port = client.get_world(), int(sys.argv[2])
place = world.get_map().get_waypoint_xodr(12, -3, 100.0).transform
place.location.z += 0.3
car = world.spawn_actor(world.get_blueprint_library().find("vehicle.lincoln.mkz_2020"), place)
car.set_autopilot(True, port)
client.get_trafficmanager(port).set_desired_speed(car, 18.0)
print(car.id, flush=True)
os._exit(0)
"""


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


def night_lights(stage: Stage) -> dict:
    before = stage.world.get_weather()
    stage.world.set_weather(carla.WeatherParameters.ClearNight)
    told, other = stage.car(100.0), stage.car(300.0)
    stage.manager.update_vehicle_lights(told, True)
    ticks(stage.world, 10)
    states = {"told": int(told.get_light_state()), "other": int(other.get_light_state())}
    stage.world.set_weather(before)
    return states


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


def dormant_vehicles(stage: Stage) -> dict:
    """No vehicle is dormant on a map that is not large, so that none is moved to the hero."""
    stage.manager.set_respawn_dormant_vehicles(True)
    stage.manager.set_boundaries_respawn_dormant_vehicles(20.0, 60.0)
    stage.car(700.0, role_name="hero")
    car = stage.car(100.0)
    way_m = travelled(stage.world, car, 100)
    stage.manager.set_respawn_dormant_vehicles(False)
    return {"way_m": way_m, "dormant": car.is_dormant}


def actions(stage: Stage) -> dict:
    car = stage.car(100.0)
    ticks(stage.world, 20)
    return {
        "next": [type(part).__name__ for part in stage.manager.get_next_action(car)],
        "all": [str(action[0]) for action in stage.manager.get_all_actions(car)],
    }


def ports(stage: Stage) -> dict:
    other = stage.client.get_trafficmanager(stage.port + 1)
    port = other.get_port()
    other.shut_down()
    found = {"own": stage.manager.get_port() - stage.port, "other": port - stage.port}
    again = stage.client.get_trafficmanager(stage.port + 1)
    again.shut_down()
    return found


def shared_port(stage: Stage) -> dict:
    """A second process has this one's Traffic Manager drive its car."""
    arguments = [str(stage.client_port), str(stage.port)]
    run = subprocess.run(
        [sys.executable, "-c", GUEST, *arguments], capture_output=True, text=True, timeout=300
    )
    stage.world.tick()
    car = stage.world.get_actor(int(run.stdout))
    stage.cars.append(car)
    ticks(stage.world, SETTLE_TICKS)
    return {"kmh": speed_kmh(car)}


def left_asynchronous(stage: Stage) -> dict:
    """Who never thinks of the Traffic Manager's mode has a car driven all the same."""
    port = stage.port + 3
    manager = stage.client.get_trafficmanager(port)
    car = stage.car(100.0, driven=False)
    stage.world.tick()
    car.set_autopilot(True, port)
    start, way_m = car.get_location(), 0.0
    deadline = time.monotonic() + DRIVING_SECS
    while way_m < 30.0 and time.monotonic() < deadline:
        stage.world.tick()
        time.sleep(0.001)
        way_m = car.get_location().distance(start)
    car.set_autopilot(False, port)
    manager.shut_down()
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


OTHERS = (
    lights,
    stop_signs,
    night_lights,
    hybrid,
    dormant_vehicles,
    actions,
    ports,
    shared_port,
    left_asynchronous,
)


def main(port: str, tm_port: str) -> None:
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(60.0)
    found = {}
    with synchronous(client.load_world(TOWN), STEP_SECS) as world:
        stage = Stage(client, world, int(tm_port), int(port))
        for experiment in (*DRIVING, *OTHERS):
            found[experiment.__name__] = experiment(stage)
            stage.clear()
        stage.manager.shut_down()
    with synchronous(client.generate_opendrive_world(DEAD_END), STEP_SECS) as world:
        found["dead_ends"] = dead_ends(Stage(client, world, int(tm_port) + 2))
    print(json.dumps(found), flush=True)
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
