"""Staying outside a convex shape (const_CS_out, const_Vec_lb): shared by three families.

Fixed obstacles, moving obstacles and other UAS differ in what the distance is measured to; the
rows are the same:

    d_h(n) >= delta_h - M_h(n) relaxed_h(n),   sum over h of relaxed_h(n) <= N_f - 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp
from uas_coverage_baselines.milp_mpc.model.problem import PlanningProblem, Variables

FloatArray = NDArray[np.float64]
_ON_FACE_M = 1e-6


@dataclass(frozen=True)
class Separation:
    """G movers (UAS or pairs of UAS) that stay outside one shape of F faces for N+1 samples.

    Attributes:
        name: of the family, and prefix of its columns and rows.
        normals: (F, 3) outward.
        mover: (G,) row of the UAS.
        partner: (G,) row of the UAS whose position is subtracted; None where the shape stands
            in the world.
        offset_m: (G, N+1, F) added to normals · position to give the face distance.
        clearance_m: (G, F) delta.
        lowest_m: (G, N+1, F) smallest reachable face distance.
        highest_m: (G, N+1, F) largest reachable face distance.
        prune: see `PlanningProblem`.
        corners: whether one face has to separate at both ends of each interval.
    """

    name: str
    normals: FloatArray
    mover: NDArray[np.int64]
    partner: NDArray[np.int64] | None
    offset_m: FloatArray
    clearance_m: FloatArray
    lowest_m: FloatArray
    highest_m: FloatArray
    prune: bool = True
    corners: bool = True

    @cached_property
    def always(self) -> NDArray[np.bool_]:
        """(G, N+1, F) faces that separate whatever is flown.

        At n = 0 the position is known: the faces beyond which the UAS is. Where it is too close
        to all of them, those it is farthest from, so that the next step leads away.
        """
        spare = self.lowest_m - self.clearance_m[:, None, :]
        needed = np.zeros(spare.shape)
        needed[:, 0] = np.minimum(0.0, spare[:, 0].max(axis=1, keepdims=True))
        result: NDArray[np.bool_] = np.asarray(spare >= needed)
        result[:, 0] |= spare[:, 0] >= needed[:, 0] - _ON_FACE_M
        if not self.prune:
            result[:, 1:] = False
        return result

    @cached_property
    def never(self) -> NDArray[np.bool_]:
        """(G, N+1, F) faces that cannot separate."""
        result = (self.highest_m < self.clearance_m[:, None, :]) & ~self.always
        result[:, 0] = ~self.always[:, 0]
        if not self.prune:
            result[:, 1:] = False
        return result

    @cached_property
    def undecided(self) -> NDArray[np.bool_]:
        """(G, N) intervals over which no face separates whatever is flown."""
        return np.asarray(~(self.always[:, :-1] & self.always[:, 1:]).any(axis=2))

    @cached_property
    def needed(self) -> NDArray[np.bool_]:
        """(G, N+1) samples at the end of an undecided interval, or undecided themselves."""
        if not self.corners:
            return np.asarray(~self.always.any(axis=2))
        result = np.zeros(self.always.shape[:2], bool)
        result[:, :-1] |= self.undecided
        result[:, 1:] |= self.undecided
        return result

    def add_outside(self, milp: Milp, v: Variables) -> None:
        """Outside the shape at each sample n = 1..N (eq. (const_CS_out))."""
        if not self.needed.any():
            return
        relaxed = milp.variables(
            f"{self.name}.relaxed",
            self.always.shape,
            lower=self.never.astype(float),
            upper=1.0,
            integer=True,
            where=self.needed[:, :, None] & ~self.always,
        )
        clearance = np.broadcast_to(self.clearance_m[:, None, :], self.always.shape)
        big_m = np.maximum(clearance - self.lowest_m, 0.0)
        position = v.position[self.mover][:, :, None, :]
        terms = [(self.normals, position), (big_m[..., None], relaxed[..., None])]
        if self.partner is not None:
            terms.append((-self.normals, v.position[self.partner][:, :, None, :]))
        later = np.arange(self.always.shape[1]) > 0
        milp.subject_to(
            f"{self.name}.outside",
            *terms,
            lower=clearance - self.offset_m,
            where=self.needed[:, :, None] & later[:, None] & ~self.always & ~self.never,
        )
        milp.subject_to(
            f"{self.name}.one_face",
            (1.0, relaxed),
            upper=relaxed.shape[2] - 1,
            where=self.needed & later & ~self.always.any(axis=2),
        )

    def add_same_face(self, milp: Milp) -> None:
        """One face separates at both ends of each interval (corner cutting constraints)."""
        if not self.corners or not self.undecided.any():
            return
        relaxed = milp.columns(f"{self.name}.relaxed")
        crossed = milp.variables(
            f"{self.name}.crossed",
            (*self.undecided.shape, relaxed.shape[2]),
            lower=0.0,
            upper=1.0,
            integer=True,
            where=self.undecided[:, :, None],
        )
        for name, end in (("from", relaxed[:, :-1]), ("to", relaxed[:, 1:])):
            milp.subject_to(
                f"{self.name}.corner_{name}",
                (1.0, end[..., None]),
                (-1.0, crossed[..., None]),
                upper=0.0,
                where=self.undecided[:, :, None] & (end != ABSENT),
            )
        milp.subject_to(
            f"{self.name}.one_face_stays",
            (1.0, crossed),
            upper=relaxed.shape[2] - 1,
            where=self.undecided,
        )
        milp.drop_integrality(relaxed)

    def add_one_face(self, milp: Milp, v: Variables) -> None:
        """Both of the above with `crossed` alone (`reductions.one_face`)."""
        if not self.corners:
            self.add_outside(milp, v)
            return
        if not self.undecided.any():
            return
        F = self.always.shape[2]
        never = self.never[:, :-1] | self.never[:, 1:]
        crossed = milp.variables(
            f"{self.name}.crossed",
            (*self.undecided.shape, F),
            lower=never.astype(float),
            upper=1.0,
            integer=True,
            where=self.undecided[:, :, None],
        )
        clearance = np.broadcast_to(self.clearance_m[:, None, :], self.always.shape)
        big_m = np.maximum(clearance - self.lowest_m, 0.0)
        lower = clearance - self.offset_m
        later = np.arange(self.undecided.shape[1]) > 0  # the first sample is given
        free = self.undecided[:, :, None] & ~never
        for end, steps, asked in (
            ("from", slice(None, -1), free & later[:, None]),
            ("to", slice(1, None), free),
        ):
            terms = [
                (self.normals, v.position[self.mover][:, steps, None, :]),
                (big_m[:, steps, :, None], crossed[..., None]),
            ]
            if self.partner is not None:
                terms.append((-self.normals, v.position[self.partner][:, steps, None, :]))
            milp.subject_to(
                f"{self.name}.outside_{end}",
                *terms,
                lower=lower[:, steps],
                where=asked & ~self.always[:, steps],
            )
        milp.subject_to(
            f"{self.name}.one_face_stays", (1.0, crossed), upper=F - 1, where=self.undecided
        )

    def spare_m(self, positions_m: FloatArray) -> FloatArray:
        """(G, N, F) distance to spare beyond each face at both ends of each interval.

        Args:
            positions_m: (U, N+1, 3) a flight; its first sample is the measured one.
        """
        position = positions_m[self.mover]
        if self.partner is not None:
            position = position - positions_m[self.partner]
        spare = position @ self.normals.T + self.offset_m - self.clearance_m[:, None, :]
        spare[:, 0] = np.where(self.always[:, 0], np.inf, -np.inf)
        return np.minimum(spare[:, :-1], spare[:, 1:])

    def is_kept(self, positions_m: FloatArray, tolerance_m: float = 1e-6) -> bool:
        """Whether some face separates over every interval of a flight (U, N+1, 3)."""
        return bool((self.spare_m(positions_m).max(axis=2) >= -tolerance_m).all())


def from_obstacles(problem: PlanningProblem) -> Iterator[Separation]:
    """Every UAS from each fixed obstacle: D_O(p) >= delta_O,min.

    Obstacles of which one face separates over the whole horizon, whatever is flown, have no rows;
    they are left out here, all at once, so that many far ones cost nothing.
    """
    if not problem.obstacles:
        return
    hulls = [hull for _, hull in problem.obstacles]
    faces = np.array([hull.n_faces for hull in hulls])
    ends = np.cumsum(faces)
    normals = np.concatenate([hull.normals for hull in hulls])
    offsets = np.concatenate([hull.offsets_m for hull in hulls])
    clearance = np.repeat(problem.obstacle_clearance_m, faces, axis=1)
    lowest = offsets - problem.reach.support(-normals)
    highest = offsets + problem.reach.support(normals)
    offsets = np.broadcast_to(offsets, lowest.shape)
    separates = (lowest >= clearance[:, None]).all(axis=1)
    far = np.logical_or.reduceat(separates, ends - faces, axis=1).all(axis=0) & problem.prune
    swarm = np.arange(problem.n_uas)
    for row in np.flatnonzero(~far):
        own = slice(ends[row] - faces[row], ends[row])
        yield Separation(
            problem.obstacles[row][0],
            normals[own],
            swarm,
            None,
            offsets[..., own],
            clearance[:, own],
            lowest[..., own],
            highest[..., own],
            problem.prune,
        )


def from_moving_obstacles(problem: PlanningProblem) -> Iterator[Separation]:
    """Every UAS from each moving obstacle's predicted closed cylinder."""
    faces = problem.closed_faces(problem.obstacle_sides)
    swarm = np.arange(problem.n_uas)
    highest, lowest = problem.reach.support(faces), -problem.reach.support(-faces)
    for row, moving in enumerate(problem.moving):
        offset = -(moving.position_m @ faces.T)
        offset = np.broadcast_to(offset, (problem.n_uas, *offset.shape))
        size = np.full(len(faces), moving.radius_m)
        if problem.planar:
            down_m = np.abs(moving.position_m[:, 2] - problem.x0[:, [2]]) - moving.half_height_m
            if (down_m >= problem.moving_clearance_m[:, [row]]).all():
                continue  # passes over or under the plane
        else:
            size[-2:] = moving.half_height_m
        clearance = size + problem.moving_clearance_m[:, [row]]
        yield Separation(
            moving.name,
            faces,
            swarm,
            None,
            offset,
            clearance,
            lowest + offset,
            highest + offset,
            problem.prune,
            problem.corners_of_all,
        )


def from_each_other(problem: PlanningProblem) -> Iterator[Separation]:
    """Each pair of UAS: |p_i - p_j| >= delta_C,min as a closed cylinder."""
    first, second = np.triu_indices(problem.n_uas, k=1)
    if not len(first):
        return
    faces = problem.closed_faces(problem.obstacle_sides)
    ahead, behind = problem.reach.support(faces), problem.reach.support(-faces)
    clearance = np.repeat(problem.separation_m[first, second][:, None], len(faces), axis=1)
    lowest, highest = -(behind[first] + ahead[second]), ahead[first] + behind[second]
    offset = np.zeros(lowest.shape)
    yield Separation(
        "collision",
        faces,
        first,
        second,
        offset,
        clearance,
        lowest,
        highest,
        problem.prune,
        problem.corners_of_all,
    )
