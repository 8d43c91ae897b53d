"""What moves as far as a planner knows it: where it goes if it goes on as it goes now."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.space import Body
from uas_coverage_env.autopilot.lookahead import SURPRISE_S
from uas_coverage_env.geometry.round_shapes import outside_upright_m
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.backup.course import NO_NEARER_M, apart_m
from uas_coverage_env.vehicle.governor import time_scale
from uas_coverage_env.vehicle.layout import VX, VZ
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]

NEVER = 10**6
"""A step that does not come: as far as is seen a waypoint stays blocked."""

_SEEN_S = 400.0
_PARKED_S = 25.0  # as long as what is parked is expected to stay, in plans; not in what is flown
_STILL_MPS = 1e-9
_WITHIN = 0.8  # share of a waypoint's radius from which it is covered beside what moves


@dataclass(frozen=True)
class MovingObstacles:
    """Moving obstacles predicted from one sample on.

    Attributes:
        position_m: (M, 3) now.
        velocity_mps: (M, 3) now.
        radius_m: (M,).
        half_height_m: (M,).
        safe_m: (M,) distance that the rules ask for, without the UAS's radius.
        dt_s: Length of a step.
        n_obstacles: How many of them, the first ones, are moving obstacles; the others are UAS.
        lasts_s: Until the mission ends, at the latest.
        surprise_s: They may turn: keep-outs are widened by how far they go in this time.
    """

    position_m: FloatArray
    velocity_mps: FloatArray
    radius_m: FloatArray
    half_height_m: FloatArray
    safe_m: FloatArray
    dt_s: float
    n_obstacles: int
    lasts_s: float
    surprise_s: float = SURPRISE_S

    @staticmethod
    def seen(
        brief: MissionBrief, swarm: SwarmState, unresponsive: NDArray[np.bool_]
    ) -> MovingObstacles:
        """What is seen in a state.

        Args:
            brief: The mission.
            swarm: The state.
            unresponsive: (U,) UAS that take no commands: they move as anything does.
        """
        obstacles, x = brief.moving_obstacles, swarm.x[unresponsive]
        radius_m = [
            uas.radius_m for uas, there in zip(brief.uas, unresponsive, strict=True) if there
        ]
        points = np.zeros(len(x))
        return MovingObstacles(
            np.vstack([np.reshape(swarm.moving_position_m, (-1, 3)), x[:, :3]]),
            np.vstack([np.reshape(swarm.moving_velocity_mps, (-1, 3)), x[:, VX : VZ + 1]]),
            np.append(np.array([o.radius_m for o in obstacles], float), points),
            np.append(np.array([0.5 * o.height_m for o in obstacles], float), points),
            np.append(
                np.array([o.safe_distance_m for o in obstacles], float),
                np.array(radius_m, float) + brief.uas_safe_distance_m,
            ),
            brief.dt_s,
            len(obstacles),
            brief.dt_s * brief.max_steps,
            SURPRISE_S * min(1.0, max(time_scale(v, brief.dt_s) for v in set(brief.vehicles))),
        )

    def __len__(self) -> int:
        return len(self.radius_m)

    def has_turned(self, before: MovingObstacles) -> bool:
        """Whether a moving obstacle has another velocity than before."""
        n = self.n_obstacles
        return not np.array_equal(self.velocity_mps[:n], before.velocity_mps[:n])

    def off_m(self, before: MovingObstacles, later_s: float) -> float:
        """How far UAS are from where they would be now by what was seen before.

        Args:
            before: The same ones, then.
            later_s: Since then.
        """
        expected_m = before.position_m + later_s * before.velocity_mps
        away_m = np.linalg.norm(self.position_m - expected_m, axis=1)[self.n_obstacles :]
        return float(away_m.max(initial=0.0))

    def later(self, steps: int) -> MovingObstacles:
        """Where they will be after some steps."""
        return replace(self, position_m=self.position_m + steps * self.dt_s * self.velocity_mps)

    @property
    def surprise_m(self) -> FloatArray:
        """(M,) how far each goes in the time in which it may turn."""
        return self.surprise_s * np.linalg.norm(self.velocity_mps, axis=1)

    def path_m(self, m: int, steps: int) -> FloatArray:
        """(steps+1, 3) predicted centres."""
        clock_s = self.dt_s * np.arange(steps + 1)[:, None]
        return self.position_m[m] + clock_s * self.velocity_mps[m]

    def bodies(self, radius_m: float, margin_m: float) -> list[Body]:
        """What a plan of a UAS keeps clear of: what is parked for a while, what moves for long.

        Args:
            radius_m: Of the UAS.
            margin_m: Kept in addition to the safe distance.
        """
        result = []
        for m in range(len(self)):
            parked = np.abs(self.velocity_mps[m]).max() < _STILL_MPS
            steps = round((_PARKED_S if parked else max(_SEEN_S, self.lasts_s)) / self.dt_s)
            keep_m = radius_m + self.safe_m[m] + margin_m + self.surprise_m[m]
            level_m, height_m = self.radius_m[m] + keep_m, self.half_height_m[m] + keep_m
            result.append(Body(self.path_m(m, steps), float(level_m), float(height_m)))
        return result

    def spare_m(self, path_m: FloatArray, radius_m: float, margin_m: float) -> float:
        """Least distance beyond what is kept from all of them along a path, samples 0 and on.

        What is nearer than that now counts as kept as long as it comes no nearer.

        Args:
            path_m: (N+1, 3) of a UAS, from now on.
            radius_m: Of the UAS.
            margin_m: Kept in addition to the safe distance.
        """
        spare = np.inf
        for m in range(len(self)):
            other_m = self.path_m(m, len(path_m) - 1)
            size = float(self.radius_m[m]), float(self.half_height_m[m])
            now_m = float(outside_upright_m(path_m[0] - other_m[0], *size))
            keep_m = radius_m + self.safe_m[m] + margin_m + self.surprise_m[m]
            clearance_m = float(apart_m(path_m, other_m, *size))
            spare = min(spare, clearance_m - min(float(keep_m), now_m - NO_NEARER_M))
        return spare

    def open_from(
        self, waypoints_m: FloatArray, reach_m: FloatArray, radius_m: float, margin_m: float
    ) -> NDArray[np.int64]:
        """(W,) first step at which a waypoint can be covered beside them; `NEVER` if not seen.

        Args:
            waypoints_m: (W, 3).
            reach_m: (W,) radii of the waypoints.
            radius_m: Largest of the UAS.
            margin_m: Kept in addition to the safe distance.
        """
        steps = round(_SEEN_S / self.dt_s)
        opens = np.zeros(len(waypoints_m), np.int64)
        for m in range(len(self)):
            keep_m = radius_m + self.safe_m[m] + margin_m + self.surprise_m[m]
            away = np.abs(waypoints_m[:, None] - self.path_m(m, steps)[None])
            reach = _WITHIN * reach_m[:, None]
            free = np.hypot(away[..., 0], away[..., 1]) + reach > self.radius_m[m] + keep_m
            free |= away[..., 2] + reach > self.half_height_m[m] + keep_m
            first = np.where(free.any(axis=1), free.argmax(axis=1), NEVER)
            opens = np.maximum(opens, first)
        return opens
