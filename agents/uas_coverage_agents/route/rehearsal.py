"""Flights along routes, simulated before take-off: how long they take, and what is commanded.

Several flights of a UAS are simulated side by side, each with random changes of its own. Wherever
all of them have covered the next waypoint, the worse half, by the time flown and by what the
network expects of what comes, goes on from where the better half is. In still air and among
obstacles that stand still, a flight goes as it was rehearsed, and nothing is searched any more.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.route.layers import Layers, value_of
from uas_coverage_agents.route.leg_flight import AHEAD, EAST, NORTH, observe_places
from uas_coverage_agents.route.leg_plan import search_by, still_air_code
from uas_coverage_agents.route.leg_search import HORIZON, search_workspace
from uas_coverage_agents.route.places import detour_s, write_place
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.lookahead import fly_kinematically
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import Arena
from uas_coverage_env.world.coverage import away_from_home_m, speed_of

CANDIDATES = 4
"""Sets of routes that are rehearsed, the cheapest of which is flown."""

_FLIGHTS = 8  # of a UAS side by side
_CHANGES = 400  # in each step, shared by these flights
_WAYPOINTS = 100  # larger missions get fewer candidates and flights
_STUCK_S = 20.0  # what is charged where guidance would have to fly
_SAME = 1e-6  # metres, metres per second


def in_large_missions(count: int, n_waypoints: int) -> int:
    """What is left of a count of candidates or flights in a mission of so many waypoints."""
    return max(1, min(count, count * _WAYPOINTS // n_waypoints))


class Flights(NamedTuple):
    """Flights of a UAS side by side.

    Attributes:
        x: (F, 14) states.
        reference: (F, 2) of the inner loops.
        plan: (F, HORIZON, 3) what is left of the plan.
        kept: (F,) whether there is one.
        left: (F, W) waypoints to come.
        n_left: (F,) how many.
        steps: (F,) flown so far.
        cost_s: (F,) time flown and to come, as expected.
        commands: (F, N, 3) flown so far: velocity north and east [m/s], altitude [m].
    """

    x: NDArray[np.float64]
    reference: NDArray[np.float64]
    plan: NDArray[np.float64]
    kept: NDArray[np.bool_]
    left: NDArray[np.int64]
    n_left: NDArray[np.int64]
    steps: NDArray[np.int64]
    cost_s: NDArray[np.float64]
    commands: NDArray[np.float64]


def _room(n: int, n_waypoints: int, most_steps: int) -> Flights:
    """For so many flights."""
    return Flights(
        x=np.zeros((n, S.N_STATES)),
        reference=np.zeros((n, 2)),
        plan=np.zeros((n, HORIZON, 3)),
        kept=np.zeros(n, np.bool_),
        left=np.zeros((n, n_waypoints), np.int64),
        n_left=np.zeros(n, np.int64),
        steps=np.zeros(n, np.int64),
        cost_s=np.zeros(n),
        commands=np.zeros((n, most_steps, 3)),
    )


@allocating_kernel
def _go_on_from(flights, f, g):
    """Let flight f go on from where flight g is."""
    flights.x[f] = flights.x[g]
    flights.reference[f] = flights.reference[g]
    flights.plan[f] = flights.plan[g]
    flights.kept[f] = flights.kept[g]
    flights.left[f] = flights.left[g]
    flights.n_left[f], flights.steps[f] = flights.n_left[g], flights.steps[g]
    flights.cost_s[f] = flights.cost_s[g]
    flights.commands[f, : flights.steps[g]] = flights.commands[g, : flights.steps[g]]


@allocating_kernel
def _forget_covered(arena, left, n, x):
    """Take out the waypoints that a state covers; how many are left."""
    kept = 0
    for k in range(n):
        at = arena.waypoints[left[k]]
        dx, dy, dz = x[S.X] - at.position_m[0], x[S.Y] - at.position_m[1], x[S.Z] - at.position_m[2]
        if dx * dx + dy * dy + dz * dz > at.radius_m * at.radius_m:
            left[kept] = left[k]
            kept += 1
    return kept


@allocating_kernel
def _fly_step(arena, i, x, reference, left, n, values, workspace):
    """Fly UAS i on for a step at a velocity and altitude; how many waypoints are left."""
    command = workspace.command[0]
    write_command(command, VELOCITY, values[0], values[1], values[2])
    fly_kinematically(arena.vehicles[i], x, reference, command, workspace.u)
    return _forget_covered(arena, left, n, x)


@allocating_kernel
def _rest_s(arena, around, i, x, reference, left, n, layers, workspace):
    """Time [s] to the third of the places to come, and straight on along the others."""
    ahead, speed_mps = workspace.ahead, arena.uas[i].speed_mps
    for k in range(AHEAD):
        workspace.rows[k] = write_place(arena, i, left, n, k, ahead[k])
    seconds = observe_places(x, reference, speed_mps, ahead[0], ahead[1], ahead[2], workspace.row)
    seconds += value_of(layers, workspace.row)
    seconds += detour_s(arena, around, i, workspace.rows[0], x, ahead[0])
    for k in range(3, n + 1):
        write_place(arena, i, left, n, k - 1, ahead[0])
        write_place(arena, i, left, n, k, ahead[1])
        seconds += (
            math.hypot(ahead[1, NORTH] - ahead[0, NORTH], ahead[1, EAST] - ahead[0, EAST])
            / speed_mps
        )
    return seconds


@allocating_kernel
def _fly_until(code, arena, around, i, flights, f, goal, layers, rng, workspace):
    """Fly flight f on until less than so many waypoints are left, -1: until it has landed."""
    x, reference, left = flights.x[f], flights.reference[f], flights.left[f]
    rules, uas = arena.rules[0], arena.uas[i]
    while flights.n_left[f] > goal:
        step = flights.steps[f]
        plan = flights.plan[f]
        if step == flights.commands.shape[1] or not search_by(
            code,
            arena,
            around,
            i,
            x,
            reference,
            left[: min(flights.n_left[f], AHEAD)],
            layers,
            plan,
            flights.kept[f],
            rng,
            workspace,
            None,
        ):
            return False
        flights.commands[f, step] = plan[0]
        flights.n_left[f] = _fly_step(
            arena, i, x, reference, left, flights.n_left[f], plan[0], workspace
        )
        plan[:-1] = plan[1:].copy()
        flights.kept[f] = True
        flights.steps[f] += 1
        if (
            flights.n_left[f] == 0
            and away_from_home_m(uas, x) <= rules.landing_distance_m
            and speed_of(x) < rules.landing_speed_mps
        ):
            return True
    return True


@allocating_kernel
def _rehearse(code, arena, around, i, x, route, layers, rng, workspace, flights):
    """Simulate flights of UAS i along a route, from rest; the quickest becomes the first of them.

    Returns:
        Time that it takes [s], with an estimate where guidance would have to fly.
    """
    n, dt_s = route.shape[0], arena.rules[0].dt_s
    n_flights = flights.x.shape[0]
    for f in range(n_flights):
        flights.x[f] = x
        flights.reference[f] = 0.0
        flights.kept[f] = False
        flights.left[f, :n] = route
        flights.n_left[f], flights.steps[f] = n, 0
    goal, flew = n, True
    while goal >= 0 and flew:
        goal -= 1
        flew = False
        for f in range(n_flights):
            done = _fly_until(code, arena, around, i, flights, f, goal, layers, rng, workspace)
            flights.cost_s[f] = flights.steps[f] * dt_s
            if goal >= 0 or not done:
                flights.cost_s[f] += _rest_s(
                    arena, around, i, flights.x[f], flights.reference[f], flights.left[f],
                    flights.n_left[f], layers, workspace,
                )  # fmt: skip
            if done:
                flew = True
            else:
                flights.cost_s[f] += _STUCK_S
        order = np.argsort(flights.cost_s)
        if goal >= 0:
            for k in range(n_flights // 2):
                _go_on_from(flights, order[n_flights - 1 - k], order[k])
        else:
            _go_on_from(flights, 0, order[0])
    if not flew:
        _go_on_from(flights, 0, np.argmin(flights.cost_s))
    return flights.cost_s[0]


class Rehearsed(NamedTuple):
    """The flight of a UAS as it was rehearsed, from where it has been flown to.

    Attributes:
        commands: (N, 3) of its steps: velocity north and east [m/s], altitude [m].
        x: (14,) state expected next.
        reference: (2,) [m/s] of the inner loop.
        left: (W,) waypoints to come.
    """

    commands: NDArray[np.float64]
    x: NDArray[np.float64]
    reference: NDArray[np.float64]
    left: NDArray[np.int64]


class Rehearsal:
    """Rehearses flights from where all UAS stand, and says what is commanded along them.

    Args:
        arena: The arena.
        around: The same with its obstacles raised, see `places`.
        layers: `Layers` of the flight network.
        x: (U, 14) states before take-off.
        rng: Of the changes.
    """

    def __init__(
        self,
        arena: Arena,
        around: Arena,
        layers: Layers,
        x: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> None:
        self._arena, self._around, self._layers = arena, around, layers
        self._x, self._rng = x.copy(), rng
        n_waypoints = len(arena.waypoints)
        n_flights = in_large_missions(_FLIGHTS, n_waypoints)
        self._room = _room(n_flights, n_waypoints, int(arena.rules[0].max_steps))
        self._workspace = search_workspace(
            int(arena.rules[0].lookahead_steps), _CHANGES // n_flights, slow_starts=True
        )
        self._known: dict[tuple[int, ...], tuple[float, NDArray[np.float64]]] = {}
        self._flights: list[Rehearsed | None] = [None] * len(x)

    def reached_s(self, u: int, route: NDArray[np.int64]) -> NDArray[np.float64]:
        """When UAS u reaches each waypoint of a route, and home [s]; (0,) if it has no waypoints.

        Where guidance would have to fly, the rest is reached with an estimate of the end.
        """
        if len(route) == 0:
            return np.zeros(1)
        seconds, commands = self._flown(u, route)
        x, reference, left = self._x[u].copy(), np.zeros(2), route.copy()
        dt_s, n, at_s = self._arena.rules[0].dt_s, len(route), {}
        for step, values in enumerate(commands):
            n_left = _fly_step(self._arena, u, x, reference, left, n, values, self._workspace)
            if n_left < n:
                now = set(left[:n_left].tolist())
                at_s |= {w: (step + 1) * dt_s for w in route.tolist() if w not in now | set(at_s)}
                n = n_left
        return np.array([*(at_s.get(w, seconds) for w in route.tolist()), seconds])

    def take(self, routes: Sequence[NDArray[np.int64]]) -> None:
        """Fly along these routes as rehearsed."""
        for u, route in enumerate(routes):
            if len(route):
                commands = self._flown(u, route)[1]
                self._flights[u] = Rehearsed(commands, self._x[u].copy(), np.zeros(2), route.copy())

    def next(self, u: int, x: NDArray[np.float64], route: NDArray[np.int64]) -> list[float] | None:
        """Velocity north and east [m/s] and altitude [m] of the next step of UAS u.

        None where the flight was not rehearsed to here, or has gone otherwise.
        """
        flight = self._flights[u]
        if flight is None:
            return None
        commands, expected, reference, left = flight
        goes_as_rehearsed = (
            len(commands) > 0
            and np.array_equal(route, left)
            and np.abs(x[: S.VZ + 1] - expected[: S.VZ + 1]).max() < _SAME
        )
        if not goes_as_rehearsed:
            self._flights[u] = None
            return None
        n_left = _fly_step(
            self._arena, u, expected, reference, left, len(left), commands[0], self._workspace
        )
        self._flights[u] = Rehearsed(commands[1:], expected, reference, left[:n_left])
        return commands[0].tolist()

    def _flown(self, u: int, route: NDArray[np.int64]) -> tuple[float, NDArray[np.float64]]:
        """Time [s] and commands of the flight of UAS u along a route."""
        key = (u, *route.tolist())
        if key not in self._known:
            room = self._room
            seconds = _rehearse(
                still_air_code(), self._arena, self._around, u, self._x[u], route, self._layers,
                self._rng, self._workspace, room,
            )  # fmt: skip
            self._known[key] = float(seconds), room.commands[0, : room.steps[0]].copy()
        return self._known[key]
