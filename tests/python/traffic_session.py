"""Traffic of CARLA's own Traffic Manager, run in a process of its own.

Usage: traffic_session.py PORT TM_PORT MAP VEHICLES TICKS MODE. Prints what it saw as one line of
JSON. Modes are those of MODES.
"""

import hashlib
import json
import math
import os
import random
import sys
import time

import carla

STEP_SECS = 0.05
SEED = 3
#: Ticks between two looks at where everybody is on the road.
LOOK_TICKS = 5
BUSY_SECS = 0.1
TOLERANCE_KMH = 2.0
RED = carla.TrafficLightState.Red
LANES = carla.LaneType.Driving | carla.LaneType.Bidirectional


#: Everything simulated; only what is near the first car; at the world's own pace; with a Traffic
#: Manager that nobody has told of the synchronous mode.
MODES = ("synchronous", "hybrid", "asynchronous", "forgotten")
#: Around the first car, in hybrid mode.
NEAR_M = 50.0


def synchronous(world: carla.World) -> None:
    settings = world.get_settings()
    settings.synchronous_mode = True
    settings.fixed_delta_seconds = STEP_SECS
    world.apply_settings(settings)


def spawn(client: carla.Client, world: carla.World, count: int, tm_port: int) -> list:
    """Cars of all models at places drawn with the seed, driven by the Traffic Manager."""
    library = world.get_blueprint_library().filter("vehicle.*")
    cars = [one for one in library if one.get_attribute("base_type") == "car"]
    cars.sort(key=lambda one: one.id)
    places = world.get_map().get_spawn_points()
    random.Random(SEED).shuffle(places)
    command = carla.command
    batch = []
    for index, place in enumerate(places[:count]):
        car = cars[index % len(cars)]
        car.set_attribute("role_name", "autopilot" if index else "hero")
        drive = command.SetAutopilot(command.FutureActor, True, tm_port)
        batch.append(command.SpawnActor(car, place).then(drive))
    responses = client.apply_batch_sync(batch)
    return list(world.get_actors([one.actor_id for one in responses if not one.error]))


class Watch:
    """What one vehicle does."""

    def __init__(self, car: carla.Vehicle, world: carla.World):
        self.car = car
        self.way_m = 0.0
        self.off_road_m = 0.0
        self.too_fast_secs = 0.0
        self.reds_run = 0
        self.hits = []
        self._last = car.get_location()
        self._waited_at_red = False
        blueprint = world.get_blueprint_library().find("sensor.other.collision")
        self.sensor = world.spawn_actor(blueprint, carla.Transform(), attach_to=car)
        self.sensor.listen(lambda hit: self.hits.append(hit.other_actor.type_id))

    def see(self, state, town: carla.Map, looks: bool) -> None:
        at = state.get_transform().location
        self.way_m += at.distance(self._last)
        self._last = at
        if not looks:
            return
        speed_kmh = 3.6 * state.get_velocity().length()
        if speed_kmh > self.car.get_speed_limit() + TOLERANCE_KMH:
            self.too_fast_secs += LOOK_TICKS * STEP_SECS
        lane = town.get_waypoint(at, lane_type=LANES)
        beside_m = math.dist((at.x, at.y), (lane.transform.location.x, lane.transform.location.y))
        self.off_road_m = max(self.off_road_m, beside_m - lane.lane_width / 2.0)
        at_red = self.car.is_at_traffic_light() and self.car.get_traffic_light_state() == RED
        # Whoever stood at a red light and is on the junction while it is still red.
        if self._waited_at_red and at_red and lane.is_junction and speed_kmh > 5.0:
            self.reds_run += 1
        self._waited_at_red = at_red and not lane.is_junction

    def told(self) -> dict:
        return {
            "type": self.car.type_id,
            "way_m": self.way_m,
            "off_road_m": self.off_road_m,
            "too_fast_secs": self.too_fast_secs,
            "reds_run": self.reds_run,
            "hits": self.hits,
        }


def start_manager(client: carla.Client, tm_port: int, mode: str) -> None:
    manager = client.get_trafficmanager(tm_port)
    manager.set_random_device_seed(SEED)
    if mode not in ("asynchronous", "forgotten"):
        manager.set_synchronous_mode(True)
    if mode == "hybrid":
        manager.set_hybrid_physics_mode(True)
        manager.set_hybrid_physics_radius(NEAR_M)


def main(port: str, tm_port: str, name: str, vehicles: str, ticks: str, mode: str) -> None:
    assert mode in MODES, MODES
    client = carla.Client("127.0.0.1", int(port))
    client.set_timeout(60.0)
    if mode != "asynchronous":
        # Before the load, so that no tick passes before the first one of ours.
        synchronous(client.get_world())
    world = client.load_world(name, reset_settings=False)
    advance = world.wait_for_tick if mode == "asynchronous" else world.tick
    town = world.get_map()
    start_manager(client, int(tm_port), mode)
    cars = spawn(client, world, int(vehicles), int(tm_port))
    advance()
    watches = [Watch(car, world) for car in cars]
    trace = hashlib.sha256()
    for tick in range(int(ticks)):
        advance()
        if mode == "forgotten":
            # As a client with pictures to look at, beside which the manager takes many steps.
            time.sleep(BUSY_SECS)
        snapshot = world.get_snapshot()
        for watch in watches:
            state = snapshot.find(watch.car.id)
            at = state.get_transform()
            trace.update(f"{at.location} {at.rotation}".encode())
            watch.see(state, town, tick % LOOK_TICKS == 0)
    if mode != "asynchronous":
        settings = world.get_settings()
        settings.synchronous_mode = False
        settings.fixed_delta_seconds = None
        world.apply_settings(settings)
    told = {"cars": [watch.told() for watch in watches], "trace": trace.hexdigest()}
    print(json.dumps(told), flush=True)
    # The client library may end the process when it is taken down in order.
    os._exit(0)


if __name__ == "__main__":
    main(*sys.argv[1:])
