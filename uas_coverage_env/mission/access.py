"""Which waypoints have a way to them past the fixed obstacles, and what closes off the others."""

from __future__ import annotations

from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.scenario import NoFlyZone
from uas_coverage_env.scenario.checks import free_places_m
from uas_coverage_env.world import Arena, build_arena
from uas_coverage_env.world.corners import route_corners
from uas_coverage_env.world.routes import NO_WAY, crossing, route

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_TRIED = 8
"""Obstacles, the nearest to a waypoint, of which each is taken away to see whether it opens."""
_NAMED = 3


class Gap(NamedTuple):
    """A door or gap between two obstacles that is too narrow for routes.

    Attributes:
        between: Their names.
        width_m: Of the gap [m].
        needed_m: What routes need: what they keep on either side [m].
    """

    between: tuple[str, str]
    width_m: float
    needed_m: float


class Access:
    """Which waypoints a UAS can fly to from its start, along the routes of the world.

    A waypoint is closed off where no place in its sphere that keeps all safe distances has a way
    home, neither round what stands in between nor over it below the ceiling. Routes keep more than
    the safe distances (`route_margin_m`): a planner may find a way through a gap that is closed to
    them.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief, self._obstacles = brief, brief.obstacles

    @cached_property
    def has_way(self) -> BoolArray:
        """(U, W) whether each UAS has a way to each waypoint."""
        arena = build_arena(self._brief.as_scenario())
        places_m = np.array([w.position_m for w in self._brief.waypoints], float)
        return np.array([self._leads_home(arena, u, places_m) for u in range(len(arena.uas))])

    def why_closed(self, uas: int, waypoint: int) -> str:
        """What closes off a waypoint from a UAS, in a few words."""
        kinds = {o.name: o.kind == "no_fly" or isinstance(o, NoFlyZone) for o in self._obstacles}
        names = [f"{'no-fly zone ' * kinds[n]}{n}" for n in self.closed_by(uas, waypoint)]
        more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
        how = "closed off by" if len(names) == 1 else "closed off, behind"
        return f"{how} {', '.join(names[:_NAMED])}{more}"

    def closed_by(self, uas: int, waypoint: int) -> tuple[str, ...]:
        """Names of the obstacles that close off a waypoint from a UAS.

        The one without which there would be a way; where it takes more than one, all that are met
        on the straight way home.
        """
        place_m = np.array(self._brief.waypoints[waypoint].position_m, float)
        met = self._met(place_m, np.array(self._brief.uas[uas].home_m, float))
        for o in met[:_TRIED]:
            if self._opens(o, uas, waypoint):
                return (self._obstacles[o].name,)
        return tuple(self._obstacles[o].name for o in met)

    @cached_property
    def narrow_gaps(self) -> tuple[Gap, ...]:
        """Doors and gaps that a UAS fits through, but its routes do not; the narrowest first."""
        arena = build_arena(self._brief.as_scenario())
        reaches_up = arena.obstacles["roof_m"] > arena.rules["ceiling_m"][0]
        tall = np.flatnonzero(arena.obstacles["tall"] & reaches_up)
        kept_m, least_m = arena.obstacles["wall_m"], 2.0 * float(arena.uas["radius_m"].max())
        found = []
        for a, b in combinations(tall.tolist(), 2):
            needed_m, width_m = float(kept_m[a] + kept_m[b]), self._apart_m(a, b)
            if least_m < width_m < needed_m:
                names = self._obstacles[a].name, self._obstacles[b].name
                found.append(Gap(names, width_m, needed_m))
        return tuple(sorted(found, key=lambda gap: gap.width_m))

    def _apart_m(self, a: int, b: int) -> float:
        """How far two obstacles are apart, by the face of either that separates them the most."""
        one, other = self._brief.hulls[a], self._brief.hulls[b]
        return max(
            float(one.face_distances(other.vertices_m).min(axis=0).max()),
            float(other.face_distances(one.vertices_m).min(axis=0).max()),
        )

    def _leads_home(self, arena: Arena, uas: int, places_m: FloatArray) -> BoolArray:
        """(W,) whether there is a way to waypoints at these places, or to their spheres."""
        home_m = np.array(self._brief.uas[uas].home_m, float)
        row = len(self._brief.waypoints) + uas
        found = _are_open(arena, row, places_m, home_m)
        if found.all():
            return found
        over = self._over_what_can_be(arena)
        found |= _are_open(over, row, places_m, home_m)
        scenario = self._brief.as_scenario()
        for w in np.flatnonzero(~found):
            inside_m = free_places_m(scenario, int(w))
            found[w] = _are_open(over, row, inside_m, home_m).any()
        return found

    def _over_what_can_be(self, arena: Arena) -> Arena:
        """The arena in which only what reaches up to the ceiling is passed on the side."""
        obstacles = arena.obstacles.copy()
        obstacles["tall"] &= obstacles["roof_m"] > arena.rules["ceiling_m"][0]
        targets_m = np.concatenate([arena.waypoints["position_m"], arena.uas["home_m"]])
        nodes_m, distance_m = route_corners(
            self._brief.as_scenario(), obstacles, arena.normals, arena.offsets_m, targets_m
        )
        return arena._replace(obstacles=obstacles, nodes_m=nodes_m, node_distance_m=distance_m)

    def _met(self, place_m: FloatArray, home_m: FloatArray) -> list[int]:
        """Obstacles on the straight way home that reach up to the ceiling, in their order."""
        arena = build_arena(self._brief.as_scenario())
        at = []
        for o, obstacle in enumerate(arena.obstacles):
            if obstacle["tall"] and obstacle["roof_m"] > arena.rules["ceiling_m"][0]:
                share, _, _ = crossing(
                    obstacle, arena.normals, arena.offsets_m, *place_m[:2], *home_m[:2]
                )
                at += [(float(share), o)] if share <= 1.0 else []
        return [o for _, o in sorted(at)]

    def _opens(self, obstacle: int, uas: int, waypoint: int) -> bool:
        """Whether a waypoint has a way where one obstacle is taken away."""
        rest = tuple(o for k, o in enumerate(self._obstacles) if k != obstacle)
        without = Access(self._brief.model_copy(update={"obstacles": rest}))
        return bool(without.has_way[uas, waypoint])


def _are_open(arena: Arena, row: int, places_m: FloatArray, home_m: FloatArray) -> BoolArray:
    """(P,) whether places have a way to a target of the arena's routes."""
    return _kinds(arena, row, np.ascontiguousarray(places_m), home_m) != NO_WAY


@allocating_kernel
def _kinds(arena, row, places_m, home_m):
    """The kind of leg (P,) with which the way home begins."""
    kinds = np.empty(len(places_m), np.int64)
    for p in range(len(places_m)):
        x0, y0, z0 = places_m[p, 0], places_m[p, 1], places_m[p, 2]
        _, _, _, kind = route(arena, row, x0, y0, z0, home_m[0], home_m[1], home_m[2])
        kinds[p] = kind
    return kinds
