"""Braking from any state, at once or after a push: how every planner's backup trajectory ends.

Flights of the vehicle's own inner loop in the LPV model, which need no solver.
"""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.vehicle import lpv_step
from uas_coverage_env.vehicle.inner_loop import reseed_reference, velocity_climb_wrench

FloatArray = NDArray[np.float64]


def brake(
    vehicle: NDArray[np.void], start: FloatArray, steps: int
) -> tuple[FloatArray, FloatArray]:
    """States after each step (steps, 14) and inputs (steps, 5) of braking from a state."""
    states, inputs = pushed(vehicle, start, 0.0, 0.0, 0.0, 0, steps)
    return states[1:], inputs


@allocating_kernel
def pushed(vehicle, start, north_mps, east_mps, down_mps, push, steps):
    """States (steps+1, 14) and inputs (steps, 5): a velocity for some steps, then braking."""
    states, inputs = np.empty((steps + 1, start.shape[0])), np.zeros((steps, 5))
    x, reference = start.copy(), np.empty(2)
    reseed_reference(vehicle, x, reference)
    states[0] = x
    for step in range(steps):
        go = 1.0 if step < push else 0.0
        velocity_climb_wrench(
            vehicle, x, reference, go * north_mps, go * east_mps, go * down_mps, inputs[step]
        )
        lpv_step(vehicle, x, inputs[step], x)
        states[step + 1] = x
    return states, inputs
