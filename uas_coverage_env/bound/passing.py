"""The least cost of passing a waypoint, from the middle of one leg to the middle of the next.

Small convex programs, many at once, see docs/bound.md, "From the middle of a leg to the next".
What is returned is the value of a feasible solution of the dual program, hence a lower bound
however well it was solved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.cones import least_costs
from uas_coverage_env.bound.turning import Motion

FloatArray = NDArray[np.float64]

_FIRST = 30.0  # weight of the barrier, in costs
_MISSED = 10.0  # price of missing a middle, over that of a metre: no higher ones are of use

# the first pairs of variables: place of the visit, by what it misses both ends and the step before
# the last; then those of the steps
_PLACE, _MISSES, _OWN = 0, slice(1, 4), 4
_MISSES_AHEAD = slice(2 * _MISSES.start, 2 * _MISSES.stop, 2)  # the first of each pair


class Half(NamedTuple):
    """How many steps of half a leg are counted.

    Attributes:
        middle: Steps next to the middle of the leg.
        visit: Steps next to the visit.
        joined: There are no others between the two.
        ends: The half ends at the middle; otherwise it is left open what follows.
    """

    middle: int
    visit: int
    joined: bool
    ends: bool


def exactly(steps: int) -> Half:
    """All of so many steps."""
    return Half(0, steps, True, True)


def at_least(middle: int, visit: int) -> Half:
    """So many steps next to either end, and any number between them."""
    return Half(middle, visit, False, True)


def some(visit: int) -> Half:
    """So many steps next to the visit, and whatever follows them straight on."""
    return Half(0, visit, True, False)


class Passages(NamedTuple):
    """Pairs of halves, of the same numbers of steps.

    Attributes:
        radius_m: (N,) of the waypoint.
        along: (N, 2, 2) unit vectors along the leg before and the leg after.
        half_m: (N, 2) from the waypoint to the middle of each.
        price: (N, 2, 4, 2) of the state at each middle, a vector for each of its parts: position
            relative to the middle, less the potential, velocity, tilt and rate. Where a half does
            not end at the middle, per_m straight ahead for the position and nothing for the others.
        enough: (N,) a bound above which it does not matter how good it is.
    """

    radius_m: FloatArray
    along: FloatArray
    half_m: FloatArray
    price: FloatArray
    enough: FloatArray


class Passed(NamedTuple):
    """Least costs, and the flights that come close to them.

    Attributes:
        cost: (N,) lower bounds.
        state: (N, 2, 4, 2) at each middle, as in the prices.
        paid: (N,) what that flight pays for its steps.
    """

    cost: FloatArray
    state: FloatArray
    paid: FloatArray


class Costs(NamedTuple):
    """What a flight pays.

    Attributes:
        step: Of a step.
        mps: Of a m/s in a step.
        rad: Of a radian of tilt beyond trim in a step.
        per_m: Of a metre, straight at full speed.
        step_m: How far a step goes at most.
        across_m: How far apart two positions are at most.
    """

    step: float
    mps: float
    rad: float
    per_m: float
    step_m: float
    across_m: float


class _Shape(NamedTuple):
    """A flight in terms of the variables of the program; (..., 2, size) are both axes."""

    steps: int
    rows: FloatArray
    """(K + J, 2, size) norms that are limited, or cost; first the variables, in pairs."""
    largest: FloatArray
    """(K,) the first of them is that of the waypoint."""
    weights: FloatArray
    """(J,)"""
    place: FloatArray
    """(3, 2, size) position at both ends, and a step before the last, from the waypoint."""
    state: FloatArray
    """(2, 4, 2, size) at both ends, position less the potential."""
    axis: FloatArray
    """(K + J, size / 2) the rows along one axis, of the variables along this axis."""


class Passing:
    """Programs for one vehicle.

    Args:
        motion: Of the vehicle.
        costs: What it pays.
    """

    def __init__(self, motion: Motion, costs: Costs) -> None:
        self.motion, self.costs = motion, costs
        self._shapes: dict[tuple[Half, Half], _Shape] = {}

    def least(self, halves: tuple[Half, Half], passages: Passages) -> Passed:
        """Bounds of passages.

        Args:
            halves: Steps counted before and after the visit.
            passages: N of them.
        """
        if halves not in self._shapes:
            self._shapes[halves] = self._shape(halves)
        shape = self._shapes[halves]
        return self._least(shape, halves, passages)

    def _shape(self, halves: tuple[Half, Half]) -> _Shape:
        """The flight, step by step."""
        motion, costs = self.motion, self.costs
        before, after = halves
        plan = ["step"] * before.middle + ["jump"] * (not before.joined) + ["step"] * before.visit
        plan += ["visit"] + ["step"] * after.visit + ["jump"] * (not after.joined)
        plan += ["step"] * after.middle
        pairs = 7 + plan.count("step") + 4 * plan.count("jump")
        size = 2 * pairs
        variables = np.eye(size).reshape(pairs, 2, size)
        fresh = iter(range(_OWN, pairs))
        potential_m = float(np.abs(motion.potential) @ motion.largest)
        largest = np.full(pairs, costs.across_m + 2.0 * potential_m)
        limits: list[tuple[FloatArray, float]] = []
        priced = [(row, _MISSED * costs.per_m) for row in variables[_MISSES]]

        def new_state() -> FloatArray:
            own = [next(fresh) for _ in motion.largest]
            largest[own] = motion.largest
            return variables[own]

        def potential(x: FloatArray) -> FloatArray:
            return np.einsum("i,iax->ax", motion.potential, x)

        first: FloatArray = new_state()
        x: FloatArray = first
        place: FloatArray = np.zeros((2, size))
        at_visit = last = place
        for what in plan:
            if what == "visit":
                at_visit = place
            elif what == "jump":
                way = variables[next(fresh)]
                priced.append((way, costs.per_m))
                following = new_state()
                place = place + way + potential(following) - potential(x)
                x = following
            else:
                own = next(fresh)
                largest[own] = motion.largest_input
                push = variables[own]
                last = place
                priced.append((x[0], costs.mps))
                priced.append((x[1] - motion.trim * x[0], costs.rad))
                place = place + np.einsum("i,iax->ax", motion.position, x) + motion.input_m * push
                x = np.einsum("ij,jax->iax", motion.A, x) + motion.B[:, None, None] * push
                limits += zip(x, motion.largest, strict=True)
        ends = np.stack([first, x])
        places = variables[_PLACE] + np.stack([-at_visit, place - at_visit, last - at_visit])
        free = places[:2] - np.einsum("i,eiax->eax", motion.potential, ends)
        priced = [(row, weight) for row, weight in priced if weight > 0.0]
        rows = np.concatenate([variables, *(row[None] for row, _ in limits + priced)])
        axis = rows[:, 0, ::2]  # both axes alike
        return _Shape(
            plan.count("step"),
            rows,
            np.append(largest, [most for _, most in limits]),
            np.array([weight for _, weight in priced]),
            places,
            np.concatenate([free[:, None], ends], axis=1),
            np.ascontiguousarray(axis),
        )

    def _least(self, shape: _Shape, halves: tuple[Half, Half], passages: Passages) -> Passed:
        costs, sides = self.costs, np.array([1.0, -1.0])
        n, size = len(passages.radius_m), shape.rows.shape[2]
        cost = np.einsum("e,nesa,esax->nx", sides, passages.price, shape.state)
        fixed = shape.steps * costs.step
        fixed += np.einsum(
            "nea,nea,ne->n", passages.price[:, :, 0], passages.along, passages.half_m
        )
        # the last step leads past the middle: the sample before it is short of it
        leg = np.array([0, 1, 1])
        middles = np.einsum("nea,eax->nex", passages.along[:, leg], shape.place)
        middles -= np.eye(size)[_MISSES_AHEAD]
        beyond_m = (sides * passages.half_m)[:, leg] - np.array([1, 1, -1]) * 0.5 * costs.step_m
        ending = np.array([half.ends for half in halves])[leg]
        ending[2] &= halves[1].middle + halves[1].visit > 0
        largest = np.broadcast_to(shape.largest, (n, len(shape.largest))).copy()
        largest[:, _PLACE] = passages.radius_m
        z = np.zeros((n, size))
        z[:, _MISSES_AHEAD] = np.where(ending, beyond_m, 0.0)
        value = np.zeros(n)
        least_costs(
            shape.axis,
            shape.weights,
            largest,
            cost,
            np.ascontiguousarray(middles[:, ending]),
            np.ascontiguousarray(beyond_m[:, ending]),
            0.5 * costs.step_m,
            passages.enough - fixed,
            np.full(n, _FIRST),
            z,
            value,
        )
        flown = np.einsum("jax,nx->nja", shape.rows[len(shape.largest) :], z)
        state = np.einsum("esax,nx->nesa", shape.state, z)
        state[:, :, 0] += sides[:, None] * passages.half_m[..., None] * passages.along
        return Passed(
            value + fixed,
            state,
            shape.steps * costs.step + np.linalg.norm(flown, axis=2) @ shape.weights,
        )
