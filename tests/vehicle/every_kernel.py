"""A flight through every kernel; run as a program, it writes the numbers to standard output."""

import json
import sys

import numpy as np

from uas_coverage_env.vehicle import compile_vehicle, load_vehicle, lpv_step, plant_step
from uas_coverage_env.vehicle.inner_loop import (
    acceleration_wrench,
    velocity_climb_wrench,
    velocity_wrench,
)
from uas_coverage_env.vehicle.layout import DOD, LIFT, N_INPUTS, N_STATES
from uas_coverage_env.vehicle.lpv import clip_wrench, fly_kinematics


def numbers() -> list[list[float]]:
    """One row per step: voltage, current, state, inputs, reference."""
    rows = []
    for name, dt_s in (("s500_v2", 1.0), ("hexacopter", 0.5)):
        vehicle = compile_vehicle(load_vehicle(name), dt_s)[()]
        x, u, reference = np.zeros(N_STATES), np.zeros(N_INPUTS), np.zeros(2)
        x[DOD] = 0.2967
        for wrench, command in (
            (velocity_wrench, (9.0, -12.0, 7.0)),
            (velocity_climb_wrench, (-3.0, 5.0, 1.0)),
            (acceleration_wrench, (1.0, 2.0, -0.5)),
        ):
            for step in (lpv_step, plant_step):
                wrench(vehicle, x, reference, *command, u)
                rows.append([*step(vehicle, x, u, x), *x.tolist(), *u.tolist(), *reference])
        u[LIFT] = 1e3
        clip_wrench(vehicle, u)
        fly_kinematics(vehicle, x, u)
        rows.append([0.0, 0.0, *x.tolist(), *u.tolist(), *reference])
    return rows


if __name__ == "__main__":
    json.dump(numbers(), sys.stdout)
