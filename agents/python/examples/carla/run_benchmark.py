"""Runs the driving benchmark of CoRL 2017 and prints how an agent did.

causeway up
python run_benchmark.py --corl-2017 --agent basic

Every episode begins in a new world and is over when the car is within 2 m of its goal, or when its
time is. What came of it is in FOLDER/summary.csv, every frame in FOLDER/measurements.csv and the
table in FOLDER/metrics.json, where FOLDER is _benchmarks_results/LOG_SUITE_TOWN.
"""

from __future__ import annotations

import argparse
import math
import random
from dataclasses import dataclass
from pathlib import Path

import traffic
from agents import AGENTS
from corl2017 import ARRIVED_M, SEED, TASKS, WEATHERS, Drive, Task, drives, size_of
from measurements import Collisions, player
from results import Episode, Results
from roads import Roads
from simulator import carla, cast, connect, finish, options_of, synchronous, tell

STEP_SECS = 0.1


def main() -> None:
    parser = options_of(__doc__ or "")
    parser.add_argument(
        *("-c", "--city-name"), default="Town01", metavar="TOWN", help="(default: %(default)s)"
    )
    parser.add_argument(
        *("-n", "--log_name"), default="test", metavar="LOG", help="(default: %(default)s)"
    )
    parser.add_argument(
        "--corl-2017",
        action="store_true",
        help="25 poses and 6 weathers of each task; else 1 and 1",
    )
    parser.add_argument(
        "--continue-experiment", action="store_true", help="leave out episodes that are done"
    )
    parser.add_argument(
        "--agent", choices=sorted(AGENTS), default="forward", help="(default: %(default)s)"
    )
    parser.add_argument("--poses", type=int, help="of each task, in place of those of the suite")
    parser.add_argument("--weathers", type=int, help="in place of those of the suite")
    parser.add_argument(
        "--tasks", default=",".join(one.name for one in TASKS), help="(default: %(default)s)"
    )
    parser.add_argument(
        "--tm-port", type=int, default=8000, help="of the Traffic Manager (default: %(default)s)"
    )
    finish(run, parser.parse_args())


@dataclass(frozen=True)
class Stage:
    """What the episodes of a run share."""

    client: carla.Client
    town: carla.Map
    manager: carla.TrafficManager | None
    agent: str


def run(options: argparse.Namespace) -> None:
    tasks = chosen(options.tasks)
    poses = options.poses or (25 if options.corl_2017 else 1)
    weathers = list(WEATHERS)[: options.weathers or (6 if options.corl_2017 else 1)]
    suite = "CoRL2017" if options.corl_2017 else "Basic"
    folder = Path("_benchmarks_results") / f"{options.log_name}_{suite}_{options.city_name}"
    results = Results(folder, goes_on=options.continue_experiment)

    client = connect(options)
    town = client.load_world(options.city_name).get_map()
    roads = Roads(town)
    pairs = {task.name: drives(town, roads, task, poses) for task in tasks}
    manager = None
    if any(task.walkers for task in tasks):
        manager = client.get_trafficmanager(options.tm_port)
        manager.set_synchronous_mode(True)
    stage = Stage(client, town, manager, options.agent)
    for task in tasks:
        mean_m = sum(one.route.length_m() for one in pairs[task.name]) / poses
        tell(options, f"{task.name}: {poses} ways of {mean_m:.0f} m in the mean")
        for weather in weathers:
            for drive in pairs[task.name]:
                if not results.has(task.name, weather, drive.start, drive.goal):
                    episode = drive_episode(stage, task, weather, drive)
                    results.add(episode)
                    print(episode.line())
    print(results.table())


def chosen(names: str) -> list[Task]:
    known = {task.name: task for task in TASKS}
    unknown = [name for name in names.split(",") if name not in known]
    if unknown:
        raise ValueError(f"--tasks: there is no {unknown[0]!r}: wanted some of {','.join(known)}")
    return [known[name] for name in names.split(",")]


def drive_episode(stage: Stage, task: Task, weather: int, drive: Drive) -> Episode:
    world = stage.client.reload_world(False)
    world.set_weather(getattr(carla.WeatherParameters, WEATHERS[weather]))
    starts = stage.town.get_spawn_points()
    goal = starts[drive.goal].location
    agent = AGENTS[stage.agent](drive.route)
    with synchronous(world, STEP_SECS), cast(stage.client, stage.manager) as ids:
        blueprint = world.get_blueprint_library().find("vehicle.lincoln.mkz_2020")
        vehicle = world.spawn_actor(blueprint, starts[drive.start])
        ids.append(vehicle.id)
        others = add_others(stage, task, drive, ids)
        collisions = Collisions()
        bumper = world.spawn_actor(
            world.get_blueprint_library().find("sensor.other.collision"),
            carla.Transform(),
            attach_to=vehicle,
        )
        ids.append(bumper.id)
        bumper.listen(collisions.add)
        world.tick()
        episode = Episode(
            task.name,
            weather,
            drive.start,
            drive.goal,
            distance_m(vehicle, goal),
            drive.limit_secs(),
        )
        try:
            while not episode.is_over():
                control = agent.control(vehicle, others)
                vehicle.apply_control(control)
                world.tick()
                now = player(vehicle, stage.town, len(others))
                episode.add(now, collisions, control, STEP_SECS)
                left_m = distance_m(vehicle, goal)
                episode.final_m, episode.arrived = left_m, left_m < ARRIVED_M
        finally:
            bumper.stop()
    return episode


def add_others(stage: Stage, task: Task, drive: Drive, ids: list[int]) -> list[carla.Actor]:
    """The cars and walkers of a task, the same ones whenever the episode is run."""
    if stage.manager is None or not task.walkers:
        return []
    rng = random.Random(f"{SEED} {drive.start} {drive.goal}")
    stage.manager.set_random_device_seed(rng.randrange(2**31))
    starts = stage.town.get_spawn_points()
    free = [place for number, place in enumerate(starts) if number != drive.start]
    places = rng.sample(free, task.cars[size_of(stage.town)])
    cars = traffic.add_cars(stage.client, places, stage.manager, rng)
    walkers, controllers = traffic.add_walkers(stage.client, task.walkers, rng)
    ids.extend([*cars, *walkers, *controllers])
    world = stage.client.get_world()
    world.tick()
    traffic.set_off(world, controllers)
    return list(world.get_actors([*cars, *walkers]))


def distance_m(vehicle: carla.Vehicle, goal: carla.Location) -> float:
    place = vehicle.get_location()
    return math.dist((place.x, place.y), (goal.x, goal.y))


if __name__ == "__main__":
    main()
