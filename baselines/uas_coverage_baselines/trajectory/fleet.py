"""Flights of the whole fleet: who visits what, each UAS's flight, and clear of each other."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.trajectory.flight_model import flight_model, reduced_state
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.program import (
    Allowance,
    Asked,
    FlightProgram,
    Landing,
    PlannedFlight,
)
from uas_coverage_baselines.trajectory.retiming import (
    Draft,
    draft,
    finished,
    retimed,
    shifted,
    stretches,
)
from uas_coverage_baselines.trajectory.space import TALL_M, Body, space_of
from uas_coverage_baselines.trajectory.work import Work, done
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access
from uas_coverage_env.planning.reserves import TRAJECTORY, TRAJECTORY_LATER, TRAJECTORY_WITH_ROOM
from uas_coverage_env.planning.routing import RoutingProblem
from uas_coverage_env.planning.routing.problem import battery_s
from uas_coverage_env.planning.routing.terrain import Terrain
from uas_coverage_env.planning.routing.trips import FreshPacks, Packs
from uas_coverage_env.vehicle.scale import braking_s, length_scale
from uas_coverage_env.world import SwarmState

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

# where the plant is not the model: what plans keep, and what is left of it to tracking
_ROOM, _TRACKING_ROOM = 0.03, 0.01  # share of the limits
_ALLOWANCE = Allowance(inside_m=0.4, landing_distance=0.7, landing_speed=0.4)
_TRACKING_ALLOWANCE = Allowance(inside_m=0.25, landing_distance=0.8, landing_speed=0.5)
_WIDER_M = 0.3  # tracking keeps of obstacles beyond the distance of plans, where it can; at scale 1
_LATER_STEPS = 12  # to make way for another
_WAITS_S, _BEFORE_S = (3.0, 8.0), 1.5  # to let pass what moves; so long before it would be met


@dataclass(frozen=True)
class Moment:
    """What a fleet is planned from.

    Attributes:
        x: (U, 14) states.
        may_work: (U,) flies, and may be sent to waypoints.
        uncovered: (W,).
        earliest: (W,) steps from now before which a waypoint is not to be visited.
        time_s: Since the start.
        forbidden: (U, W) which UAS are not to visit which waypoint; None: any may visit any.
    """

    x: FloatArray
    may_work: NDArray[np.bool_]
    uncovered: NDArray[np.bool_]
    earliest: IntArray
    time_s: float
    forbidden: NDArray[np.bool_] | None = None


class Fleet:
    """What stays the same of a mission: legs, vehicles, spaces.

    Args:
        brief: The mission.
        margin_m: Planned beyond the distances that count as a breach.
        speed_share: Of the largest horizontal speed, that is flown.
        moving_margin_m: Planned beyond the safe distances from what moves.

    Attributes:
        length_scale: Of the mission, see `vehicle.scale`.
        braking_s: After which every UAS has braked, likewise [s].
        closed_off: (U, W) waypoints to which a UAS was found to have no flight: not planned again.
    """

    def __init__(
        self,
        brief: MissionBrief,
        margin_m: float,
        speed_share: float = 1.0,
        moving_margin_m: float = 0.0,
    ) -> None:
        self.brief, self.margin_m, self._speed_share = brief, margin_m, speed_share
        self._moving_margin_m, self._reserve = moving_margin_m, TRAJECTORY
        self.length_scale = length_scale(brief.vehicles, brief.dt_s)
        self.braking_s = braking_s(brief.vehicles, brief.dt_s)
        self.terrain, self._packs = Terrain(brief), Packs.of(brief)
        arena = self.terrain.arena
        self.arena = arena
        self.access = Access(brief)
        self.closed_off = np.zeros((len(brief.uas), len(brief.waypoints)), np.bool_)
        self.waypoints_m = np.array([w.position_m for w in brief.waypoints], float)
        self.radius_m = np.array([w.radius_m for w in brief.waypoints], float)
        self.programs = [
            FlightProgram(
                flight_model(arena.vehicles[u], speed_share=speed_share),
                space_of(arena, u, margin_m),
                Landing(
                    np.array(uas.home_m, float), brief.landing_distance_m, brief.landing_speed_mps
                ),
                self.waypoints_m,
                self.radius_m,
                _asked(brief),
            )
            for u, uas in enumerate(brief.uas)
        ]

    def leave_room(self) -> None:
        """Plan with part of the limits from now on: what flies is not what is planned with."""
        self._reserve = TRAJECTORY_WITH_ROOM
        self.programs = [
            replace(
                program,
                model=flight_model(self.arena.vehicles[u], _ROOM, self._speed_share),
                reserve=_ROOM / (1.0 - _ROOM),
                allowance=_ALLOWANCE,
            )
            for u, program in enumerate(self.programs)
        ]

    def keep_m(self, i: int, j: int) -> float:
        """The separation of two UAS that the rules ask for."""
        uas = self.brief.uas
        return uas[i].radius_m + uas[j].radius_m + self.brief.uas_safe_distance_m

    def bodies(self, moving: MovingObstacles, uas: int) -> list[Body]:
        """What moves, as a UAS keeps clear of it."""
        return self._met(moving.bodies(self.brief.uas[uas].radius_m, self._moving_margin_m))

    def opens(self, moving: MovingObstacles) -> IntArray:
        """(W,) steps from now at which what moves lets waypoints be covered."""
        radius_m = max(uas.radius_m for uas in self.brief.uas)
        return moving.open_from(self.waypoints_m, self.radius_m, radius_m, self._moving_margin_m)

    def battery_s(self, x: FloatArray) -> FloatArray:
        """(U,) seconds that each battery lasts at full speed, and with the worst vehicle stated."""
        return battery_s(self.brief, self.terrain.legs, x)

    def problem(self, moment: Moment, late_s: float | FloatArray = 0.0) -> RoutingProblem:
        """The routing problem of a moment.

        Args:
            moment: Where everything is.
            late_s: (U,) taken off the budgets: what routes took more than expected.
        """
        forbidden = self.closed_off.copy()
        if moment.forbidden is not None:
            forbidden |= moment.forbidden
        return RoutingProblem.seen(
            self.brief,
            moment,
            self.terrain,
            moment.may_work,
            self._reserve,
            open_waypoints=moment.uncovered,
            release_s=self.brief.dt_s * moment.earliest.astype(float),
            forbidden=forbidden,
            late_s=late_s,
            speed_share=self._speed_share,
        )

    def fresh_packs(
        self, swarm: SwarmState, uncovered: NDArray[np.bool_], planned: Collection[int]
    ) -> FreshPacks | None:
        """What is there for later flights.

        Args:
            swarm: What is seen.
            uncovered: (W,) waypoints to be visited.
            planned: UAS whose flights are planned, along the routes to begin with.
        """

        def problem(x: FloatArray, may_work: NDArray[np.bool_]) -> RoutingProblem:
            now = np.zeros(len(uncovered), np.int64)
            return self.problem(Moment(x, may_work, uncovered, now, swarm.time_s))

        until_s = self.brief.max_steps * self.brief.dt_s - swarm.time_s
        is_planned = np.isin(np.arange(len(swarm.x)), list(planned))
        share = TRAJECTORY_LATER.time_share
        return FreshPacks.seen(self._packs, swarm, until_s, problem, share, is_planned)

    def _met(self, bodies: list[Body]) -> list[Body]:
        """In a plane: the bodies that come into it, which are passed at one side."""
        if (planar := self.brief.planar) is None:
            return bodies
        return [
            body._replace(height_m=TALL_M)
            for body in bodies
            if (np.abs(body.path_m[:, 2] + planar.height_m) < body.height_m).any()
        ]

    def program(
        self,
        uas: int,
        paths_m: Mapping[int, FloatArray],
        moving: Sequence[Body],
        earliest: IntArray | None = None,
    ) -> FlightProgram:
        """The program of a UAS, clear of the paths of others and of what moves."""
        bodies = [
            Body(np.ascontiguousarray(path_m), keep_m, keep_m)
            for other, path_m in paths_m.items()
            if other != uas
            for keep_m in [self.keep_m(uas, other) + self.margin_m]
        ]
        return replace(
            self.programs[uas],
            bodies=(*self._met(bodies), *moving),
            earliest=earliest,
            solved=0,
        )

    def tracking_program(
        self, uas: int, paths_m: Mapping[int, FloatArray], moving: Sequence[Body]
    ) -> FlightProgram:
        """The same for a flight that is made anew in every step, which needs less room."""
        program = self.program(uas, paths_m, moving)
        return replace(
            program,
            model=flight_model(self.arena.vehicles[uas], _TRACKING_ROOM),
            space=program.space._replace(
                keep_m=program.space.keep_m + self.length_scale * _WIDER_M
            ),
            reserve=0.0,
            allowance=_TRACKING_ALLOWANCE,
        )

    def drafts(
        self,
        moment: Moment,
        routes: Mapping[int, IntArray],
        moving: Mapping[int, Sequence[Body]],
        budget: int,
        known: Mapping[tuple[int, bytes], PlannedFlight],
        threads: int = 1,
        *,
        first_steps: float = np.inf,
        bends: bool = False,
    ) -> dict[int, Draft]:
        """A flight of each UAS alone, to be finished by `flights`.

        Args:
            moment: Where everything is.
            routes: Waypoints of each UAS that is to fly.
            moving: What moves, as each sees it.
            budget: Programs to solve for each, about.
            known: Flights by UAS and route that need no search where they still may be flown.
            threads: UAS planned side by side; the flights are the same.
            first_steps: Work on each first flight at most, in steps of flights looked for.
            bends: Whether known flights make way for what moves, rather than being planned anew.
        """

        def begun(u: int) -> Draft:
            return done(
                self.draft(
                    moment, u, routes[u], moving[u], budget, known,
                    first_steps=first_steps, bends=bends,
                )
            )  # fmt: skip

        with ThreadPoolExecutor(threads) as side_by_side:  # the solver frees the GIL
            return dict(zip(routes, side_by_side.map(begun, routes), strict=True))

    def draft(
        self,
        moment: Moment,
        uas: int,
        route: IntArray,
        moving: Sequence[Body],
        budget: int,
        known: Mapping[tuple[int, bytes], PlannedFlight],
        *,
        first_steps: float = np.inf,
        bends: bool = False,
    ) -> Work[Draft]:
        """One of the `drafts`."""
        program = self.program(uas, {}, moving, _earliest(moment))
        same = known.get((uas, route.tobytes()))
        if same is not None and program.allows(route, same):
            return Draft(same, 0)
        start = reduced_state(moment.x[uas])
        if same is not None and bends:
            bent = yield from put_off(program, start, route, same)
            if bent.is_clear:
                return Draft(bent, budget)
        return (yield from draft(program, self.terrain, uas, start, route, budget, first_steps))

    def flights(
        self,
        moment: Moment,
        routes: Mapping[int, IntArray],
        moving: Mapping[int, Sequence[Body]],
        drafts: Mapping[int, Draft],
        threads: int = 1,
    ) -> dict[int, PlannedFlight]:
        """Each UAS's quickest flight, whatever the others fly; arguments as for `drafts`."""

        def alone(u: int) -> PlannedFlight:
            return done(self.flight(moment, u, routes[u], moving[u], drafts[u]))

        with ThreadPoolExecutor(threads) as side_by_side:
            return dict(zip(routes, side_by_side.map(alone, routes), strict=True))

    def flight(
        self, moment: Moment, uas: int, route: IntArray, moving: Sequence[Body], begun: Draft
    ) -> Work[PlannedFlight]:
        """One of the `flights`."""
        program = self.program(uas, {}, moving, _earliest(moment))
        return finished(program, reduced_state(moment.x[uas]), route, begun)

    def apart(
        self,
        moment: Moment,
        routes: Mapping[int, IntArray],
        moving: Mapping[int, Sequence[Body]],
        alone: Mapping[int, PlannedFlight],
    ) -> Work[dict[int, PlannedFlight]]:
        """The flights, of which a shorter one makes way for those that are longer."""
        flights: dict[int, PlannedFlight] = {}
        for u in sorted(alone, key=lambda k: (-alone[k].steps, k)):
            paths_m = {k: flight.path_m for k, flight in flights.items()}
            program = self.program(u, paths_m, moving[u], _earliest(moment))
            start = reduced_state(moment.x[u])
            flights[u] = yield from make_way(program, start, routes[u], alone[u])
        return flights


def _earliest(moment: Moment) -> IntArray | None:
    return moment.earliest if moment.earliest.any() else None


def _asked(brief: MissionBrief) -> Asked | None:
    """What waypoints ask for beside that a UAS comes near; None: nothing."""
    waypoints, anything = brief.waypoints, (-np.inf, np.inf)
    heights_m = np.array([w.heights_m or anything for w in waypoints], float)
    speeds_mps = np.array([w.max_speed_mps or np.inf for w in waypoints], float)
    nothing = np.isinf(heights_m).all() and np.isinf(speeds_mps).all()
    return None if nothing else Asked(heights_m, speeds_mps)


def put_off(
    program: FlightProgram, start: FloatArray, route: IntArray, flight: PlannedFlight
) -> Work[PlannedFlight]:
    """A known flight beside what moves: bent, or after a wait before it; else the last attempt."""
    dt_s, path_m = program.model.dt_s, flight.path_m
    meets = program.first_meeting(path_m)
    soon = max(meets - round(_BEFORE_S / dt_s), 0)
    visited = int(flight.visits[flight.visits <= soon].max(initial=0))
    new = flight
    for wait_s, at in ((0.0, soon), *((wait_s, k) for wait_s in _WAITS_S for k in (soon, visited))):
        steps = round(wait_s / dt_s)
        waiting_m = np.insert(path_m, at, np.repeat(path_m[at : at + 1], steps, axis=0), axis=0)
        visits = np.where(flight.visits > at, flight.visits + steps, flight.visits)
        new = program.solve(start, route, visits, waiting_m)
        yield new.steps
        if new.is_clear:
            break
    return new


def make_way(
    program: FlightProgram, start: FloatArray, route: IntArray, flight: PlannedFlight
) -> Work[PlannedFlight]:
    """The flight clear of all bodies: as it is, bent, or some steps later; else as it is."""
    if program.spare_from_bodies_m(flight.path_m) >= 0.0 or not flight.is_clear:
        return flight
    for later in range(_LATER_STEPS):
        order, lengths = stretches(flight)
        wait_in = [0, *(range(1, len(lengths), 3) if later else ())]
        for stretch in wait_in:
            visits = shifted(flight.visits, order, stretch, later)
            steps = flight.steps + later
            new = retimed(program, start, route, flight, visits, steps, rounds=4)
            yield new.steps
            if new.is_clear:
                return new
    return flight
