"""Steps of worlds with traffic, of ours and of other simulators for learning, in one run.

    python -m venv peers && peers/bin/pip install highway-env metadrive-simulator==0.4.3 ./agents/python
    peers/bin/python rollouts/benches/beside_peers.py --program target/release/causeway

Each steps one world of some vehicles by 0.1 s at a time, with an agent that drives straight on, from
Python, on one processor, in turns: whatever else the machine does meets all of them. Times are of
processors, also of our engine's process. A simulator that is not installed is left out and named.

What is stepped differs: MetaDrive has rigid bodies on a straight road of five lanes, highway-env
points on circles' arcs on a straight road, and ours rigid bodies, or kinematic cars, in streets of
Town05 with junctions at which traffic gives way.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

Step = Callable[[], None]
#: Steps a second by processor time, and what ends the world.
Peer = tuple[Step, Callable[[], float], Callable[[], None]]

ROUNDS, CHUNK, WARM = 5, 20, 40
#: The system's clock of another process has steps of 10 ms.
ROUND_SECS = 0.3


def ours(tier: str) -> Callable[[int, argparse.Namespace], Peer]:
    def make(vehicles: int, options: argparse.Namespace) -> Peer:
        from causeway.rollout import Batch

        batch = Batch(
            "lane-keep",
            town="Town05",
            tier=tier,
            observation="drive",
            cars=vehicles - 1,
            ends=[],
            horizon_secs=3600.0,
            program=options.program,
        )
        action = np.array([[0.0, 0.1]], np.float32)

        def clock() -> float:
            return time.process_time() + batch.engine_secs()

        return (lambda: batch.step(action) and None), clock, batch.close

    return make


def highway(vehicles: int, options: argparse.Namespace) -> Peer:
    del options
    import gymnasium

    importlib.import_module("highway_env")
    config = {
        "vehicles_count": vehicles - 1,
        "lanes_count": 5,
        "simulation_frequency": 20,
        "policy_frequency": 10,
        "duration": 1_000_000,
        "action": {"type": "ContinuousAction"},
        "offscreen_rendering": False,
    }
    env = gymnasium.make("highway-v0", config=config).unwrapped
    env.reset(seed=1)
    action = np.array([0.1, 0.0])

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            env.reset()

    return step, time.process_time, env.close


def metadrive(vehicles: int, options: argparse.Namespace) -> Peer:
    del options
    from metadrive import MetaDriveEnv
    from metadrive.engine import base_engine
    from metadrive.policy.idm_policy import IDMPolicy

    # Nothing is drawn: none of its models and textures is needed.
    base_engine.BaseEngine.try_pull_asset = staticmethod(lambda: None)
    road = {
        "type": "block_sequence",
        "config": "S" * 12,
        "lane_num": 5,
        "lane_width": 3.5,
    }
    env = MetaDriveEnv(
        {
            "use_render": False,
            "log_level": logging.ERROR,
            "map_config": road,
            "num_scenarios": 1,
            "traffic_density": 0.0,
            "traffic_mode": "respawn",
            "horizon": 1_000_000,
            "out_of_road_done": False,
            "crash_vehicle_done": False,
        }
    )
    env.reset()
    manager, network = env.engine.traffic_manager, env.current_map.road_network
    manager.respawn_lanes = manager._get_available_respawn_lanes(env.current_map)
    roads = [lanes for ends in network.graph.values() for lanes in ends.values()]
    lanes = [lane for one in roads for lane in one]
    places = [
        (lane, 12.0 * n)
        for n in range(1, 40)
        for lane in lanes
        if 12.0 * n < lane.length
    ]
    for lane, along_m in places[: vehicles - 1]:
        config = {"spawn_lane_index": lane.index, "spawn_longitude": along_m}
        vehicle = manager.spawn_object(
            manager.random_vehicle_type(), vehicle_config=config
        )
        manager.add_policy(vehicle.id, IDMPolicy, vehicle, manager.generate_seed())
        manager._traffic_vehicles.append(vehicle)
    return (lambda: env.step([0.0, 0.1]) and None), time.process_time, env.close


PEERS: dict[str, Callable[[int, argparse.Namespace], Peer]] = {
    "ours, rigid bodies": ours("physics"),
    "ours, kinematic": ours("kinematic"),
    "MetaDrive": metadrive,
    "highway-env": highway,
}


def rates(vehicles: int, options: argparse.Namespace) -> dict[str, float]:
    """Median steps a second of each that is there."""
    there: dict[str, Peer] = {}
    for name, make in PEERS.items():
        try:
            there[name] = make(vehicles, options)
        except ImportError as error:
            print(f"{name} is left out: {error}", file=sys.stderr)
    found: dict[str, list[float]] = {name: [] for name in there}
    try:
        for number in range(ROUNDS):
            for name, (step, clock, _) in there.items():
                for _ in range(0 if number else WARM):
                    step()
                found[name].append(rate(step, clock))
    finally:
        for _, _, close in there.values():
            close()
    return {name: statistics.median(values) for name, values in found.items()}


def rate(step: Step, clock: Callable[[], float]) -> float:
    begun, count = clock(), 0
    while clock() - begun < ROUND_SECS:
        for _ in range(CHUNK):
            step()
        count += CHUNK
    return count / (clock() - begun)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--vehicles", type=int, nargs="+", default=[1, 10, 50, 100])
    parser.add_argument(
        "--program", default="causeway", help="the engine (%(default)s)"
    )
    options = parser.parse_args()
    print(f"| vehicles | {' | '.join(PEERS)} |\n|---|{'---|' * len(PEERS)}")
    for vehicles in options.vehicles:
        found = rates(vehicles, options)
        cells = [f"{found[name]:,.0f}" if name in found else "-" for name in PEERS]
        print(f"| {vehicles} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
