"""CARLA's agents see a car that stands straight ahead of theirs.

They are not ours to keep: `CAUSEWAY_CARLA_SCRIPTS_DIR` names the folder PythonAPI/examples of CARLA
0.9.16, beside which they lie, e.g. in the archive of a release.
"""

import os
from pathlib import Path

import carla
import pytest

from carla_site import attach, spawn_at, synchronous

#: Between the car and the one that stands in its lane.
APART_M = 70.0
STEP_M = 2.0
#: Beyond, a lane is not straight.
TURN_DEG = 1.0
TICKS = 600
RUNS = 3


@pytest.fixture
def agents(monkeypatch):
    """CARLA's drivers, by name."""
    folder = os.environ.get("CAUSEWAY_CARLA_SCRIPTS_DIR")
    if folder is None:
        pytest.skip("no scripts of CARLA; set CAUSEWAY_CARLA_SCRIPTS_DIR")
    monkeypatch.syspath_prepend(Path(folder).parent / "carla")
    from agents.navigation.basic_agent import BasicAgent
    from agents.navigation.behavior_agent import BehaviorAgent

    return {
        "basic": lambda car: BasicAgent(car, target_speed=40),
        "behavior": lambda car: BehaviorAgent(car, behavior="normal"),
    }


def straight_lanes(world: carla.World) -> list[tuple[carla.Waypoint, carla.Waypoint]]:
    """Spawn points from which a lane leads straight ahead for as long as needed, and its end."""
    found = []
    for spawn_point in world.get_map().get_spawn_points():
        begin = world.get_map().get_waypoint(spawn_point.location)
        steps = begin.next_until_lane_end(STEP_M)[: int(APART_M / STEP_M)]
        turns = [step.transform.rotation.yaw - begin.transform.rotation.yaw for step in steps]
        if len(steps) == APART_M / STEP_M and all(
            abs((turn + 180.0) % 360.0 - 180.0) < TURN_DEG for turn in turns
        ):
            found.append((begin, steps[-1]))
    return found


@pytest.mark.parametrize("driver", ["basic", "behavior"])
def test_carlas_agents_stop_behind_a_car_that_stands_in_their_lane(client, agents, driver):
    with synchronous(client.load_world("Town05")) as world:
        lanes = straight_lanes(world)
        assert len(lanes) >= RUNS
        met = 0
        for begin, end in lanes[:: len(lanes) // RUNS][:RUNS]:
            car, other = spawn_at(world, begin), spawn_at(world, end)
            sensor, collisions = attach(world, car, "sensor.other.collision", carla.Transform())
            world.tick()
            agent = agents[driver](car)
            agent.set_destination(end.next(20.0)[0].transform.location)
            for _ in range(TICKS):
                world.tick()
                car.apply_control(agent.run_step())
            met += not collisions.empty()
            assert car.get_location().distance(other.get_location()) < 20.0
            for actor in (sensor, car, other):
                actor.destroy()
    assert met == 0, f"{driver} met {met} of {RUNS} cars"
