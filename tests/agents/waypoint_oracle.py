"""What a UAS that chooses a waypoint is told, once more: by name, in plain NumPy, number by number.

Of the compiled code it takes the routes of the world and the leg times (`Legs`), nothing else.
Scales stand here a second time: they are part of what a trained policy has learned.
"""

import math

import numpy as np
from uas_coverage_agents.waypoint.layout import CRUISE_SHARE, K

from uas_coverage_env.autopilot.guidance import path_length_home_m
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.vehicle.layout import DOD, VX, VY, X, Y, Z
from uas_coverage_env.world.routes import route

CLOCK_RESERVE_S, LANDING_S, LEAD_S, TURN_MPS2 = 18.0, 6.0, 1.6, 3.0


class Mission:
    """A mission at one moment, and what follows from it."""

    def __init__(self, arena, legs, state, blocked, targets):
        self.arena, self.legs, self.state, self.blocked = arena, legs, state, blocked
        self.targets = targets
        self.open = np.flatnonzero(state.uncovered)
        self.unit_m, self.unit_s = legs.unit
        self.places_m = arena.waypoints["position_m"]
        self.flying = [j for j in range(len(targets)) if state.uas[j].status == FLYING]
        self.covering = [
            j for j in self.flying if not state.uas[j].returning and targets[j] != HOME
        ]

    def leg_s(self, i, way_m, rise_m, w):
        uas = self.arena.uas[i]
        level_s = way_m / (CRUISE_SHARE * uas.speed_mps)
        missing_m = abs(rise_m) - 0.6 * self.arena.waypoints[w].radius_m
        rate_mps = uas.climb_mps if rise_m > 0 else uas.descent_mps
        return max(level_s, missing_m / rate_mps + LEAD_S) if missing_m > 0 else level_s

    def way(self, i, w):
        """(length [m], direction of the first leg) of the route of UAS i to waypoint w."""
        x, to_m = self.state.x[i], self.places_m[w]
        end_x, end_y, length_m, _ = route(self.arena, w, x[X], x[Y], x[Z], *to_m)
        return length_m, np.array([end_x - x[X], end_y - x[Y]])

    def home_s(self, i):
        uas, x = self.arena.uas[i], self.state.x[i]
        level_s = path_length_home_m(self.arena, i, x) / (CRUISE_SHARE * uas.speed_mps)
        above_m = max(uas.home_m[2] - x[Z], 0.0)
        return max(level_s, above_m / uas.descent_mps - LEAD_S) + LANDING_S

    def clock_s(self):
        rules = self.arena.rules[0]
        return (rules.max_steps - self.state.step[0]) * rules.dt_s

    def budget_s(self, i):
        uas = self.arena.uas[i]
        battery_s = (uas.dod_max - self.state.x[i, DOD]) / uas.dod_per_s
        return min(battery_s, self.clock_s() - CLOCK_RESERVE_S)

    def claimed(self, i):
        mates = [j for j in self.covering if j != i]
        return {self.targets[j] for j in mates if self.targets[j] in self.open}

    def candidates(self, i):
        """The nearest waypoints that may be chosen."""
        claimed = self.claimed(i)
        may = [w for w in self.open if not self.blocked[w] and w not in claimed]
        may = may or [w for w in self.open if not self.blocked[w]] or list(self.open)
        return sorted(may, key=lambda w: self.way(i, w)[0])[:K]

    def free_at(self, j):
        """(when [s], to each waypoint from there [s], home from there [s]) of a covering UAS."""
        w, x = self.targets[j], self.state.x[j]
        if w in self.open:
            length_m, _ = self.way(j, w)
            ready_s = self.leg_s(j, length_m, x[Z] - self.places_m[w][2], w)
            return ready_s, self.legs.between_s[w], self.legs.home_s[j, w]
        to_s = np.full(len(self.places_m), math.nan)
        for w in self.open:
            ahead_m = self.places_m[w] - x[:3]
            to_s[w] = self.leg_s(j, math.hypot(ahead_m[0], ahead_m[1]), -ahead_m[2], w)
        return 0.0, to_s, self.home_s(j)

    def greedy_rollout(self, free, done_s, todo):
        """(sum, longest [s], left) where all go on to what is nearest as long as they may."""
        free, done_s, todo = dict(free), list(done_s), list(todo)
        while todo and free:
            j = min(free, key=lambda k: free[k][0])
            ready_s, to_s, home_s = free[j]
            w = min(todo, key=lambda w: to_s[w])
            if ready_s + to_s[w] + self.legs.return_s[j, w] > self.budget_s(j):
                done_s.append(ready_s + home_s)
                del free[j]
            else:
                # of equally near ones the first counts, and the last moves up to where one is taken
                todo[todo.index(w)] = todo[-1]
                todo.pop()
                free[j] = (ready_s + to_s[w], self.legs.between_s[w], self.legs.home_s[j, w])
        done_s += [ready_s + home_s for ready_s, _, home_s in free.values()]
        return np.array([sum(done_s), max(done_s, default=0.0), len(todo)])


def observation(arena, legs, state, blocked, targets, i):
    """(numbers of the team by name, of each candidate by name), not clipped."""
    mission = Mission(arena, legs, state, blocked, targets)
    unit_m, unit_s = mission.unit_m, mission.unit_s
    x, uas = state.x[i], arena.uas[i]
    speed_mps = math.hypot(x[VX], x[VY])
    claimed, open_ = mission.claimed(i), mission.open
    centre_m = mission.places_m[open_, :2].mean(axis=0)
    mates = [j for j in mission.covering if j != i]
    away = [j for j in mission.flying if j != i and j not in mates]
    free = {j: mission.free_at(j) for j in mates}
    done_s = [mission.home_s(j) for j in away]
    todo = [w for w in open_ if w not in claimed]

    rows, futures = [], []
    for w in mission.candidates(i):
        way_m, towards = mission.way(i, w)
        flying_s = mission.leg_s(i, way_m, x[Z] - mission.places_m[w][2], w)
        cruise_mps = unit_m / unit_s
        change_mps = x[[VX, VY]] - cruise_mps * towards / np.linalg.norm(towards)
        turning_s = change_mps @ change_mps / (2 * TURN_MPS2 * cruise_mps)
        arrives_s = flying_s + turning_s
        around_s = np.sort([legs.between_s[w, v] for v in open_ if v != w])
        first_mate_s = min([ready_s + to_s[w] for ready_s, to_s, _ in free.values()], default=1e6)
        own = (arrives_s, legs.between_s[w], legs.home_s[i, w])
        futures.append(
            mission.greedy_rollout({**free, i: own}, done_s, [v for v in todo if v != w])
        )
        rows.append(
            {
                "there": 1.0,
                "way": way_m / (2 * unit_m),
                "time": arrives_s / (2 * unit_s),
                "turn": turning_s / unit_s,
                "home": legs.home_s[i, w] / (20 * unit_s),
                "margin": (mission.budget_s(i) - flying_s - legs.return_s[i, w]) / 300,
                "blocked": float(blocked[w]),
                "claimed": float(w in claimed),
                "next": around_s[0] / unit_s if len(around_s) > 0 else math.inf,
                "after_next": around_s[1] / unit_s if len(around_s) > 1 else math.inf,
                "near": (around_s < 1.6 * unit_s).sum() / 6,
                "around": (around_s < 3 * unit_s).sum() / 15,
                "remote": (around_s.mean() if len(around_s) else 0.0) / (5 * unit_s),
                "lead": (first_mate_s - arrives_s) / (3 * unit_s),
                "outside": np.linalg.norm(mission.places_m[w][:2] - centre_m) / (5 * unit_m),
                "ahead": x[[VX, VY]] @ towards / max(speed_mps * np.linalg.norm(towards), 1e-6),
            }
        )
    go_home = mission.greedy_rollout(free, [*done_s, mission.home_s(i)], todo)
    costs_s = [total_s + longest_s + 120 * left for total_s, longest_s, left in futures]
    best = int(np.argmin(costs_s))
    for k, (row, future) in enumerate(zip(rows, futures, strict=True)):
        total_s, longest_s, left = future - futures[best]
        row["total"], row["longest"] = total_s / (2 * unit_s), longest_s / (2 * unit_s)
        row["left"], row["first"] = left / 5, float(k == best)

    total_s, longest_s, left = futures[best]
    away_m = [math.dist(state.x[j, :2], x[:2]) for j in mates]
    spare_s = [mission.budget_s(j) - mission.home_s(j) for j in mates]
    team = {
        "speed": speed_mps / uas.speed_mps,
        "way_home": mission.home_s(i) / (20 * unit_s),
        "margin": (mission.budget_s(i) - mission.home_s(i)) / 300,
        "time_left": mission.clock_s() / 500,
        "open": len(open_) / 25,
        "share": len(open_) / (len(mates) + 1) / 15,
        "mates": len(mates) / 4,
        "alone": float(not mates),
        "away": len(away) / 4,
        "blocked": blocked[open_].mean(),
        "mates_margin": min([600.0, *spare_s]) / 300,
        "nearest_mate": min(away_m, default=math.inf) / (5 * unit_m),
        "total": total_s / 600,
        "longest": longest_s / 300,
        "left": left / 5,
        "home_total": (go_home[0] - total_s) / (5 * unit_s),
        "home_longest": (go_home[1] - longest_s) / (5 * unit_s),
        "home_left": (go_home[2] - left) / 5,
        "spread": np.linalg.norm(mission.places_m[open_, :2] - centre_m, axis=1).mean()
        / (3 * unit_m),
        "centre": math.dist(x[:2], centre_m) / (5 * unit_m),
    }
    return team, rows
