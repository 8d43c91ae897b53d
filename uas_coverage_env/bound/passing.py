"""The least cost of passing a waypoint, from the middle of one leg to the middle of the next.

Small convex programs, many at once, see docs/bound.md, "From the middle of a leg to the next".
What is returned is the value of a feasible solution of the dual program, hence a lower bound
however well it was solved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.bound.turning import Motion

FloatArray = NDArray[np.float64]

_FIRST, _LAST = 30.0, 0.02  # weights of the barrier, in costs
_SHARPER = 0.3
_DONE = 0.6  # share of a Newton step after which the barrier is lowered
_SHARES = 0.98, 0.7, 0.35, 0.1  # of the way to the nearest limit that are tried
_GAP = 1.0  # that is left, in costs
_ITERATIONS = 60
_MISSED = 10.0  # price of missing a middle, over that of a metre
_AT_ONCE = 1024


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
        price: (N, 2, 2) of a metre, from above: a vector for each leg, of length per_m.
        state_price: (N, 2, 3, 2) of velocity, tilt and rate at each middle.
    """

    radius_m: FloatArray
    along: FloatArray
    half_m: FloatArray
    price: FloatArray
    state_price: FloatArray


class Passed(NamedTuple):
    """Least costs, and the flights that come close to them.

    Attributes:
        cost: (N,) lower bounds.
        place_m: (N, 2, 2) position at each middle, relative to the middle, less the potential.
        state: (N, 2, 3, 2) velocity, tilt and rate there.
        paid: (N,) what that flight pays for its steps.
    """

    cost: FloatArray
    place_m: FloatArray
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
    """(K + J, 2, size) whose norms are limited, or cost; first the variables themselves, in pairs."""
    largest: FloatArray
    """(K,) the first of them is that of the waypoint."""
    weights: FloatArray
    """(J,)"""
    place: FloatArray
    """(3, 2, size) position at both ends, and a step before the last, from the waypoint."""
    carried: FloatArray
    """(2, 2, size) the same less the potential."""
    state: FloatArray
    """(2, 3, 2, size) velocity, tilt and rate at both ends."""
    products: FloatArray
    """(3 (K + J), size²) of the rows of each pair: first, both, second."""


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
        n = len(passages.radius_m)
        parts = [
            self._least(shape, halves, Passages(*(part[k : k + _AT_ONCE] for part in passages)))
            for k in range(0, n, _AT_ONCE)
        ]
        return Passed(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _shape(self, halves: tuple[Half, Half]) -> _Shape:
        """The flight, step by step."""
        motion, costs = self.motion, self.costs
        before, after = halves
        plan = ["step"] * before.middle + ["jump"] * (not before.joined) + ["step"] * before.visit
        plan += ["visit"] + ["step"] * after.visit + ["jump"] * (not after.joined)
        plan += ["step"] * after.middle
        pairs = 6 + plan.count("step") + 4 * plan.count("jump")
        size = 2 * pairs
        variables = np.eye(size).reshape(pairs, 2, size)
        fresh = iter(range(3, pairs))  # after the place of the visit, and what it misses
        largest = np.full(pairs, costs.across_m)
        missed = variables[1:3].reshape(4, size)[:3]
        nothing = np.zeros(size)
        limits: list[tuple[FloatArray, float]] = []
        priced = [(np.stack([row, nothing]), _MISSED * costs.per_m) for row in missed]

        def new_state() -> FloatArray:
            own = [next(fresh) for _ in motion.largest]
            largest[own] = motion.largest
            return variables[own]

        def potential(x: FloatArray) -> FloatArray:
            return np.einsum("i,iax->ax", motion.potential, x)

        first = x = new_state()
        place = at_visit = np.zeros((2, size))
        last = place
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
        state = np.stack([first, x])
        places = variables[0] + np.stack([-at_visit, place - at_visit, last - at_visit])
        rows = np.concatenate([variables, *(row[None] for row, _ in limits + priced)])
        one, two = rows[:, 0, :, None], rows[:, 1, :, None]
        across = one * two.transpose(0, 2, 1)
        products = np.stack(
            [
                one * one.transpose(0, 2, 1),
                across + across.transpose(0, 2, 1),
                two * two.transpose(0, 2, 1),
            ],
            axis=1,
        )
        return _Shape(
            plan.count("step"),
            rows,
            np.append(largest, [most for _, most in limits]),
            np.array([weight for _, weight in priced]),
            places,
            places[:2] - np.einsum("i,eiax->eax", motion.potential, state),
            state,
            products.reshape(-1, size * size),
        )

    def _least(self, shape: _Shape, halves: tuple[Half, Half], passages: Passages) -> Passed:
        costs, sides = self.costs, np.array([1.0, -1.0])
        n, size = len(passages.radius_m), shape.rows.shape[2]
        cost = np.einsum("e,nea,eax->nx", sides, passages.price, shape.carried)
        cost += np.einsum("e,neia,eiax->nx", sides, passages.state_price, shape.state)
        fixed = shape.steps * costs.step
        fixed += np.einsum("nea,nea,ne->n", passages.price, passages.along, passages.half_m)
        # the last step leads past the middle: the sample before it is short of it
        leg = np.array([0, 1, 1])
        middles = np.einsum("nea,eax->nex", passages.along[:, leg], shape.place)
        middles -= np.eye(size)[2:5]
        beyond_m = (sides * passages.half_m)[:, leg] - np.array([1, 1, -1]) * 0.5 * costs.step_m
        ending = np.array([half.ends for half in halves])[leg]
        ending[2] &= halves[1].middle + halves[1].visit > 0
        program = _Program(
            shape,
            cost,
            np.broadcast_to(shape.largest, (n, len(shape.largest))).copy(),
            middles[:, ending],
            beyond_m[:, ending],
            0.5 * costs.step_m,
        )
        program.largest[:, 0] = passages.radius_m
        start = np.zeros((n, size))
        start[:, 2:5] = np.where(ending, beyond_m, 0.0)
        value, z = program.solved(start)
        flown = np.einsum("jax,nx->nja", shape.rows[len(shape.largest) :], z)
        place_m = np.einsum("eax,nx->nea", shape.carried, z)
        place_m += sides[:, None] * passages.half_m[..., None] * passages.along
        return Passed(
            value + fixed,
            place_m,
            np.einsum("eiax,nx->neia", shape.state, z),
            shape.steps * costs.step + np.linalg.norm(flown, axis=2) @ shape.weights,
        )


class _Program:
    """min cost z + sum of weights |priced z| with |limits z| <= largest, |middles z + beyond| <= half.

    A barrier method; all programs at once.
    """

    def __init__(
        self,
        shape: _Shape,
        cost: FloatArray,
        largest: FloatArray,
        middles: FloatArray,
        beyond: FloatArray,
        half: float,
    ) -> None:
        self._shape, self._cost, self.largest = shape, cost, largest
        self._middles, self._beyond, self._half = middles, beyond, half

    def solved(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower bounds, and solutions."""
        barrier = np.full(len(z), _FIRST)
        best = np.full(len(z), -np.inf)
        left, program = np.arange(len(z)), self
        for _ in range(_ITERATIONS):
            at = z[left]
            value, objective, share = program._step(at, barrier[left, None])
            z[left] = at
            best[left] = np.maximum(best[left], value)
            barrier[left] *= np.where(share > _DONE, _SHARPER, 1.0)
            barrier[left] = np.maximum(barrier[left], _LAST)
            stay = objective - value > _GAP
            if not stay.all():
                left = left[stay]
                if not len(left):
                    break
                program = program._of(stay)
        return best, z

    def _of(self, which: NDArray[np.bool_]) -> _Program:
        return _Program(
            self._shape,
            self._cost[which],
            self.largest[which],
            self._middles[which],
            self._beyond[which],
            self._half,
        )

    def _at(self, z: FloatArray) -> FloatArray:
        """(N, K + J + E, 2) all that is limited, that costs, and that ends a half."""
        rows = self._shape.rows
        at = (z @ rows.reshape(-1, z.shape[1]).T).reshape(len(z), -1, 2)
        middle = np.einsum("nex,nx->ne", self._middles, z)
        return np.concatenate([at, np.stack([middle, 0.0 * middle], axis=2)], axis=1)

    def _merit(self, linear: FloatArray, at: FloatArray, barrier: FloatArray) -> FloatArray:
        n_limits, n_costs = len(self._shape.largest), len(self._shape.weights)
        square = (at**2).sum(axis=2)
        free = np.concatenate(
            [
                self.largest**2 - square[:, :n_limits],
                self._half**2 - square[:, n_limits + n_costs :],
            ],
            axis=1,
        )
        small = barrier / self._shape.weights
        size = small + np.sqrt(small**2 + square[:, n_limits : n_limits + n_costs])
        with np.errstate(invalid="ignore"):
            found = linear + size @ self._shape.weights
            found -= barrier[:, 0] * (np.log(free).sum(axis=1) + np.log(size).sum(axis=1))
        return np.where((free > 0.0).all(axis=1), found, np.inf)

    def _step(self, z: FloatArray, barrier: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A Newton step, the values of both programs before it, and which share was gone."""
        shape, (n, size) = self._shape, z.shape
        n_limits, n_rows = len(shape.largest), len(shape.rows)
        at = self._at(z)
        at[:, n_rows:, 0] += self._beyond
        square = (at**2).sum(axis=2)
        room = 2.0 * barrier / (self.largest**2 - square[:, :n_limits])
        middle_room = 2.0 * barrier / (self._half**2 - square[:, n_rows:])
        small = barrier / shape.weights
        norm = np.sqrt(small**2 + square[:, n_limits:n_rows])
        weight = shape.weights / (small + norm)
        alike = np.concatenate([room, weight], axis=1)
        force = alike[..., None] * at[:, :n_rows]
        middle_force = middle_room * at[:, n_rows:, 0]
        gradient = self._cost + np.einsum("ne,nex->nx", middle_force, self._middles)
        gradient += force.reshape(n, -1) @ shape.rows.reshape(-1, size)
        value = self._dual(force, gradient, middle_force)
        twice = np.concatenate([room**2 / barrier, -weight / ((small + norm) * norm)], axis=1)
        one, two = at[:, :n_rows, 0], at[:, :n_rows, 1]
        parts = np.stack(
            [alike + twice * one**2, twice * one * two, alike + twice * two**2], axis=2
        )
        hessian = (parts.reshape(n, -1) @ shape.products).reshape(n, size, size)
        curved = middle_room + middle_force**2 / barrier
        hessian += np.einsum("ne,nex,ney->nxy", curved, self._middles, self._middles)
        step = -np.linalg.solve(hessian, gradient[..., None])[..., 0]
        change, slope = self._at(step), (self._cost * step).sum(axis=1)
        best, share = self._merit(0.0 * slope, at, barrier), np.zeros(n)
        most = self._free(at, change)
        for part in _SHARES:
            tried = np.minimum(part * most, 1.0)
            merit = self._merit(tried * slope, at + tried[:, None, None] * change, barrier)
            share = np.where(merit < best, tried, share)
            best = np.minimum(best, merit)
        before = z.copy()
        z += share[:, None] * step
        objective = (self._cost * before).sum(axis=1)
        objective += np.sqrt(square[:, n_limits:n_rows]) @ shape.weights
        return value, objective, share

    def _dual(
        self, force: FloatArray, residual: FloatArray, middle_force: FloatArray
    ) -> FloatArray:
        """The limits of the variables themselves take up what is not balanced."""
        own = residual.shape[1] // 2
        force = force[:, : len(self._shape.largest)].copy()
        force[:, :own] -= residual.reshape(len(residual), own, 2)
        value = -(self.largest * np.linalg.norm(force, axis=2)).sum(axis=1)
        return value + (middle_force * self._beyond - self._half * np.abs(middle_force)).sum(axis=1)

    def _free(self, at: FloatArray, change: FloatArray) -> FloatArray:
        """(N,) the share of a step that stays within all limits."""
        n_limits, n_rows = len(self._shape.largest), len(self._shape.rows)
        limited = np.r_[:n_limits, n_rows : at.shape[1]]
        largest = np.concatenate(
            [self.largest, np.full((len(at), at.shape[1] - n_rows), self._half)], axis=1
        )
        at, change = at[:, limited], change[:, limited]
        a = (change**2).sum(axis=2)
        b = (at * change).sum(axis=2)
        c = largest**2 - (at**2).sum(axis=2)
        return (c / (b + np.sqrt(b**2 + a * c) + 1e-12)).min(axis=1)
