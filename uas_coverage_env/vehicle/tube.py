"""How far a wind that is not the one believed in can move a vehicle: a tube around what it plans.

One horizontal axis of the velocity loop: e = (position, velocity, tilt, rate), e⁺ = C e + B_w d
with |d| at most D in every step, the wind that blows less the one believed in. The largest
deviation over all sequences of d is D times the sum of the absolute responses: the box around the
minimal robust invariant set (Raković et al., IEEE Trans. Autom. Control 50(3), 2005), exact for a
linear loop.
Both axes have the same map, so the worst sequence keeps to one line of the plane. Vertical wind
moves no vehicle: its drag is horizontal.

A loop that goes on learning the wind has the belief b as a fifth state, b⁺ = b + g (d - b): then
even the position stays within a bound, although nothing feeds it back.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.params import VehicleParams

FORGETS_S = 2.0
"""The belief in wind and sink follows what is seen with this time constant [s]."""

_STEPS = 400
_BELIEF = S.RATE + 1  # the fifth state


@dataclass(frozen=True)
class Tube:
    """Largest deviations from what the believed wind leads to, per m/s of residual wind.

    Attributes:
        position: (S+1,) [m per m/s] after each of the first S steps; with a belief that is held it
            grows without end, since nothing holds the position.
        velocity: Of the velocity, however long it blows [m/s per m/s].
        tilt: Of the tilt [rad per m/s].
        rate: Of its rate [rad/s per m/s].
        alpha: Of the angular acceleration that the loop asks for [rad/s² per m/s].
    """

    position: NDArray[np.float64]
    velocity: float
    tilt: float
    rate: float
    alpha: float


def belief_gain(dt_s: float) -> float:
    """The share of what it was off by that the belief takes over in a step."""
    return 1.0 - math.exp(-dt_s / FORGETS_S)


@lru_cache(maxsize=64)
def tube_of(vehicle: VehicleParams, dt_s: float, steps: int, learns: bool = False) -> Tube:
    """The tube of a vehicle's velocity loop.

    Args:
        vehicle: Parameters.
        dt_s: Length of a step [s].
        steps: For how many steps the position is followed.
        learns: Whether the belief goes on learning, as it does in flight; else it is held, as in
            what a flight is predicted with.
    """
    A, B = horizontal_axis(vehicle, dt_s)
    k_velocity, k_tilt, k_rate = design_velocity_loop(vehicle, dt_s).gain
    # what is held against a wind believed in is its trim tilt
    gain = np.array([0.0, k_velocity, k_tilt, k_rate, k_tilt * vehicle.trim_tilt_rad_per_mps])
    learnt = belief_gain(dt_s) if learns else 0.0
    closed = np.zeros((_BELIEF + 1, _BELIEF + 1))
    closed[:_BELIEF, :_BELIEF] = A
    closed[:_BELIEF] -= np.outer(B, gain)
    closed[_BELIEF, _BELIEF] = 1.0 - learnt
    # a step in wind is a step in still air at the airspeed, moved by what the air moves
    response = np.append(-A[:, S.SPEED], learnt)
    response[S.POSITION] += dt_s
    response[S.SPEED] += 1.0
    total, alpha, position_m = np.zeros(len(response)), 0.0, [0.0]
    for _ in range(max(_STEPS, steps)):
        total += np.abs(response)
        alpha += abs(float(gain @ response))
        position_m.append(float(total[0]))
        response = closed @ response
    _, velocity, tilt, rate, _ = total.tolist()
    return Tube(np.array(position_m[: steps + 1]), velocity, tilt, rate, alpha)
