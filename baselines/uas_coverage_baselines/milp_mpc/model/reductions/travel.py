"""Which waypoints one UAS cannot visit within a few samples of each other, from travel times.

A visit is a sample inside the waypoint's polyhedron. Between a visit of v and one of w, k samples
later, the UAS moves by some p_w - p_v with p_v, p_w in the two polyhedra, so that in every
direction f

    f · (c_w - c_v) - h_v(f) - h_w(-f) <= f · (p_w - p_v) <= D(k, f),

c the centres, h the polyhedra's supports about them, D the largest displacement of k steps from
any sample (`Reach.displacement`, a superset of what dynamics and limits allow). So k is at least
the smallest number for which this holds in all directions that are looked at: a lower bound of the
true travel time whatever the spacing of the waypoints. Where polyhedra overlap it is 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem
from uas_coverage_env.geometry import cylinder_faces

FloatArray = NDArray[np.float64]


def support_of_waypoints(problem: PlanningProblem) -> tuple[FloatArray, FloatArray]:
    """Directions (F, 3) in which a waypoint's polyhedron is known, and its support (W, F) [m].

    These are its faces; where it is a box, directions between the faces too.
    """
    faces = problem.waypoint_faces
    reach = problem.waypoint_reach_m[:, None]
    if problem.waypoint_sides > 4:
        return faces, np.broadcast_to(reach, (problem.n_waypoints, len(faces)))
    between = cylinder_faces(16)
    between = between[np.abs(between).max(axis=1) < 1.0 - 1e-9]
    directions = np.vstack([faces, between])
    return directions, reach * np.abs(directions).sum(axis=1)


def steps_between(problem: PlanningProblem) -> NDArray[np.int64]:
    """(U, W, W) least number of steps from a visit of one waypoint to one of another."""
    directions, support = support_of_waypoints(problem)
    away = (problem.waypoints_m[None] - problem.waypoints_m[:, None]) @ directions.T
    opposite = np.array([np.argmin(np.abs(directions + f).sum(axis=1)) for f in directions])
    gap = away - support[:, None] - support[None][..., opposite]  # (W, W, F)
    farthest = problem.reach.displacement(directions)
    result = np.zeros((problem.n_uas, *gap.shape[:2]), np.int64)
    for uas, row in enumerate(farthest):
        for column in range(len(directions)):
            steps = np.searchsorted(row[:, column], gap[..., column])
            np.maximum(result[uas], steps, out=result[uas])
    return result


def exclusive(steps: NDArray[np.int64], samples: int) -> NDArray[np.bool_]:
    """(W, W) pairs that cannot both be visited within so many consecutive samples.

    Args:
        steps: (W, W) of one UAS, see `steps_between`.
        samples: length of the window, 1 for the same sample.
    """
    return np.minimum(steps, steps.T) >= samples


def partition(apart: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(G, W) groups of pairwise exclusive waypoints; each waypoint is in one group."""
    groups: list[NDArray[np.bool_]] = []
    for w in range(len(apart)):
        for group in groups:
            if apart[w][group].all():
                group[w] = True
                break
        else:
            groups.append(np.arange(len(apart)) == w)
    return np.array(groups, bool).reshape(len(groups), len(apart))


def cliques(apart: NDArray[np.bool_], steps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(Q, W) sets of pairwise exclusive waypoints, one grown from each, near ones first."""
    found = []
    neighbourhood = np.minimum(steps, steps.T)
    for w in range(len(apart)):
        clique, candidates = np.arange(len(apart)) == w, apart[w].copy()
        while candidates.any():
            nearest = int(np.argmin(np.where(candidates, neighbourhood[w], np.iinfo(np.int64).max)))
            clique[nearest] = True
            candidates &= apart[nearest]
            candidates[nearest] = False
        found.append(clique)
    return np.unique(np.array(found, bool).reshape(len(found), len(apart)), axis=0)
