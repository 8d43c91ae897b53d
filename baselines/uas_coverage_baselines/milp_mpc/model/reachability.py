"""Reachable sets: where each UAS can be at each step, as support functions (supersets).

A row of the OCP that every reachable position satisfies is dropped, a binary that no reachable
position allows is fixed, and each big M is the smallest that is still valid.

Along a horizontal direction the chain position, velocity, tilt, rate has only non-negative
coefficients, so the largest velocity follows by taking every term at its largest value. For the
position the one-step map is rewritten exactly as

    p⁺ - p = c₁ v + c₂ v⁺ - c₃ (tilt⁺ - tilt) + ε α

(four coefficients for four terms), whose tilt part telescopes over the steps: summing the largest
velocities loses almost nothing, where summing the largest tilts would lose metres per step.
Vertically p⁺ - p = (v + v⁺) dt / 2 exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.geometry import ConvexPolytope, cylinder_faces
from uas_coverage_env.vehicle import LinearModel, VehicleParams
from uas_coverage_env.vehicle import layout as S

FloatArray = NDArray[np.float64]
_AXES = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
_SLACK_M = 1e-3  # rounding and solver tolerance, so that the sets stay supersets


@dataclass(frozen=True)
class Reach:
    """Support functions of the reachable positions of U UAS over N+1 samples."""

    x0: FloatArray
    chains: tuple[_Chain, ...]
    vertical: FloatArray  # (U, 2, N+1): largest z, largest -z
    fence: ConvexPolytope
    prune: bool
    _known: dict[bytes, FloatArray] = field(default_factory=dict, repr=False, compare=False)

    @classmethod
    def of(
        cls,
        x0: FloatArray,
        vehicles: Sequence[VehicleParams],
        models: Sequence[LinearModel],
        horizon: int,
        fence: ConvexPolytope,
        prune: bool = True,
        sides: int = 8,
        beyond: FloatArray | None = None,
    ) -> Reach:
        """Reachable sets from the states `x0` (U, 14).

        Norms are limited by `sides` faces at the limits times `beyond` (U, 3), for speed, tilt
        and rate; at the limits where None.
        """
        beyond = np.ones((len(x0), 3)) if beyond is None else beyond
        chains = tuple(
            _Chain.of(v, m, horizon, sides, grown)
            for v, m, grown in zip(vehicles, models, beyond, strict=True)
        )
        vertical = np.array(
            [_vertical(x, v, m, horizon) for x, v, m in zip(x0, vehicles, models, strict=True)]
        )
        return cls(np.asarray(x0), chains, vertical, fence, prune)

    def support(self, directions: FloatArray) -> FloatArray:
        """Largest value of direction · position(n) over everything reachable inside the fence.

        Args:
            directions: (F, 3), any length.

        Returns:
            (U, N+1, F) [m]; remembered, since several blocks ask for the same faces.
        """
        key = directions.tobytes()
        if key not in self._known:
            self._known[key] = self._support(directions)
        return self._known[key]

    def displacement(self, directions: FloatArray) -> FloatArray:
        """Largest value of direction · (position(m + n) - position(m)), whatever sample m is.

        Args:
            directions: (F, 3), any length.

        Returns:
            (U, N+1, F) [m] over n = 0..N.
        """
        length = np.hypot(directions[:, 0], directions[:, 1])
        unit = directions[:, :2] / np.maximum(length, 1e-12)[:, None]
        result = np.empty((len(self.x0), self.vertical.shape[2], len(directions)))
        for uas, (x, chain) in enumerate(zip(self.x0, self.chains, strict=True)):
            down, up = chain.vertical_stride_m(x)
            rise = down * np.maximum(directions[:, 2], 0.0)
            rise += up * np.maximum(-directions[:, 2], 0.0)
            steps = np.arange(chain.horizon + 1)[:, None]
            result[uas] = chain.displacement(x, unit) * length + steps * rise
        return result

    def _support(self, directions: FloatArray) -> FloatArray:
        inside = np.max(self.fence.vertices_m @ directions.T, axis=0) + _SLACK_M
        length = np.hypot(directions[:, 0], directions[:, 1])
        unit = directions[:, :2] / np.maximum(length, 1e-12)[:, None]
        result = np.empty((len(self.x0), self.vertical.shape[2], len(directions)))
        for uas, (x, chain) in enumerate(zip(self.x0, self.chains, strict=True)):
            result[uas] = np.minimum(self._box(uas, directions), chain.support(x, unit) * length)
            up, down = self.vertical[uas]
            rise = np.outer(up, np.maximum(directions[:, 2], 0.0))
            rise += np.outer(down, np.maximum(-directions[:, 2], 0.0))
            result[uas] += rise
            if not self.prune:
                result[uas, 1:] = inside
            result[uas, 1:] = np.minimum(result[uas, 1:], inside)
            result[uas, 0] = directions @ x[:3]
        return result

    def _box(self, uas: int, directions: FloatArray) -> FloatArray:
        """The same through the reach along the four axes: tighter inside the fence's corners."""
        return self._along_axes[uas] @ np.maximum(_AXES @ directions[:, :2].T, 0.0)

    @cached_property
    def _along_axes(self) -> FloatArray:
        """(U, N+1, 4) largest position north, south, east, west."""
        axes3 = np.hstack([_AXES, np.zeros((4, 1))])
        inside = np.max(self.fence.vertices_m @ axes3.T, axis=0) + _SLACK_M
        result = np.array(
            [chain.support(x, _AXES) for x, chain in zip(self.x0, self.chains, strict=True)]
        )
        result[:, 1:] = np.minimum(result[:, 1:], inside)
        return result


@dataclass(frozen=True)
class _Chain:
    """The horizontal chain of one vehicle and its bounds."""

    a: FloatArray  # (4, 4) position, velocity, tilt, rate
    b: FloatArray  # (4,)
    horizon: int
    speed_vertices: FloatArray  # (H, 2) of the feasible velocity polygon
    tilt_vertices: FloatArray
    rate_vertices: FloatArray
    alpha_max: FloatArray  # (2,) box of the angular accelerations that move north and east
    dt_s: float
    climb_limits_mps: tuple[float, float]  # down, up

    @classmethod
    def of(
        cls,
        vehicle: VehicleParams,
        model: LinearModel,
        horizon: int,
        sides: int,
        beyond: FloatArray,
    ) -> _Chain:
        index = [S.X, S.VX, S.THETA, S.WY]
        sign = np.array([1.0, 1.0, -1.0, -1.0])  # tilt forward is negative pitch
        a = model.A[np.ix_(index, index)] * np.outer(sign, sign)
        inertia = vehicle.airframe.inertia_kgm2
        b = model.B[index, S.TAU_Y] * sign * -inertia[1]
        limits = vehicle.limits
        alpha = np.full(2, limits.angular_acceleration_xy_max_radps2)
        polygon = _polygon(sides)
        return cls(
            a,
            b,
            horizon,
            beyond[0] * limits.v_xy_max_mps * polygon,
            beyond[1] * limits.tilt_max_rad * polygon,
            beyond[2] * limits.rate_max_radps * polygon,
            alpha,
            float(model.A[S.Z, S.VZ]),
            (limits.v_down_max_mps, limits.v_up_max_mps),
        )

    def displacement(self, x: FloatArray, unit: FloatArray) -> FloatArray:
        """(N+1, F) largest unit · (north, east) of what n steps can move, from any sample."""
        c1, c2, c3, epsilon = self._telescoped()
        fastest = np.maximum(
            np.max(unit @ self.speed_vertices.T, axis=1), unit @ x[S.VX : S.VY + 1]
        )
        tilted = unit @ np.array([-x[S.THETA], x[S.PHI]])
        ahead = np.maximum(np.max(unit @ self.tilt_vertices.T, axis=1), tilted)
        behind = np.maximum(np.max(-unit @ self.tilt_vertices.T, axis=1), -tilted)
        alpha = np.abs(unit) @ self.alpha_max
        steps = np.arange(self.horizon + 1)[:, None]
        swing = np.where(steps > 0, abs(c3) * (ahead + behind), 0.0)
        return steps * ((c1 + c2) * fastest + abs(epsilon) * alpha) + swing + _SLACK_M

    def vertical_stride_m(self, x: FloatArray) -> tuple[float, float]:
        """Largest downward and upward way within one step, from any sample."""
        down = self.dt_s * max(self.climb_limits_mps[0], float(x[S.VZ]))
        up = self.dt_s * max(self.climb_limits_mps[1], -float(x[S.VZ]))
        return down, up

    def _telescoped(self) -> tuple[float, float, float, float]:
        """c1, c2, c3 and epsilon of the one-step map as rewritten above."""
        (_, p_v, p_t, p_w), (_, v_v, v_t, v_w) = self.a[S.POSITION], self.a[S.SPEED]
        b_p, b_v, b_t, _ = self.b
        c2 = p_t / v_t
        c3 = (c2 * v_w - p_w) / self.a[S.TILT, S.RATE]
        return p_v - c2 * v_v, c2, c3, b_p - c2 * b_v + c3 * b_t

    def support(self, x: FloatArray, unit: FloatArray) -> FloatArray:
        """(N+1, F) largest unit · (north, east) of the position."""
        position, velocity = unit @ x[0:2], unit @ x[S.VX : S.VY + 1]
        tilt, rate = unit @ np.array([-x[S.THETA], x[S.PHI]]), unit @ np.array([-x[S.WY], x[S.WX]])
        fastest = np.max(unit @ self.speed_vertices.T, axis=1)
        steepest = np.max(unit @ self.tilt_vertices.T, axis=1)
        quickest = np.max(unit @ self.rate_vertices.T, axis=1)
        alpha = np.abs(unit) @ self.alpha_max
        _, v_v, v_t, v_w = self.a[S.SPEED]
        _, b_v, b_t, b_w = self.b
        c1, c2, c3, epsilon = self._telescoped()
        speeds = [velocity]
        v, t, w = velocity, tilt, rate
        for _ in range(self.horizon):
            v = np.minimum(fastest, v_v * v + v_t * t + v_w * w + b_v * alpha)
            t = np.minimum(steepest, t + self.a[S.TILT, S.RATE] * w + b_t * alpha)
            w = np.minimum(quickest, w + b_w * alpha)
            speeds.append(v)
        largest = np.array(speeds)
        travel = np.cumsum(c1 * largest[:-1] + c2 * largest[1:], axis=0)
        steps = np.arange(1, self.horizon + 1)[:, None]
        swing = np.where(c3 >= 0, c3 * (tilt + steepest), -c3 * (steepest - tilt))
        result = np.empty((self.horizon + 1, len(unit)))
        result[0] = position
        result[1:] = position + travel + swing + abs(epsilon) * alpha * steps + _SLACK_M
        return result


def _vertical(
    x: FloatArray, vehicle: VehicleParams, model: LinearModel, horizon: int
) -> FloatArray:
    """(2, N+1): largest z and largest -z."""
    limits = vehicle.limits
    dt = model.A[S.Z, S.VZ]
    per_newton = -model.B[S.VZ, S.LIFT]
    result = np.empty((2, horizon + 1))
    for row, (sign, fastest, push) in enumerate(
        [
            (1.0, limits.v_down_max_mps, -limits.lift_min_N),
            (-1.0, limits.v_up_max_mps, limits.lift_max_N),
        ]
    ):
        position, speed = sign * x[S.Z], sign * x[S.VZ]
        result[row, 0] = position
        for step in range(1, horizon + 1):
            following = min(fastest, speed + per_newton * push)
            position += 0.5 * dt * (speed + following) + _SLACK_M / horizon
            speed = following
            result[row, step] = position
    return result


def _polygon(sides: int) -> FloatArray:
    """Vertices of the polygon whose faces `cylinder_faces(sides)` lie at distance 1."""
    faces = cylinder_faces(sides)[:, :2]
    middle = faces + np.roll(faces, -1, axis=0)
    return middle / np.linalg.norm(middle, axis=1, keepdims=True) / np.cos(np.pi / sides)
