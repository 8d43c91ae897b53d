"""The whole flight of one UAS along its route: a convex program for given steps of the visits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import (
    POSITION,
    VELOCITY,
    FlightModel,
    excess,
)
from uas_coverage_baselines.trajectory.interior_point import solve
from uas_coverage_baselines.trajectory.rows import SoftRows
from uas_coverage_baselines.trajectory.space import (
    Body,
    Space,
    height_rows,
    separating_rows,
    spare_fixed_m,
    spare_from_body_m,
    spare_height_m,
)

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

TOLERANCE_M = 0.02
"""Soft rows that are violated by less in sum count as kept: margins are larger than this."""

# lengths at scale 1
_FENCE_NEAR_M = 25.0  # what is farther than this beyond its distance gets no rows
_SMALL_M = 2.5  # spheres with a smaller radius are visited less far inside
_FORGIVEN = 0.8  # share of that by which a visit may miss: it is inside the radius still
_SLOW_SHARE = 0.97  # of the speed at which a waypoint may be covered
_SLOW_WEIGHT = 2.0  # of 1 m/s too much
_HEIGHT_SPARE_M = 0.2  # within the heights from which a waypoint may be covered
_LANDING_WEIGHT = 4.0  # of 1 m/s too much at the landing
_CLEAR_WEIGHT = 2.0  # of 1 m too near
_AIRSPEED_WEIGHT = 4.0  # of 1 m/s too much
_SETTLING = np.linspace(1.0, 0.0, 8)[:-1]  # share of an excess that the first steps may have
_SETTLED = 1.05  # of the excess: a state on its limit cannot be led back
_HOPELESS = 3.0  # more violation than this is no matter of faces


@dataclass(frozen=True)
class Landing:
    """Where and how a flight ends."""

    home_m: FloatArray
    distance_m: float
    speed_mps: float


@dataclass(frozen=True)
class Air:
    """Air that moves.

    Attributes:
        wind_mps: (3,) its velocity, north, east and down.
        speed_mps: Highest airspeed.
    """

    wind_mps: FloatArray
    speed_mps: float


class Allowance(NamedTuple):
    """What visits and landings keep, for what the model does not know."""

    inside_m: float
    """So far inside their spheres waypoints are visited."""
    landing_distance: float
    """Used share of the landing distance."""
    landing_speed: float
    """Used share of the landing speed."""


AS_MODELLED = Allowance(0.05, 0.9, 0.85)


@dataclass(frozen=True)
class Asked:
    """What waypoints ask for beside that a UAS comes near.

    Attributes:
        heights_m: (W, 2) above the ground, from and to; infinite where none are asked for.
        max_speed_mps: (W,) infinite where none is.
    """

    heights_m: FloatArray
    max_speed_mps: FloatArray


@dataclass(frozen=True)
class PlannedFlight:
    """A flight of one UAS along a route.

    Attributes:
        visits: (K,) step of each waypoint of the route.
        x: (N+1, 10) states of the program.
        u: (N, 3) inputs.
        costate: (N, 10) what a change of the states 1..N costs.
        violation: Of the soft rows, summed, but for visits that are inside their spheres still;
            inf where the program was not solved.
        missed_m: (K,) how far each visit is outside of its sphere.
    """

    visits: IntArray
    x: FloatArray
    u: FloatArray
    costate: FloatArray
    violation: float
    missed_m: FloatArray

    def after(self, steps: int, visits: IntArray) -> PlannedFlight:
        """What is left of it after some steps, with some of its visits (indices)."""
        return PlannedFlight(
            self.visits[visits] - steps,
            self.x[steps:],
            self.u[steps:],
            self.costate[steps:],
            self.violation,
            self.missed_m[visits],
        )

    @property
    def steps(self) -> int:
        """N."""
        return len(self.u)

    @property
    def path_m(self) -> FloatArray:
        """(N+1, 3)."""
        return self.x[:, POSITION]

    @property
    def is_clear(self) -> bool:
        """Whether nothing is violated."""
        return self.violation < TOLERANCE_M


@dataclass
class FlightProgram:
    """Flights of one UAS along routes of waypoints.

    Attributes:
        model: Of the vehicle.
        space: What stands.
        landing: Where it ends.
        waypoints_m: (W, 3).
        radius_m: (W,).
        asked: What is asked beside; None: nothing of any waypoint.
        bodies: On known paths from step 0.
        earliest: (W,) steps before which a waypoint is not to be visited.
        reserve: Of the limits in `model`, by which the first steps may be beyond them.
        allowance: Of visits and of the landing.
        air: In which the airspeed is limited, too; None: in still air.
        solved: How many programs were solved: the effort.
    """

    model: FlightModel
    space: Space
    landing: Landing
    waypoints_m: FloatArray
    radius_m: FloatArray
    asked: Asked | None = None
    bodies: Sequence[Body] = ()
    earliest: IntArray | None = None
    air: Air | None = None
    reserve: float = 0.0
    allowance: Allowance = AS_MODELLED
    solved: int = field(default=0)

    def solve(
        self,
        start: FloatArray,
        route: IntArray,
        visits: IntArray,
        guess: FloatArray,
        inputs: FloatArray | None = None,
        rounds: int = 3,
    ) -> PlannedFlight:
        """The flight that visits at given steps and lands at the last.

        Args:
            start: (10,) state. Where it is beyond a limit, so are the first steps, ever less.
            route: (K,) waypoints.
            visits: (K,) a step in 1..N for each.
            guess: (N+1, 10) states, or (N+1, 3) positions.
            inputs: (N, 3) guess.
            rounds: How often faces are chosen anew, at most.
        """
        n_steps = len(guess) - 1
        visits = np.asarray(visits, np.int64)
        if guess.shape[1] == 3:
            guess = self._at_path_speed(guess)
        if self.earliest is not None and (visits < self.earliest[route]).any():
            return _unsolved(visits, guess)
        u = np.zeros((n_steps, 3)) if inputs is None else inputs
        loose = np.ones(n_steps + 1)
        more = max(_SETTLED * excess(self.model, start), self.reserve)
        loose[1 : len(_SETTLING) + 1] += more * _SETTLING[:n_steps]
        flight = _unsolved(visits, guess)
        x = guess
        for _ in range(rounds):
            x = x.copy()
            x[0] = start
            rows = self._rows(route, visits, np.ascontiguousarray(x[:, POSITION]))
            self.solved += 1
            found = solve(self.model, rows, x, u, loose=loose)
            if not found.converged or not np.isfinite(found.x).all():
                return flight if np.isfinite(flight.violation) else _unsolved(visits, guess)
            x, u = found.x, found.u
            missed_m = found.violation[: len(route)]
            forgiven = self._is_visited(route, missed_m)
            violation = float(found.violation.sum() - missed_m[forgiven].sum())
            flight = PlannedFlight(visits, x, u, found.costate, violation, missed_m)
            if violation > _HOPELESS:
                break
            if self.spare_m(flight.path_m) > -TOLERANCE_M:
                break
            flight = PlannedFlight(visits, x, u, found.costate, max(violation, 0.5), missed_m)
        return flight

    def allows(self, route: IntArray, flight: PlannedFlight) -> bool:
        """Whether a flight that was clear is so of these bodies, too, and visits in time."""
        in_time = self.earliest is None or bool((flight.visits >= self.earliest[route]).all())
        return in_time and flight.is_clear and self.spare_from_bodies_m(flight.path_m) >= 0.0

    def spare_m(self, path_m: FloatArray) -> float:
        """Distance beyond what is kept from all that stands or moves, along a path (N+1, 3)."""
        path_m = np.ascontiguousarray(path_m)
        outside_m = path_m[1:-1] @ self.space.fence_normals.T + self.space.fence_offsets_m
        spare = min(
            float(spare_fixed_m(self.space, path_m)), -float(outside_m.max(initial=-np.inf))
        )
        spare = min(spare, spare_height_m(self.space, path_m))
        return min(spare, self.spare_from_bodies_m(path_m))

    def spare_from_bodies_m(self, path_m: FloatArray) -> float:
        """The same from bodies alone."""
        path_m = np.ascontiguousarray(path_m)
        spare = np.inf
        for body in self.bodies:
            gap = spare_from_body_m(path_m, body.path_m, body.level_m, body.height_m)
            spare = min(spare, float(gap))
        return spare

    def first_meeting(self, path_m: FloatArray) -> int:
        """The first step of a path (N+1, 3) that is too near to a body; N where none is."""
        for n in range(len(path_m) - 1):
            if self.spare_from_bodies_m(path_m[: n + 2]) < 0.0:
                return n
        return len(path_m) - 1

    def visits_all(self, route: IntArray, flight: PlannedFlight) -> bool:
        """Whether a flight passes through all spheres, whatever else it violates."""
        return bool(self._is_visited(route, flight.missed_m).all())

    def _is_visited(self, route: IntArray, missed_m: FloatArray) -> NDArray[np.bool_]:
        return missed_m < _FORGIVEN * self._inside_m(route)

    def _inside_m(self, route: IntArray) -> FloatArray:
        """(K,) how far inside their spheres visits are planned."""
        return self.allowance.inside_m * np.minimum(1.0, self.radius_m[route] / _SMALL_M)

    def _at_path_speed(self, path_m: FloatArray) -> FloatArray:
        """(N+1, 10) states along positions, with the velocities of their differences."""
        x = np.zeros((len(path_m), 10))
        x[:, POSITION] = path_m
        if len(path_m) > 1:
            x[:, VELOCITY] = np.gradient(path_m, axis=0) / self.model.dt_s
        return x

    def _rows(self, route: IntArray, visits: IntArray, path_m: FloatArray) -> SoftRows:
        n_steps = len(path_m) - 1
        inside_m = self.radius_m[route] - self._inside_m(route)
        made = [_balls(visits, POSITION, self.waypoints_m[route], inside_m, 1.0)]
        end = np.array([n_steps])
        home = self.landing
        made += [
            _balls(
                end,
                POSITION,
                home.home_m[None],
                np.array([self.allowance.landing_distance * home.distance_m]),
                1.0,
            ),
            _balls(
                *(
                    end,
                    VELOCITY,
                    np.zeros((1, 3)),
                    np.array([self.allowance.landing_speed * home.speed_mps]),
                ),
                _LANDING_WEIGHT,
            ),
        ]
        if self.asked is not None:
            made += _as_asked(self.asked, route, visits)
        if self.air is not None:
            stages = np.arange(1, n_steps)
            wind_mps = np.tile(self.air.wind_mps, (len(stages), 1))
            most_mps = np.full(len(stages), self.air.speed_mps)
            made.append(_balls(stages, VELOCITY, wind_mps, most_mps, _AIRSPEED_WEIGHT))
        if len(self.space.keep_m):
            made.append(_planes(*separating_rows(self.space, path_m)))
        if self.space.least_height_m > 0.0:
            made.append(_planes(*height_rows(self.space, path_m)))
        made += self._fence_rows(path_m)
        made += [
            rows
            for body in self.bodies
            if (rows := _apart(body, path_m, self.space.near_m)) is not None
        ]
        # joined, copies of one row are stored by columns: a layout that kernels are compiled for
        return SoftRows(*(np.ascontiguousarray(np.concatenate(p)) for p in zip(*made, strict=True)))

    def _fence_rows(self, path_m: FloatArray) -> list[SoftRows]:
        space = self.space
        outside_m = path_m @ space.fence_normals.T + space.fence_offsets_m
        result = []
        for h in range(len(space.fence_offsets_m)):
            stage = np.flatnonzero(outside_m[1:-1, h] > -space.length_scale * _FENCE_NEAR_M) + 1
            if not len(stage):
                continue
            # homes may lie in the margin
            home_m = space.fence_normals[h] @ self.landing.home_m + space.fence_offsets_m[h]
            margin_m = min(space.fence_margin_m, max(-float(home_m), 0.0))
            bound = np.full(len(stage), -space.fence_offsets_m[h] - margin_m)
            normal = np.broadcast_to(space.fence_normals[h], (len(stage), 3))
            result.append(_planes(stage, normal, bound))
        return result


def _unsolved(visits: IntArray, guess: FloatArray) -> PlannedFlight:
    n_steps = len(guess) - 1
    nothing = np.zeros((n_steps, 10))
    return PlannedFlight(
        visits, guess, np.zeros((n_steps, 3)), nothing, np.inf, np.full(len(visits), np.inf)
    )


def _balls(
    stage: IntArray, states: IntArray, centre: FloatArray, radius: FloatArray, weight: float
) -> SoftRows:
    m = len(stage)
    rows = np.broadcast_to(states, (m, 3))
    return SoftRows(stage, np.ones(m, bool), rows, centre, radius, np.full(m, weight))


def _as_asked(asked: Asked, route: IntArray, visits: IntArray) -> list[SoftRows]:
    """Rows that keep visits slow and high enough, but for those of which nothing is asked."""
    speed_mps = asked.max_speed_mps[route]
    slow = np.isfinite(speed_mps)
    most_mps = _SLOW_SHARE * speed_mps[slow]
    made = [_balls(visits[slow], VELOCITY, np.zeros((slow.sum(), 3)), most_mps, _SLOW_WEIGHT)]
    for end, up in ((0, 1.0), (1, -1.0)):  # z is down: at least is z ≤ -height
        height_m = asked.heights_m[route, end]
        bound = np.isfinite(height_m)
        low_m, high_m = asked.heights_m[route[bound]].T
        spare_m = np.minimum(_HEIGHT_SPARE_M, 0.25 * (high_m - low_m))
        normal = np.broadcast_to(np.array([0.0, 0.0, up]), (int(bound.sum()), 3))
        made.append(_planes(visits[bound], normal, -up * height_m[bound] - spare_m))
    return made


def _planes(stage: IntArray, normal: FloatArray, bound: FloatArray) -> SoftRows:
    m = len(stage)
    rows = np.broadcast_to(POSITION, (m, 3))
    return SoftRows(stage, np.zeros(m, bool), rows, normal, bound, np.full(m, _CLEAR_WEIGHT))


def _apart(body: Body, path_m: FloatArray, near_m: float) -> SoftRows | None:
    """Rows that keep clear of a body that is near: a plane for each step, at both of its ends."""
    n = min(len(path_m), len(body.path_m))
    if n < 2:
        return None
    away = path_m[:n] - body.path_m[:n]
    level_m = np.hypot(away[:, 0], away[:, 1])
    beside, above = level_m - body.level_m, np.abs(away[:, 2]) - body.height_m
    near = np.flatnonzero(np.maximum(beside, above)[1:] < near_m) + 1
    if not len(near):
        return None
    face = np.zeros((n, 3))
    face[:, :2] = away[:, :2] / np.maximum(level_m, 1e-6)[:, None]
    sideways = beside >= above
    face[~sideways] = 0.0
    face[~sideways, 2] = np.where(away[~sideways, 2] > 0.0, 1.0, -1.0)
    keep_m = np.where(sideways, body.level_m, body.height_m)
    stage, normal, bound = [], [], []
    for shift in (0, -1):
        at = near + shift
        chosen = near[at >= 1]
        at = at[at >= 1]
        stage.append(at)
        normal.append(-face[chosen])
        centre = np.einsum("ij,ij->i", face[chosen], body.path_m[at])
        bound.append(-(centre + keep_m[chosen]))
    return _planes(np.concatenate(stage), np.vstack(normal), np.concatenate(bound))
