"""Prototype: planned flights along tour's routes in the learnt wind."""
from __future__ import annotations
import os
from dataclasses import replace
import numpy as np
from uas_coverage_baselines.trajectory.fleet import Fleet
from uas_coverage_baselines.trajectory.flight_model import (
    V_DOWN, DOWN, VELOCITY, V_NORTH, V_EAST, flight_model, in_wind, reduced_state)
from uas_coverage_baselines.trajectory.program import Flight, Landing
from uas_coverage_baselines.trajectory.retiming import draft, finished, retimed, shorten
from uas_coverage_baselines.trajectory.tracking import _loose
from uas_coverage_baselines.trajectory.work import done
from uas_coverage_env.vehicle.governor import design_velocity_loop
from uas_coverage_env.autopilot.belief import wind_growth
from uas_coverage_env.world.state import WIND

KEPT = (0.1, 0.04)
P = dict(margin=0.3, tube_s=3, kept=0.02, budget=80, idle=4, later=(0, 1, 2), ahead=6, least=4, redraft=True, inset=1.5, per_step=0.3, blend=0.7)

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
    def program(self, u, wind, start, ahead, end, visits=None):
        """Of the next waypoints; the flight ends at the one after them, or landed."""
        fleet = self.fleets[0]
        program = fleet.program(u, {}, [], None)
        model = flight_model(self.arena.vehicles[u], self.p['kept'])
        air = None
        if np.hypot(*wind) > 1e-9:
            model = in_wind(model, wind, KEPT)
            air = np.append(wind, 0.0)
        inset = np.minimum(self.p['inset'], 0.15 * fleet.radius_m)
        if visits is not None and len(ahead):
            inset[ahead] = np.minimum(inset[ahead], 0.1 + self.p['per_step'] * (visits - 1))
        radius_m = fleet.radius_m - inset
        if end >= 0:
            landing = Landing(fleet.waypoints_m[end], radius_m[end], 20.0)
            program = replace(program, landing=landing)
        return replace(program, model=model, loose=_loose(model, start), wind_mps=air, radius_m=radius_m)
    def commands(self, u, x, route, view, belief, swarm, n):
        self.stats['asked'] += 1
        wind = np.zeros(2) if belief is None else belief[WIND:WIND+2].copy()
        own = wind
        if belief is not None and self.p['blend']:
            grown = wind_growth(-float(x[2]), 20.0)
            wind = (1-self.p['blend'])*wind + self.p['blend']*grown*view.wind_mps
        if (view.blocked[route]).any() or (belief is not None and swarm.step < 1):
            self.flights.pop(u, None)
            return None
        start = reduced_state(x)
        flight = self._found(u, wind, start, route, swarm)
        if flight is None:
            self.flights.pop(u, None)
            self.stats['none'] += 1
            return None
        return self._commands(u, own, flight, n)
    def _found(self, u, wind, start, route, swarm):
        known = self.flights.get(u)
        M = self.p['ahead']
        ahead, end = route[:M], (route[M] if len(route) > M else -1)
        if known is not None:
            old, old_end, flight = known
            keep = np.isin(old, route)
            rest = old[keep]
            n = len(rest)
            fits = n and (rest == route[:n]).all() and (old_end == (route[n] if len(route) > n else -1)) or (n == 0 and len(route) == 0 and old_end == -1)
            grow = n < len(ahead) and (self.p['redraft'] or n < self.p['least'])
            if fits and flight.steps > 1:
                visits = flight.visits[keep] - 1
                program = self.program(u, wind, start, rest, old_end, np.maximum(visits, 1))
                left = Flight(np.maximum(visits, 1), flight.x[1:], flight.u[1:], flight.costate[1:], flight.violation, flight.missed_m[keep])
                new = None
                for later in self.p['later']:
                    new = retimed(program, start, rest, left, np.maximum(visits + later, 1), left.steps + later)
                    if new.is_clear:
                        break
                if new is not None and new.is_clear and not grow:
                    self.stats['tracked'] += 1
                    s = new.steps
                    if self.p['idle']:
                        new = done(shorten(program, start, rest, new, program.solved + self.p['idle']))
                        self.stats['shorter'] += s - new.steps
                    self.flights[u] = (rest, old_end, new)
                    return new
        key = route.tobytes()
        last = self.failed.get(u)
        if last is not None and last[0] == key and swarm.step < last[1] + 3:
            return None
        program = self.program(u, wind, start, ahead, end)
        begun = done(draft(program, self.fleets[0].terrain, u, start, ahead, self.p['budget']))
        new = done(finished(program, start, ahead, begun))
        self.stats['programs'] = self.stats.get('programs', 0) + program.solved
        if new.is_clear:
            self.stats['planned'] += 1
            self.flights[u] = (ahead.copy(), end, new)
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
