"""Prototype: planned flights along tour's routes in the learnt wind."""
from __future__ import annotations
import os
from dataclasses import replace
import numpy as np
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import (
    V_DOWN, DOWN, VELOCITY, V_NORTH, V_EAST, flight_model, in_wind, reduced_state)
from uas_coverage_baselines.trajectory.program import Flight
from uas_coverage_baselines.trajectory.retiming import draft, finished, retimed, shorten
from uas_coverage_baselines.trajectory.tracking import _loose
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.vehicle.governor import design_velocity_loop
from uas_coverage_env.world.state import WIND

KEPT = (0.1, 0.04)
P = dict(margin=0.3, tube_s=3, kept=0.02, budget=60, idle=4, later=(0, 1, 2, 4))

class Lead:
    def __init__(self, **p): self.p = {**P, **p}
    def begin(self, brief, arena):
        self.brief, self.arena = brief, arena
        p = self.p
        k = min(round(p['tube_s'] / brief.dt_s), arena.tube_m.shape[1] - 1)
        self.fleets = [Fleet(brief, p['margin'] + float(arena.tube_m.max(axis=0)[k]))]
        self.flights = {}
        self.failed = {}
        self.loops = [design_velocity_loop(v, brief.dt_s) for v in brief.vehicles]
        self.stats = dict(asked=0, none=0, led=0, tracked=0, planned=0, failed=0, shorter=0)
    def flown(self, i, led):
        self.stats['led'] += led
    def program(self, u, wind, start, fleet):
        program = fleet.program(u, {}, [], None)
        model = flight_model(self.arena.vehicles[u], self.p['kept'])
        air = None
        if np.hypot(*wind) > 1e-9:
            model = in_wind(model, wind, KEPT)
            air = np.append(wind, 0.0)
        return replace(program, model=model, loose=_loose(model, start), wind_mps=air)
    def commands(self, u, x, route, view, belief, swarm, n):
        self.stats['asked'] += 1
        wind = np.zeros(2) if belief is None else belief[WIND:WIND+2].copy()
        if (view.blocked[route]).any() or (belief is not None and swarm.step < 1):
            self.flights.pop(u, None)
            return None
        start = reduced_state(x)
        flight = self._tracked(u, wind, start, route, swarm)
        if flight is None:
            self.flights.pop(u, None)
            self.stats['none'] += 1
            return None
        self.flights[u] = (route.copy(), flight)
        return self._commands(u, wind, flight, n)
    def _tracked(self, u, wind, start, route, swarm):
        known = self.flights.get(u)
        fleet = self.fleets[0]
        program = self.program(u, wind, start, fleet)
        if known is not None:
            old, flight = known
            keep = np.isin(old, route)
            rest = old[keep]
            if len(rest) == len(route) and (rest == route).all() and flight.steps > 1:
                visits = flight.visits[keep] - 1
                need = max(0, 1 - int(visits.min())) if len(visits) else 0
                left = Flight(visits, flight.x[1:], flight.u[1:], flight.costate[1:], flight.violation, flight.missed_m[keep])
                base = replace(left, visits=np.maximum(visits, 1))
                for later in self.p['later']:
                    new = retimed(program, start, route, base, np.maximum(visits + later, np.maximum(visits,1)), left.steps + later)
                    if new.is_clear:
                        self.stats['tracked'] += 1
                        until = program.solved + self.p['idle']
                        s = new.steps
                        if self.p['idle']:
                            new = done(shorten(program, start, route, new, until))
                            self.stats['shorter'] += s - new.steps
                        return new
        # not too often
        key = route.tobytes()
        last = self.failed.get(u)
        if last is not None and last[0] == key and swarm.step < last[1] + 5:
            return None
        program = self.program(u, wind, start, fleet)
        begun = done(draft(program, fleet.terrain, u, start, route, self.p['budget']))
        new = done(finished(program, start, route, begun))
        if new.is_clear:
            self.stats['planned'] += 1
            return new
        self.stats['failed'] += 1
        self.failed[u] = (key, swarm.step)
        return None
    def _commands(self, u, wind, flight, n):
        loop, vehicle = self.loops[u], self.arena.vehicles[u]
        k = loop.gain
        trim = float(vehicle.trim_rad_per_mps)
        wanted = np.empty((n, 3))
        dt = self.brief.dt_s
        for s in range(n):
            if s < flight.steps:
                x, nxt = flight.x[s], flight.x[s + 1]
                for axis in range(2):
                    v, tilt, rate = x[4*axis+1] - wind[axis], x[4*axis+2], x[4*axis+3]
                    r = (flight.u[s, axis] + k[0]*v + k[1]*tilt + k[2]*rate) / (k[0] + k[1]*trim)
                    wanted[s, axis] = r + wind[axis]
                wanted[s, 2] = -(nxt[DOWN] + 0.5 * dt * nxt[V_DOWN])
            else:
                wanted[s] = [0.0, 0.0, -flight.x[-1, DOWN]]
        return wanted
