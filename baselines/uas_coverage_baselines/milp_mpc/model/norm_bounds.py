"""Bounds of the norms in the OCP: speed, tilt and tilt rate, by polygons (eq. (const_Vec_ub)).

The polygons lie inside the vehicle's limits, c_in = cos(pi / H), so that no plan exceeds them;
around the limits, c_in = 1, where the paper's outer approximation is asked for.

A UAS may begin outside of its polygons: what the inner loop flies (each fallback does) keeps the
norms themselves, and the nonlinear plant does not end a step where the plan does. Then no plan
could satisfy the rows at once. As far as two flights of the inner loop are outside, too, one that
brakes and one that goes on with the velocity there is, the bounds give way; these flights, so
something at least, satisfy them, and they lead back inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.geometry import cylinder_faces
from uas_coverage_env.geometry.round_shapes import inner_factor
from uas_coverage_env.planning.backup.braking import pushed
from uas_coverage_env.vehicle import VehicleParams, compile_vehicle
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]

NORMS = (
    ("speed", S.VX, S.VY, "v_xy_max_mps"),
    ("tilt", S.PHI, S.THETA, "tilt_max_rad"),
    ("rate", S.WX, S.WY, "rate_max_radps"),
)
"""Name, two states, and the limit of their norm."""

_ROUNDING = 1e-9
_TOLERATED = 1.005  # times a limit; the world tolerates 1 %


@dataclass(frozen=True)
class NormBounds:
    """The bounds of one UAS.

    Attributes:
        upper: (3, N, H) of face h of each norm's polygon at n = 1..N, in the order of NORMS.
        beyond: (3,) by what factor the polygons of faces at the limits have to grow to hold
            everything that satisfies the bounds; 1 where nothing gives way.
    """

    upper: FloatArray
    beyond: FloatArray


def norm_bounds(
    vehicle: VehicleParams,
    x0: FloatArray,
    horizon: int,
    dt_s: float,
    sides: int,
    *,
    outer: bool = False,
) -> NormBounds:
    """The bounds over a horizon from a state.

    Args:
        vehicle: parameters.
        x0: (14,) state.
        horizon: N.
        dt_s: sampling time.
        sides: H, a multiple of 4.
        outer: whether the polygons lie around the limits.
    """
    faces, inner = cylinder_faces(sides)[:, :2], 1.0 if outer else inner_factor(sides, 2)
    limits = np.array([getattr(vehicle.limits, name) for *_, name in NORMS])
    pairs = [[first, second] for _, first, second, _ in NORMS]
    upper = np.broadcast_to(inner * limits[:, None, None], (len(NORMS), horizon, sides))
    if (faces @ x0[pairs].T <= inner * limits * (1.0 + _ROUNDING)).all():
        return NormBounds(upper, np.full(len(NORMS), inner / inner_factor(sides, 2)))
    record = compile_vehicle(vehicle, dt_s)[()]
    speed_mps = max(float(np.hypot(x0[S.VX], x0[S.VY])), 1e-9)
    share = min(1.0, inner * limits[0] / speed_mps)
    for north, east, down in ((0.0, 0.0, 0.0), (share * x0[S.VX], share * x0[S.VY], x0[S.VZ])):
        states = pushed(record, x0, north, east, down, horizon, horizon)[0][1:]
        reached = np.array([states[:, pair] @ faces.T for pair in pairs])
        # free of rounding, so that the flight itself satisfies them
        upper = np.maximum(upper, reached * (1.0 + _ROUNDING))
    grown = upper.max(axis=(1, 2)) / limits / inner_factor(sides, 2)
    return NormBounds(upper, np.maximum(grown, 1.0))


def exceeds_limits(vehicle: VehicleParams, bounds: NormBounds, states: FloatArray) -> bool:
    """Whether states lead beyond the limits of the norms, as far as these do not give way.

    Plans satisfy the bounds row by row; this is for flights of the inner loop, which in the middle
    of a planned manoeuvre takes over with a tilt and a rate that it would not have combined.

    Args:
        vehicle: parameters.
        bounds: of the UAS.
        states: (n, 14).
    """
    return any(
        np.hypot(states[:, first], states[:, second]).max(initial=0.0)
        > _TOLERATED * beyond * getattr(vehicle.limits, name)
        for (_, first, second, name), beyond in zip(NORMS, bounds.beyond, strict=True)
    )
