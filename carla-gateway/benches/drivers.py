"""Who keeps the lanes of any map: programs for CARLA, and our own drivers?

Usage: drivers.py [--causeway PATH] --maps DIR [--agents DIR] [--tyres T,T] [--drivers D,D] [MAP...]
Lets cars loose on maps (by default all of DIR) under each driver, those of CARLA programs once
with each kind of tyres, and prints a row for every map, driver and tyres: how far the middle of a
car got beyond the edge of all driving lanes at worst, within what 99 % of a program's places were
from the middle of a lane, how many got farther than 0.5 m beyond the edge, how many tipped over,
pairs that collided, and whose that is, or what the program raises. Our own drivers (`traffic`,
`agents`, `routes`, `pilots`, `riders`) are those of `causeway bench roads`, for `--minutes`;
programs drive `--secs`. CARLA's agents (`basic30`, `basic50`, `behaviour`) want `--agents`, the
folder that holds CARLA's package `agents`. Wants `pip install carla==0.9.16 numpy networkx shapely`.
"""

import argparse
import contextlib
import math
import random
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import carla
import networkx

STEP_SECS = 0.05
LOOK_TICKS = 4
LEFT_M = 0.5
KMH = 3.6
#: What the driver of `pursuit` drives at, and how far ahead it looks.
PURSUIT_MPS = 30.0 / KMH
PURSUIT_AHEAD_M = 3.0
PURSUIT_AHEAD_SECS = 0.4
SPEEDS_KMH = {"basic30": 30.0, "basic50": 50.0}
OURS = ("traffic", "agents", "routes", "pilots", "riders")
PROGRAMS = ("manager", "basic30", "basic50", "behaviour", "pursuit")
#: Lanes beside the one that the client finds.
BESIDE_MAX = 8
#: A vehicle tilted by more lies.
LYING_DEG = 60.0
COLUMNS = ("map", "driver", "tyres", "cars", "worst, m", "at", "99 %, m")
COLUMNS += ("left the road", "tipped", "collided", "whose")
ROW = "| {} | {} | {} | {cars} | {worst:.1f} | {at} | {beside} | {left} | {tipped} | {hits} | {} |"


@contextlib.contextmanager
def site(program: str, maps: Path, tyres: str, port: int):
    """A site with an endpoint for CARLA whose cars have these tyres."""
    flags = ["--http", "127.0.0.1:0", "--bus", "tcp/127.0.0.1:0", "--no-render"]
    flags += ["--maps", str(maps), "--carla", str(port), "--cars", tyres]
    process = subprocess.Popen(
        [program, "up", *flags], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    try:
        line = ""
        while "CARLA" not in line:
            line = process.stdout.readline()
            if process.poll() is not None:
                sys.exit("the site did not start")
        # The client library tries only once.
        while not is_open(port):
            time.sleep(0.01)
        yield port
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait()


class Manager:
    """CARLA's Traffic Manager, as it is when nobody tells it anything."""

    def __init__(self, client: carla.Client, cars: list):
        self.manager = client.get_trafficmanager(free_port())
        self.manager.set_synchronous_mode(True)
        self.manager.set_random_device_seed(7)
        self.cars = cars
        for car in cars:
            car.set_autopilot(True, self.manager.get_port())

    def step(self, snapshot: carla.WorldSnapshot) -> None:
        """Drives by itself."""

    def stop(self) -> None:
        for car in self.cars:
            car.set_autopilot(False, self.manager.get_port())

    def end(self) -> None:
        self.manager.shut_down()


class Agents:
    """CARLA's agents, each on its way to one spawn point after the other."""

    def __init__(self, kind: str, cars: list, town: carla.Map):
        from agents.navigation.basic_agent import BasicAgent
        from agents.navigation.behavior_agent import BehaviorAgent
        from agents.navigation.global_route_planner import GlobalRoutePlanner

        self.places = town.get_spawn_points()
        self.random = random.Random(7)
        planner = GlobalRoutePlanner(town, 2.0)
        self.agents = []
        for car in cars:
            if kind == "behaviour":
                agent = BehaviorAgent(car, "normal", map_inst=town, grp_inst=planner)
            else:
                agent = BasicAgent(car, SPEEDS_KMH[kind], map_inst=town, grp_inst=planner)
                # Nor does it see who is exactly ahead: here it is to drive.
                agent.ignore_vehicles(True)
            agent.ignore_traffic_lights(True)
            self.agents.append((car, agent))
            self.send(agent)

    def send(self, agent) -> None:
        for _ in range(20):
            try:
                agent.set_destination(self.random.choice(self.places).location)
                return
            except networkx.NetworkXNoPath:
                continue
        raise LookupError("no way leads from a car to any of 20 places")

    def step(self, snapshot: carla.WorldSnapshot) -> None:
        for car, agent in self.agents:
            if agent.done():
                self.send(agent)
            # Some tell what they do.
            with contextlib.redirect_stdout(sys.stderr):
                control = agent.run_step()
            car.apply_control(control)

    def stop(self) -> None:
        """Nothing goes on by itself."""

    end = stop


class Pursuit:
    """What people write themselves: pure pursuit over the wheel's lock, and a PI for the speed."""

    def __init__(self, cars: list, town: carla.Map):
        self.town = town
        self.random = random.Random(7)
        self.cars = []
        for car in cars:
            wheels = car.get_physics_control().wheels
            xs = [wheel.position for wheel in wheels]
            base_m = math.dist((xs[0].x, xs[0].y), (xs[2].x, xs[2].y)) / 100.0
            way = [town.get_waypoint(car.get_location())]
            self.cars.append([car, base_m, math.radians(wheels[0].max_steer_angle), way, 0.0])

    def step(self, snapshot: carla.WorldSnapshot) -> None:
        for entry in self.cars:
            car, base_m, lock_rad, way, integral = entry
            state = snapshot.find(car.id)
            place = state.get_transform()
            speed_mps = state.get_velocity().length()
            ahead_m = PURSUIT_AHEAD_M + PURSUIT_AHEAD_SECS * speed_mps
            while place.location.distance(way[-1].transform.location) < ahead_m:
                ways = way[-1].next(1.0)
                if not ways:
                    break
                way.append(self.random.choice(ways))
            target = way[-1].transform.location
            dx, dy = target.x - place.location.x, target.y - place.location.y
            angle = math.atan2(dy, dx) - math.radians(place.rotation.yaw)
            distance_m = max(math.hypot(dx, dy), 1.0)
            wheel_rad = math.atan(2.0 * base_m * math.sin(angle) / distance_m)
            error = PURSUIT_MPS - speed_mps
            entry[4] = integral = max(-5.0, min(5.0, integral + error * STEP_SECS))
            pedal = 0.3 * error + 0.1 * integral
            control = carla.VehicleControl(steer=max(-1.0, min(1.0, wheel_rad / lock_rad)))
            control.throttle = max(0.0, min(0.75, pedal))
            control.brake = max(0.0, min(0.3, -pedal))
            car.apply_control(control)

    def stop(self) -> None:
        """Nothing goes on by itself."""

    end = stop


def driver(kind: str, client: carla.Client, cars: list, town: carla.Map):
    if kind == "manager":
        return Manager(client, cars)
    if kind == "pursuit":
        return Pursuit(cars, town)
    return Agents(kind, cars, town)


def is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def beyond(town: carla.Map, location: carla.Location) -> tuple[float, float]:
    """Metres beyond the edge of the nearest lane, and from its middle."""
    # The client takes lanes for chords: the place that it names may be metres off along the lane,
    # and on the lane beside the nearest one.
    lane = town.get_waypoint(location)
    lanes = [lane]
    for beside in (carla.Waypoint.get_left_lane, carla.Waypoint.get_right_lane):
        at = beside(lane)
        while at and at.road_id == lane.road_id and len(lanes) < BESIDE_MAX:
            if any(known.lane_id == at.lane_id for known in lanes):
                break
            lanes.append(at)
            at = beside(at)
    driving = [at for at in lanes if at.lane_type == carla.LaneType.Driving]
    return min(slid(at, location) for at in driving or [lane])


def slid(lane: carla.Waypoint, location: carla.Location) -> tuple[float, float]:
    """Metres beyond the edge of a lane, and from its middle, where that is nearest."""
    away_m, beside_m = away(lane, location)
    step_m = 4.0
    while away_m > 0.01 and step_m > 0.01:
        around = [*lane.next(step_m), *lane.previous(step_m)]
        found = min(
            ((away(place, location), place) for place in around),
            key=first,
            default=None,
        )
        if found and found[0][0] < away_m:
            (away_m, beside_m), lane = found
        else:
            step_m /= 2.0
    return away_m, beside_m


def first(found: tuple) -> float:
    return found[0][0]


def away(lane: carla.Waypoint, location: carla.Location) -> tuple[float, float]:
    """Metres beyond the edge of a lane or along from its place, and from its middle."""
    middle = lane.transform
    dx, dy = location.x - middle.location.x, location.y - middle.location.y
    yaw = math.radians(middle.rotation.yaw)
    along_m = dx * math.cos(yaw) + dy * math.sin(yaw)
    beside_m = abs(dy * math.cos(yaw) - dx * math.sin(yaw))
    return math.hypot(max(0.0, beside_m - lane.lane_width / 2.0), along_m), beside_m


def drive(
    client: carla.Client, world: carla.World, kind: str, count: int, secs: float
) -> dict:
    """Cars on places of the map's, the same ones for every driver."""
    town, library = world.get_map(), world.get_blueprint_library()
    chosen = random.Random(7)
    cars, hits = [], set()
    models = sorted(library.filter("vehicle.*"), key=lambda model: model.id)
    models = [
        model for model in models if model.get_attribute("base_type").as_str() == "car"
    ]
    places = town.get_spawn_points()
    chosen.shuffle(places)
    for place in places[:count]:
        car = world.try_spawn_actor(chosen.choice(models), place)
        if car:
            cars.append(car)
    begun = len(cars)
    world.tick()
    sensors = []
    for car in cars:
        blueprint = library.find("sensor.other.collision")
        sensor = world.spawn_actor(blueprint, carla.Transform(), attach_to=car)
        sensor.listen(lambda hit: hits.add(frozenset((hit.actor.id, hit.other_actor.id))))
        sensors.append(sensor)
    with clearing(world, [*sensors, *cars]):
        at_wheel = driver(kind, client, cars, town)
    worst_m, worst_at, left, tipped, besides = 0.0, None, set(), set(), []
    for tick in range(int(secs / STEP_SECS)):
        world.tick()
        snapshot = world.get_snapshot()
        cars = [car for car in cars if snapshot.find(car.id)]
        with clearing(world, [*sensors, *cars]):
            at_wheel.step(snapshot)
        if tick % LOOK_TICKS:
            continue
        for car in cars:
            pose = snapshot.find(car.id).get_transform()
            location, rotation = pose.location, pose.rotation
            away_m, beside_m = beyond(town, location)
            besides.append(beside_m)
            if max(abs(rotation.roll), abs(rotation.pitch)) > LYING_DEG:
                tipped.add(car.id)
            if away_m > worst_m:
                worst_m, worst_at = away_m, location
            if away_m > LEFT_M:
                left.add(car.id)
    at_wheel.stop()
    world.tick()
    clear(world, [*sensors, *cars])
    at_wheel.end()
    besides.sort()
    beside_m = besides[int(0.99 * len(besides))] if besides else 0.0
    at = f"{worst_at.x:.0f}, {worst_at.y:.0f}" if worst_at else "–"
    return {
        "cars": begun,
        "worst": worst_m,
        "at": at,
        "left": len(left),
        "beside": f"{beside_m:.2f}",
        "tipped": len(tipped),
        "hits": len(hits),
    }


@contextlib.contextmanager
def clearing(world: carla.World, actors: list):
    """Leaves an empty world where a program raises, which is what its row says."""
    try:
        yield
    except Exception as error:
        clear(world, actors)
        raise RuntimeError(f"raises {type(error).__name__}: {error}") from error


def clear(world: carla.World, actors: list) -> None:
    for actor in actors:
        actor.destroy()
    world.tick()


def drive_ours(args: argparse.Namespace, name: str, kinds: list) -> None:
    """The rows of our own drivers on a map."""
    command = [args.causeway, "bench", "roads", "--maps", str(args.maps), name]
    command += ["--cars", str(args.cars), "--minutes", str(args.minutes)]
    command += ["--drivers", ",".join(kinds)]
    told = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    for line in told.splitlines()[2:]:
        cells = [cell.strip() for cell in line.strip("| ").split(" | ")]
        if len(cells) < 11:
            print(line, flush=True)
            continue
        kind, cars, worst, at, left, tipped, hits = cells[1:8]
        found = {"cars": cars, "worst": float(worst), "at": at, "left": int(left)}
        found |= {"beside": "–", "tipped": int(tipped), "hits": int(hits)}
        print(ROW.format(name, kind, "real", whose(found, "ours"), **found), flush=True)


def whose(found: dict, who: str) -> str:
    """Whose it is that something is left."""
    return who if found["left"] or found["tipped"] or found["hits"] else "–"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--causeway", default="causeway")
    parser.add_argument("--maps", type=Path, required=True)
    parser.add_argument("--agents", type=Path)
    parser.add_argument("--tyres", default="carla,real")
    parser.add_argument("--drivers", default=",".join(OURS + PROGRAMS))
    parser.add_argument("--cars", type=int, default=20)
    parser.add_argument("--secs", type=float, default=60.0)
    parser.add_argument("--minutes", type=int, default=10)
    parser.add_argument("map", nargs="*")
    args = parser.parse_args()
    if args.agents:
        sys.path.insert(0, str(args.agents))
    names = args.map or sorted(path.stem for path in args.maps.glob("*.xodr"))
    kinds = args.drivers.split(",")
    ours = [kind for kind in kinds if kind in OURS]
    programs = [kind for kind in kinds if kind not in OURS]
    print("|", " | ".join(COLUMNS), "|")
    print("|" + "---|" * len(COLUMNS))
    for name in names if ours else ():
        drive_ours(args, name, ours)
    for tyres in args.tyres.split(",") if programs else ():
        with site(args.causeway, args.maps, tyres, free_port()) as port:
            client = carla.Client("127.0.0.1", port)
            client.set_timeout(120.0)
            for name in names:
                world = client.load_world(name)
                settings = world.get_settings()
                settings.synchronous_mode = True
                settings.fixed_delta_seconds = STEP_SECS
                world.apply_settings(settings)
                for kind in programs:
                    try:
                        found = drive(client, world, kind, args.cars, args.secs)
                    except RuntimeError as error:
                        print(f"| {name} | {kind} | {tyres} | {error} |", flush=True)
                        continue
                    whom = whose(found, "the program's")
                    print(ROW.format(name, kind, tyres, whom, **found), flush=True)


if __name__ == "__main__":
    main()
