"""What the lower bound of a town leaves out, term by term, for the order that is flown.

    python benchmarks/bound_terms.py --towns 2004,2006
    python benchmarks/bound_terms.py --towns 2004 --together 1,2,3,4

`trajectory` flies each town. The rows are shares of what the flight takes: the flight at the prices
of the bound, which is as far as any bound with these prices can come; the bound of all orders; that
of the order that is flown, with prices for the middles of its legs, and by the table of triples
alone; and that of programs in which several visits in a row are planned together, with all steps
of the legs between them. The last are what tighter bounds could give, not bounds themselves: the
numbers of steps of these legs are found by local search. A minute for each town. Only towns of one
UAS, as the others need to know which UAS saves what.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Annotated, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.optimize import linprog
from scipy.sparse import csr_matrix

from uas_coverage_env import Flight, load_planner, rollout
from uas_coverage_env.bound import MissionBound
from uas_coverage_env.bound.carried import Carried
from uas_coverage_env.bound.legs import LegBounds, straight_directions
from uas_coverage_env.bound.prices import WITHIN, Prices
from uas_coverage_env.bound.turning import Motion, Turning, motion_of
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, VY

FloatArray = NDArray[np.float64]

_SIDES = 24
_STATES = 3  # of an axis
_PLACE, _INPUTS = 2 * _STATES, 2 * _STATES + 2
"""First variables of where the visit is and of what is put in; those of the states come before."""
_J_PER_WH = 3600.0


class Known(NamedTuple):
    """What the bound of a mission is made of."""

    motion: Motion
    prices: Prices
    turning: Turning
    legs: LegBounds
    speed_mps: float
    reach_m: FloatArray


def known_of(bound: MissionBound) -> Known:
    """The parts of a bound, of a fleet of one kind."""
    vehicle, ends = bound._vehicles[0], bound._ends
    return Known(
        motion_of(vehicle, ends.dt_s),
        bound._prices,
        bound._prices_turning,
        bound._legs,
        WITHIN * vehicle.limits.v_xy_max_mps,
        bound._steps_turning.reach_m,
    )


def at_prices(bound: MissionBound, flight: Flight) -> float:
    """What the flight costs at the prices of the bound [J]."""
    prices, trim = bound._prices, bound._vehicles[0].trim_tilt_rad_per_mps
    x = flight.x[:-1][flight.current_A[: len(flight.x) - 1] > 0.0]
    beyond = np.hypot(x[:, PHI] - trim * x[:, VY], x[:, THETA] + trim * x[:, VX])
    speed = np.hypot(x[:, VX], x[:, VY])
    return float((prices.step + prices.mps * speed + prices.rad * beyond).sum() - prices.once)


def order_of(bound: MissionBound, flight: Flight) -> list[tuple[int, int]]:
    """Step of the first cover and row of each waypoint that the bound counts, as flown."""
    places = bound._places.waypoints_m
    covered = np.array([one.position_m for one in flight.scenario.waypoints])
    radius_m = np.array([one.radius_m for one in flight.scenario.waypoints])
    away_m = np.linalg.norm(flight.x[:, 0, None, :3] - covered, axis=2)
    first = (away_m <= radius_m + 1e-6).argmax(axis=0)
    rows = np.linalg.norm(covered[None, :, :2] - places[:, None], axis=2).argmin(axis=1)
    return sorted((int(first[row]), place) for place, row in enumerate(rows))


class OfOrder(Carried):
    """The bound with prices for the middles, of one order.

    Args:
        bound: Of the mission.
        nodes: In this order, from the start to the end.
        rounds: In which prices of whole states are sought.
    """

    def __init__(self, bound: MissionBound, nodes: list[int], rounds: int) -> None:
        of_all = bound._carried
        assert of_all is not None, "one UAS is of one kind"
        super().__init__(of_all._legs, of_all._passing, of_all._turning, of_all._reach_m)
        self._flown = np.zeros(self._directed.shape, dtype=bool)
        self._flown[nodes[1:-1], nodes[:-2], nodes[2:]] = True
        self._directed[~self._flown] = np.inf
        self._plain = np.minimum(self._directed, self._directed.transpose(0, 2, 1))
        self._search = ((2, 7), (4, rounds))

    def _by_the_table(self) -> FloatArray:
        return np.where(self._flown, super()._by_the_table(), np.inf)


def in_a_row(
    known: Known, visits: list[int], sides_of: tuple[int, int], between: tuple[int, ...]
) -> float:
    """Least cost of some visits in a row, with given steps of the legs between them [J].

    Args:
        known: Of the mission.
        visits: Rows of the waypoints.
        sides_of: Nodes visited before and after; of these legs the steps that the bound counts.
        between: Steps of the legs between the visits.
    """
    motion, prices, legs = known.motion, known.prices, known.legs
    directions = straight_directions(legs)
    into, out = -directions[visits[0], sides_of[0]], directions[visits[-1], sides_of[1]]
    before, after = legs.before[visits[0], sides_of[0]], legs.after[visits[-1], sides_of[1]]
    n = int(before + sum(between) + after)
    at = before + np.concatenate([[0], np.cumsum(between)]).astype(int)
    size = _INPUTS + 4 * n
    beyond, speed = _INPUTS + 2 * n, _INPUTS + 3 * n
    x: FloatArray = np.zeros((2, 3, size))
    place: FloatArray = np.zeros((2, size))
    x[0, :, :_STATES] = x[1, :, _STATES:_PLACE] = np.eye(_STATES)
    place[:, _PLACE:_INPUTS] = np.eye(2)
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    sides = np.vstack([np.stack([np.cos(angles), np.sin(angles)], axis=1), into, out])
    cost, rows, bounds = np.zeros(size), [], []

    def keep(what: FloatArray, most: FloatArray | float, column: int = -1) -> None:
        row = sides @ what
        if column >= 0:
            row[:, column] -= 1.0
        rows.append(row)
        bounds.append(np.broadcast_to(most, len(sides)))

    for k in range(n + 1):
        for j in np.flatnonzero(at == k):
            centre, radius_m = legs.centre_m[visits[j]], legs.radius_m[visits[j]]
            keep(place, sides @ centre + radius_m)
        potential = np.einsum("i,aix->ax", motion.potential, x)
        for end, sign, heading in ((at[0], 1.0, into), (at[-1], -1.0, out)):
            if k == end:
                cost += sign * known.turning.per_m * (heading @ (place - potential))
        for part, most in enumerate(motion.largest):
            keep(x[:, part], most)
        if k == n:
            break
        if at[0] <= k < at[-1]:
            cost[speed + k] += prices.mps
        else:
            cost -= prices.step / known.speed_mps * ((into if k < at[0] else out) @ x[:, 0])
        cost[beyond + k] += prices.rad
        keep(x[:, 1] - motion.trim * x[:, 0], 0.0, beyond + k)
        keep(x[:, 0], 0.0, speed + k)
        inputs = np.zeros((2, size))
        inputs[0, 8 + 2 * k] = inputs[1, 9 + 2 * k] = 1.0
        keep(inputs, motion.largest_input)
        place = place + np.einsum("i,aix->ax", motion.position, x) + motion.input_m * inputs
        x = np.einsum("ij,ajx->aix", motion.A, x) + motion.B[None, :, None] * inputs[:, None]
    allowed = [(None, None)] * (8 + 2 * n) + [(0.0, None)] * (2 * n)
    found = linprog(  # pyrefly: ignore[no-matching-overload] # of sparse matrices
        cost, csr_matrix(np.vstack(rows)), np.concatenate(bounds), bounds=allowed
    )
    return prices.step * n + float(found.fun) if found.success else math.inf


def planned_together(known: Known, order: list[tuple[int, int]], size: int, first: int) -> float:
    """The order that is flown, with so many visits in a row planned together [J].

    Args:
        known: Of the mission.
        order: Step and row of each visit.
        size: So many.
        first: Size of the first group.
    """
    legs, turning, n = known.legs, known.turning, len(known.legs.before)
    steps, seq = [step for step, _ in order], [row for _, row in order]
    nodes, start, end = [n, *seq, n + 1], n, n + 1
    directions = straight_directions(legs)
    a, z = seq[0], seq[-1]
    total = turning.start[legs.start_steps[a, 0]]
    total += turning.per_m * (directions[a, start] @ legs.centre_m[start])
    total += turning.landing[legs.landing_steps[z, 0]]
    total += turning.per_m * (directions[z, end] @ legs.centre_m[end] - legs.radius_m[end])
    edges = [0, *range(first, len(seq), size), len(seq)]
    for low, high in pairwise(edges):
        group, sides_of = seq[low:high], (nodes[low], nodes[high + 1])
        fewest = []
        for i, j in pairwise(group):
            way_m = np.linalg.norm(legs.centre_m[i] - legs.centre_m[j])
            way_m -= legs.radius_m[i] + legs.radius_m[j]
            fewest.append(max(int(np.searchsorted(known.reach_m, max(way_m, 0.0))), 1))
        flown = np.diff(steps[low:high])
        total += _with_fewer_steps(known, group, sides_of, fewest, np.maximum(flown, fewest))
    return float(total - known.prices.once)


def _with_fewer_steps(
    known: Known,
    group: list[int],
    sides_of: tuple[int, int],
    fewest: list[int],
    flown: FloatArray,
) -> float:
    """Least cost of a group over the steps of its legs, by local search from those flown [J]."""
    between = tuple(int(k) for k in flown)
    best, tried, improved = in_a_row(known, group, sides_of, between), {between}, True
    while improved:
        improved = False
        for leg in range(len(between)):
            for change in (-1, 1):
                trial = (*between[:leg], between[leg] + change, *between[leg + 1 :])
                if trial in tried or trial[leg] < fewest[leg]:
                    continue
                tried.add(trial)
                cost = in_a_row(known, group, sides_of, trial)
                if cost < best - 1e-6:
                    best, between, improved = cost, trial, True
                    break
    return best


def main(
    towns: Annotated[str, typer.Option(help="seeds of towns with one UAS")] = "2004,2006",
    together: Annotated[str, typer.Option(help="so many visits in a row")] = "1,2,3",
    rounds: Annotated[int, typer.Option(help="of prices of whole states, for one order")] = 8,
) -> None:
    """Shares of what is flown."""
    sizes = [int(size) for size in together.split(",")]
    table = Table("town", "Wh", "its prices", "all orders", "this order", "its triples")
    for size in sizes:
        table.add_column(f"{size} together")
    for seed in towns.split(","):
        scenario = sample_scenario(int(seed))
        if len(scenario.uas) > 1:
            raise typer.BadParameter(f"{scenario.name} has {len(scenario.uas)} UAS, take one of 1")
        flight = rollout(scenario, load_planner("trajectory"))
        used_Wh = float(energy_Wh(flight).sum())
        bound = MissionBound(scenario)
        known, order = known_of(bound), order_of(bound, flight)
        cost, n = bound._cost(known.turning), len(known.legs.before)
        nodes = [n, *(row for _, row in order), n + 1]
        this_J = sum(
            float(cost[j, i, k]) for i, j, k in zip(nodes, nodes[1:], nodes[2:], strict=False)
        )
        step_J, once_J = known.prices.step, known.prices.once
        priced_J = OfOrder(bound, nodes, rounds).least_routes(step_J, ()) + step_J - once_J
        shares = [
            at_prices(bound, flight) / _J_PER_WH,
            bound.energy_Wh(),
            priced_J / _J_PER_WH,
            (this_J - once_J) / _J_PER_WH,
        ]
        for size in sizes:  # where the groups begin is chance: the mean of two beginnings
            begins = (size, (size + 1) // 2) if size > 1 else (1,)
            costs_J = [planned_together(known, order, size, first) for first in begins]
            shares.append(float(np.mean(costs_J)) / _J_PER_WH)
        table.add_row(
            scenario.name, f"{used_Wh:.2f}", *(f"{share / used_Wh:.3f}" for share in shares)
        )
    Console(width=120).print(table)


if __name__ == "__main__":
    typer.run(main)
