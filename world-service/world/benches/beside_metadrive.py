"""Steps and lidar rays of MetaDrive, to set beside `cargo bench -p world --bench scale` and `rays`.

    python -m venv peer && peer/bin/pip install metadrive-simulator==0.4.3
    peer/bin/python world-service/world/benches/beside_metadrive.py

Nothing is drawn: MetaDrive then needs none of its models and textures, and does not fetch them.
"""

import logging
import time

import numpy as np
from metadrive import MetaDriveEnv
from metadrive.engine import base_engine
from metadrive.policy.idm_policy import IDMPolicy

base_engine.BaseEngine.try_pull_asset = staticmethod(lambda: None)

STEPS = 100
LASERS = 720
VEHICLES = [1, 10, 50, 100, 200]
GAP_M = 12.0


def environment(lasers, distance_m):
    """A straight road of five lanes, without traffic yet."""
    unused = {"num_lasers": 0}
    return MetaDriveEnv(
        {
            "use_render": False,
            "log_level": logging.ERROR,
            "map_config": {
                "type": "block_sequence",
                "config": "S" * 12,
                "lane_num": 5,
                "lane_width": 3.5,
            },
            "num_scenarios": 1,
            "traffic_density": 0.0,
            "traffic_mode": "respawn",
            "horizon": 100_000,
            "out_of_road_done": False,
            "crash_vehicle_done": False,
            "vehicle_config": {
                "lidar": {"num_lasers": lasers, "distance": distance_m, "num_others": 0},
                "side_detector": unused,
                "lane_line_detector": unused,
            },
        }
    )


def fill(env, count):
    """IDM vehicles on all lanes, under way from the start."""
    manager, network = env.engine.traffic_manager, env.current_map.road_network
    manager.respawn_lanes = manager._get_available_respawn_lanes(env.current_map)
    roads = [lanes for ends in network.graph.values() for lanes in ends.values()]
    lanes = [lane for road in roads for lane in road]
    places = [(lane, GAP_M * n) for n in range(1, 40) for lane in lanes if GAP_M * n < lane.length]
    for lane, along_m in places[: count - 1]:
        config = {"spawn_lane_index": lane.index, "spawn_longitude": along_m}
        vehicle = manager.spawn_object(manager.random_vehicle_type(), vehicle_config=config)
        manager.add_policy(vehicle.id, IDMPolicy, vehicle, manager.generate_seed())
        manager._traffic_vehicles.append(vehicle)


def step_secs(count, lasers=0, distance_m=50):
    """Vehicles, and the median time of one step of 0.1 s (five physics steps)."""
    env = environment(lasers, distance_m)
    env.reset()
    fill(env, count)
    times = []
    for _ in range(STEPS):
        begin = time.process_time()
        env.step([0.0, 0.1])
        times.append(time.process_time() - begin)
    there = len(env.engine.traffic_manager.spawned_objects) + 1
    env.close()
    return there, float(np.median(times))


def main():
    print("| vehicles | one step of 0.1 s, ms | steps/s |")
    print("|---|---|---|")
    for wanted in VEHICLES:
        count, secs = step_secs(wanted)
        print(f"| {count} | {1e3 * secs:.2f} | {1 / secs:.0f} |")
    for distance_m in (50, 100):
        count, bare = step_secs(50, 0, distance_m)
        _, seen = step_secs(50, LASERS, distance_m)
        ray = (seen - bare) / LASERS
        print(f"{count} vehicles, {distance_m} m: {1e6 * ray:.2f} µs a ray, {1 / ray:.0f} rays/s")


if __name__ == "__main__":
    main()
