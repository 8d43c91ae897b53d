"""Time still to go along a UAS's own order: what `order=search` adds to the objective."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Trajectories, Variables
from uas_coverage_env.geometry import cylinder_faces
from uas_coverage_env.vehicle import VehicleParams

FloatArray = NDArray[np.float64]


class TimeToGo:
    """A terminal cost in seconds: from p(N) to the next waypoint of the order, and on from there.

    With the tour's waypoints k = 1..K, Phi_k = Phi_k(N), Phi_0 = 0, Phi_{K+1} = 1, and aims
    a_1..a_{K+1} (the waypoints and what follows them),

        cost = sum_k onward_k Phi_k + D,
        D >= f · (p(N) + lead v(N)) - sum_k (Phi_k - Phi_{k-1}) f · a_k      for every face f,
        Phi_k <= Phi_{k+1},

    where the faces f turn a way into its flight time: the horizontal distance (H_P-sided, eq.
    (const_Vec_ub)) by the horizontal speed limit, the heights by climb and descent limit. Visits
    count in order, so that exactly one Phi_k - Phi_{k-1} is 1, the one of the next aim, and no big
    M is needed to leave out the others.
    """

    def add_to(self, milp: Milp, v: Variables, problem: PlanningProblem) -> None:
        """Add the remaining time of every UAS that has a tour, and the order of its visits."""
        for uas, tour in enumerate(problem.tours):
            if tour is None:
                continue
            name = f"time_to_go.{problem.names[uas]}"
            rates, slack = flight_time_faces(
                problem.vehicles[uas], problem.physical_sides, problem.planar
            )
            there = tour.aims_m @ rates.T + tour.radius_m[:, None] * slack  # (K+1, F)
            distance = milp.variables(f"{name}.distance", (1,), lower=0.0)
            open_at_end = v.uncovered[-1, tour.waypoints]
            milp.subject_to(
                f"{name}.ahead",
                (rates, v.position[uas, -1][None, :]),
                (tour.lead_s * rates, v.velocity[uas, -1][None, :]),
                (-1.0, distance[None, :]),
                (np.diff(there, axis=0).T, open_at_end[None, :]),
                upper=there[-1],
            )
            milp.minimize(1.0, distance)
            milp.minimize(tour.onward_s, open_at_end)
            visits = v.covers[uas][:, tour.waypoints]  # (N, K)
            N, K = visits.shape
            if K > 1:
                # visited until n, the later waypoint at most as often as the earlier one
                until = np.tri(N)[:, None, :]
                milp.subject_to(
                    f"{name}.in_order",
                    (until, visits.T[None, 1:]),
                    (-until, visits.T[None, :-1]),
                    upper=0.0,
                    where=(visits[:, 1:] != ABSENT),
                )

    def cost_along(self, problem: PlanningProblem, uas: int, flights: Trajectories) -> FloatArray:
        """(S,) the remaining time; the last velocity is that of the last step."""
        tour = problem.tours[uas] if problem.tours else None
        if tour is None:
            return np.zeros(len(flights.positions_m))
        positions_m = flights.positions_m
        rates, slack = flight_time_faces(
            problem.vehicles[uas], problem.physical_sides, problem.planar
        )
        offset = tour.aims_m @ rates.T + tour.radius_m[:, None] * slack
        visited = flights.visits[:, tour.waypoints] < problem.horizon
        prefix = np.cumprod(visited, axis=1).astype(bool)
        first_left = prefix.sum(axis=1)
        velocity = (positions_m[:, -1] - positions_m[:, -2]) / problem.dt_s
        ahead = positions_m[:, -1] + tour.lead_s * velocity
        distance = np.maximum((ahead @ rates.T - offset[first_left]).max(axis=1), 0.0)
        return (~prefix) @ tour.onward_s + distance


def flight_time_faces(
    vehicle: VehicleParams, sides: int, planar: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Rows whose largest value along a way is the time it takes.

    Args:
        vehicle: whose speed limits.
        sides: H_P.
        planar: without heights.

    Returns:
        rates: (sides + 2, 3) [s/m] horizontal faces, up, down; these two not in the plane.
        slack: (sides + 2,) [s/m] what a metre of radius around the aim is worth on each.
    """
    limits = vehicle.limits
    level = cylinder_faces(sides) / limits.v_xy_max_mps
    up = np.array([[0.0, 0.0, 1.0 / limits.v_up_max_mps]])  # below the aim: z is larger
    down = np.array([[0.0, 0.0, -1.0 / limits.v_down_max_mps]])
    rates = level if planar else np.vstack([level, up, down])
    return rates, np.linalg.norm(rates, axis=1)
