"""Repeats the runs of `causeway bench dynamics` with CommonRoad's vehicle models.

    python -m venv models && models/bin/pip install commonroad-vehicle-models==3.0.2
    models/bin/python world-service/manoeuvres/beside_commonroad.py dynamics/runs.json

Both sides have the parameters of CommonRoad's BMW 320i and get the same angle of the road wheels
and the same speed over time. Printed are yaw rates of ours, of the single-track model and of the
multi-body model.
"""

import json
import math
import sys

import numpy as np
from scipy.integrate import odeint
from vehiclemodels.init_mb import init_mb
from vehiclemodels.init_st import init_st
from vehiclemodels.parameters_vehicle2 import parameters_vehicle2
from vehiclemodels.vehicle_dynamics_mb import vehicle_dynamics_mb
from vehiclemodels.vehicle_dynamics_st import vehicle_dynamics_st

YAW_RATE = 5
MODELS = {
    "single-track": (lambda start, _: init_st(start), vehicle_dynamics_st),
    "multi-body": (init_mb, vehicle_dynamics_mb),
}


def parameters():
    """Those of the BMW 320i, with a steering as quick as ours."""
    p = parameters_vehicle2()
    p.steering.v_min, p.steering.v_max = -2.0, 2.0
    return p


def yaw_rates(model, run, dt_secs, p):
    """The model's yaw rate at the end of every step, in rad/s."""
    init, dynamics = MODELS[model]
    wheel_rad, speed_mps = np.array(run["wheel_rad"]), np.array(run["speed_mps"])
    rate_radps = np.diff(wheel_rad, prepend=wheel_rad[0]) / dt_secs
    change_mps2 = np.diff(speed_mps, prepend=speed_mps[0]) / dt_secs
    x = np.array(init([0.0, 0.0, wheel_rad[0], speed_mps[0], 0.0, 0.0, 0.0], p))
    told = []

    def slope(state, _, rate, change):
        return dynamics(state, [rate, change], p)

    for inputs in zip(rate_radps, change_mps2):
        x = odeint(slope, x, [0.0, dt_secs], args=inputs)[-1]
        told.append(x[YAW_RATE])
    return np.array(told)


def features(yaw_radps, dt_secs):
    """Highest and lowest yaw rate and that of the last half second, in degrees per second."""
    tail = yaw_radps[-round(0.5 / dt_secs) :]
    return [math.degrees(value) for value in (yaw_radps.max(), yaw_radps.min(), tail.mean())]


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        told = json.load(file)
    dt_secs, p = told["dt_secs"], parameters()
    print("| run | model | highest, lowest, last yaw rate, °/s | ours differs by, RMS |")
    print("|---|---|---|---|")
    for run in told["runs"]:
        ours = np.array(run["yaw_radps"])
        high, low, last = features(ours, dt_secs)
        print(f"| {run['name']} | ours | {high:.1f}, {low:.1f}, {last:.1f} | |")
        for model in MODELS:
            theirs = yaw_rates(model, run, dt_secs, p)
            high, low, last = features(theirs, dt_secs)
            apart = np.sqrt(np.mean((ours - theirs) ** 2)) / np.abs(theirs).max()
            shown = f"{high:.1f}, {low:.1f}, {last:.1f}"
            print(f"| | {model} | {shown} | {apart:.1%} of its highest |")


if __name__ == "__main__":
    main()
