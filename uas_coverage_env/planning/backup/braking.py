"""Braking from any state: how every planner's backup trajectory ends."""

import numpy as np

from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.vehicle import lpv_step
from uas_coverage_env.vehicle.inner_loop import reseed_reference, velocity_climb_wrench


@allocating_kernel
def brake(vehicle, start, steps):
    """States after each step (steps, 14) and inputs (steps, 5) of braking from a state."""
    states, inputs = np.empty((steps, start.shape[0])), np.zeros((steps, 5))
    x, reference = start.copy(), np.empty(2)
    reseed_reference(vehicle, x, reference)
    for step in range(steps):
        velocity_climb_wrench(vehicle, x, reference, 0.0, 0.0, 0.0, inputs[step])
        lpv_step(vehicle, x, inputs[step], x)
        states[step] = x
    return states, inputs
