"""What makes a scenario wrong or doubtful although every single value is allowed."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.scenario.feasibility import back_and_forth
from uas_coverage_env.scenario.fields import Geofence, NoFlyZone, Obstacle, Position_m, Uas
from uas_coverage_env.scenario.planar import off_height
from uas_coverage_env.scenario.unchecked import UncheckedScenario
from uas_coverage_env.vehicle import load_vehicle, vehicle_names


def first_of(found: Sequence[str]) -> str:
    """One line for many problems: the first, and how many more there are."""
    return found[0] + (f" (+{len(found) - 1} more)" if len(found) > 1 else "")


def problems(scenario: UncheckedScenario) -> list[str]:
    """Why this scenario cannot be flown; one line each, empty where it is sound.

    Each line names the field, the value and the fix.
    """
    wrong_vehicles = list(_vehicles(scenario))
    found = [*_names_used_twice(scenario), *wrong_vehicles]
    without_volume = list(_bodies_without_volume(scenario))
    if without_volume:
        # without hulls nothing can be said about places
        return [*found, *without_volume]
    return [
        *found,
        *_planar(scenario),
        *_fence(scenario),
        *_waypoints(scenario),
        *_places_and_fixed_things(scenario),
        *_starts_and_moving_obstacles(scenario),
        *_starts_and_each_other(scenario),
        *(_batteries(scenario) if not (wrong_vehicles and scenario.reserve) else ()),
        *_events(scenario),
        *_relaunch(scenario),
        *_asked_again(scenario),
    ]


def warnings(scenario: UncheckedScenario) -> list[str]:
    """What is allowed but probably not meant; one line each."""
    return [
        *_waypoints_no_uas_covers(scenario),
        *_no_uas_flies_again(scenario),
        *_waypoints_out_of_reach(scenario),
        *_mission_too_long(scenario),
    ]


def _names_used_twice(scenario: UncheckedScenario) -> Iterator[str]:
    for field in ("obstacles", "moving_obstacles", "uas", "decorations"):
        seen: set[str] = set()
        for index, entry in enumerate(getattr(scenario, field)):
            if entry.name in seen:
                yield f"{field}[{index}].name: {entry.name!r} is used twice; give each its own"
            seen.add(entry.name)


def _bodies_without_volume(scenario: UncheckedScenario) -> Iterator[str]:
    bodies: list[tuple[str, Geofence | Obstacle]] = [("geofence", scenario.geofence)]
    bodies += [(f"obstacles[{index}]", body) for index, body in enumerate(scenario.obstacles)]
    for field, body in bodies:
        try:
            _ = body.hull
        except ValueError as error:
            yield f"{field}.vertices_m: {error}"


def _vehicles(scenario: UncheckedScenario) -> Iterator[str]:
    seen = set(vehicle_names())
    for index, uas in enumerate(scenario.uas):
        if uas.vehicle not in seen:
            seen.add(uas.vehicle)
            try:
                load_vehicle(uas.vehicle)
            except ValueError as error:
                yield f"uas[{index}].vehicle: {error}"


def _fence(scenario: UncheckedScenario) -> Iterator[str]:
    fence, margin_m = scenario.fence, scenario.geofence.margin_m
    width_m = float((-fence.face_distances(fence.vertices_m)).max(axis=0).min())
    if width_m <= 2.0 * margin_m:
        yield (
            f"geofence.margin_m: {margin_m:g} leaves no room in a fence that is {width_m:.4g} m "
            f"thin; make the margin smaller or the fence larger"
        )


def _planar(scenario: UncheckedScenario) -> Iterator[str]:
    planar = scenario.planar
    if planar is None:
        return
    if planar.height_m < scenario.min_height_m:
        yield (
            f"planar.height_m: {planar.height_m:g} is below min_height_m "
            f"{scenario.min_height_m:g}; raise it or leave min_height_m out"
        )
    yield from off_height(planar, "uas", "start_m", [uas.start_m for uas in scenario.uas])
    places_m = [waypoint.position_m for waypoint in scenario.waypoints]
    yield from off_height(planar, "waypoints", "position_m", places_m)


def _waypoints(scenario: UncheckedScenario) -> Iterator[str]:
    positions = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    outside_m = scenario.fence.signed_distance(positions)
    for index in np.flatnonzero(outside_m > 0.0):
        yield (
            f"waypoints[{index}].position_m: {_point(positions[index])} lies "
            f"{outside_m[index]:.3g} m outside the geofence; move it inside"
        )
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        if isinstance(obstacle, NoFlyZone):  # what lies in it is dropped
            continue
        distance_m = hull.signed_distance(positions)
        for index in np.flatnonzero(distance_m < 0.0):
            yield (
                f"waypoints[{index}].position_m: {_point(positions[index])} lies "
                f"{-distance_m[index]:.3g} m inside obstacle {obstacle.name!r}; move it out"
            )


def _places_and_fixed_things(scenario: UncheckedScenario) -> Iterator[str]:
    """Of starts, and of landing places that are not starts."""
    for index, uas in enumerate(scenario.uas):
        yield from _place_and_fixed_things(scenario, uas, f"uas[{index}].start_m", uas.start_m)
        if uas.land_m is not None:
            yield from _place_and_fixed_things(scenario, uas, f"uas[{index}].land_m", uas.land_m)


def _place_and_fixed_things(
    scenario: UncheckedScenario, uas: Uas, field: str, place_m: Position_m
) -> Iterator[str]:
    margin_m, does = scenario.geofence.margin_m, "start" if field.endswith("start_m") else "land"
    place = f"{field}: {_point(place_m)}"
    outside_m = float(scenario.fence.signed_distance(place_m))
    if outside_m > 0.0:
        yield f"{place} lies {outside_m:.3g} m outside the geofence; move it inside"
    elif outside_m > -margin_m:
        yield (
            f"{place} is {abs(outside_m):.3g} m from the geofence, within its margin_m "
            f"{margin_m:g}, where no planner can {does}; move it further in"
        )
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        distance_m = float(hull.signed_distance(place_m))
        named = f"obstacle {obstacle.name!r}"
        yield from _too_close(
            place, distance_m, named, uas.radius_m, obstacle.safe_distance_m, does
        )
        over_roof = hull.distance_when_raised(place_m, scenario.min_height_m) < 0.0
        if over_roof and distance_m >= uas.radius_m + obstacle.safe_distance_m:
            yield (
                f"{place} is lower than min_height_m {scenario.min_height_m:g} above the roof "
                f"of {named}, where no planner can {does}; move it higher or away"
            )


def _starts_and_moving_obstacles(scenario: UncheckedScenario) -> Iterator[str]:
    for index, uas in enumerate(scenario.uas):
        start = f"uas[{index}].start_m: {_point(uas.start_m)}"
        for obstacle in scenario.moving_obstacles:
            x, y, z = np.subtract(uas.start_m, obstacle.start_m)
            distance_m = max(math.hypot(x, y) - obstacle.radius_m, abs(z) - 0.5 * obstacle.height_m)
            named = f"moving obstacle {obstacle.name!r} at t = 0"
            yield from _too_close(start, distance_m, named, uas.radius_m, obstacle.safe_distance_m)


def _too_close(
    place: str,
    distance_m: float,
    named: str,
    radius_m: float,
    safe_distance_m: float,
    does: str = "start",
) -> Iterator[str]:
    if distance_m < radius_m:
        at_once = " at once" if does == "start" else ""
        yield (
            f"{place} is {distance_m:.3g} m from {named}, closer than radius_m {radius_m:g}: "
            f"the UAS would be lost{at_once}; move it away"
        )
    elif distance_m < radius_m + safe_distance_m:
        yield (
            f"{place} is {distance_m:.3g} m from {named}, closer than radius_m + safe_distance_m "
            f"= {radius_m + safe_distance_m:g}, where no planner can {does}; move it away"
        )


def _starts_and_each_other(scenario: UncheckedScenario) -> Iterator[str]:
    for (i, one), (j, other) in itertools.combinations(enumerate(scenario.uas), 2):
        x, y, z = np.subtract(one.start_m, other.start_m)
        distance_m = max(math.hypot(x, y), abs(z))
        kept_m = one.radius_m + other.radius_m + scenario.uas_safe_distance_m
        if distance_m < kept_m:
            yield (
                f"uas[{j}].start_m: {_point(other.start_m)} is {distance_m:.3g} m from the start "
                f"of {one.name!r} (uas[{i}]), closer than both radii + uas_safe_distance_m = "
                f"{kept_m:g}; move them apart"
            )


def _batteries(scenario: UncheckedScenario) -> Iterator[str]:
    for index, (uas, landed) in enumerate(zip(scenario.uas, scenario.dod_landed, strict=True)):
        dod = 1.0 - uas.soc_0
        if dod >= uas.dod_max:
            yield (
                f"uas[{index}].soc_0: {uas.soc_0:g} is a depth of discharge of "
                f"{dod:.3g}, not below dod_max {uas.dod_max:g}; charge it"
            )
        elif dod >= landed:
            yield (
                f"uas[{index}].soc_0: {uas.soc_0:g} is no more than the [reserve] leaves on "
                f"landing; charge it or make the reserve smaller"
            )


def _relaunch(scenario: UncheckedScenario) -> Iterator[str]:
    if scenario.relaunch and scenario.from_ground:
        yield (
            "relaunch: true does not go with from_ground: climbs and descents between flights are "
            "not counted; leave one of them out"
        )
    if scenario.relaunch and scenario.sorties and not scenario.sorties.together:
        yield (
            "relaunch: true does not go with sorties.together = false, by which UAS take off again "
            "with fresh packs; leave one of them out"
        )


def _asked_again(scenario: UncheckedScenario) -> Iterator[str]:
    if scenario.sorties and scenario.sorties.together and scenario.asks_again:
        yield (
            "sorties.together: true does not go with waypoints.again_after_s, which counts within "
            "one flight; set it to false"
        )


def _no_uas_flies_again(scenario: UncheckedScenario) -> Iterator[str]:
    if scenario.asks_again and not scenario.relaunch and not scenario.sorties:
        index = next(w for w, waypoint in enumerate(scenario.waypoints) if waypoint.again_after_s)
        yield (
            f"waypoints[{index}].again_after_s: UAS that have landed do not fly again for it; add "
            f"[sorties] with together = false (fresh packs), or relaunch = true"
        )


def _events(scenario: UncheckedScenario) -> Iterator[str]:
    """What an event names and is not there, and what makes the scene wrong that it leaves."""
    for index, event in enumerate(scenario.events):
        field = f"events[{index}]"
        wrong = [f"{field}.{line}" for line in event.mistakes(scenario)]
        yield from wrong
        if wrong or not event.changes_scene:
            continue
        name = getattr(event, "uas", None)
        concerned = [i for i, uas in enumerate(scenario.uas) if name in (None, uas.name)]
        lines: dict[str, None] = {}
        for i in concerned:
            after = scenario.after(event, event.at_s or scenario.dt_s, i)
            lines |= dict.fromkeys(_scene(after))
        yield from (f"{field} ({event.kind}): then {line}" for line in lines)


def _scene(scenario: UncheckedScenario) -> list[str]:
    found = [*_names_used_twice(scenario), *_bodies_without_volume(scenario)]
    return found or [
        *_planar(scenario),
        *_waypoints(scenario),
        *_places_and_fixed_things(scenario),
        *_starts_and_each_other(scenario),
    ]


def _waypoints_no_uas_covers(scenario: UncheckedScenario) -> Iterator[str]:
    """One line for each sensor that is asked for and nowhere carried."""
    uncarried = ~scenario.can_cover.any(axis=0)
    carried = sorted({sensor.name for uas in scenario.uas for sensor in uas.sensors})
    wanted = [waypoint.sensor or "" for waypoint in scenario.waypoints]
    for name in dict.fromkeys(wanted[index] for index in np.flatnonzero(uncarried)):
        indices = [index for index in np.flatnonzero(uncarried) if wanted[index] == name]
        more = f" (+{len(indices) - 1} more)" if len(indices) > 1 else ""
        instead = did_you_mean(name, carried, f"they carry {', '.join(carried) or 'no sensor'}")
        yield (
            f"waypoints[{indices[0]}].sensor{more}: no UAS carries {name!r}, so none covers it; "
            f"add it to uas.sensors ({instead})"
        )


def out_of_reach(scenario: UncheckedScenario, more_m: float) -> list[int]:
    """Waypoints of whose spheres no part keeps all safe distances.

    Args:
        scenario: The scenario.
        more_m: Kept beyond them from obstacles, and horizontally from the fence [m].
    """
    every = range(len(scenario.waypoints))
    return [index for index in every if not _free_part(scenario, index, more_m)[1].any()]


def free_places_m(scenario: UncheckedScenario, index: int) -> NDArray[np.float64]:
    """(P, 3) places spread over a waypoint's sphere that keep all safe distances [m]."""
    points, free = _free_part(scenario, index, 0.0)
    return points[free]


def _free_part(
    scenario: UncheckedScenario, index: int, more_m: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points (P, 3) of a waypoint's sphere, and whether each keeps all safe distances (P,)."""
    radius_m, waypoint = min(uas.radius_m for uas in scenario.uas), scenario.waypoints[index]
    points = np.array(waypoint.position_m) + waypoint.radius_m * _BALL
    if scenario.planar is not None:
        points[:, 2] = waypoint.position_m[2]
    if waypoint.heights_m is not None:
        lowest_m, highest_m = waypoint.heights_m
        points = points[(lowest_m <= -points[:, 2]) & (-points[:, 2] <= highest_m)]
    fence, margin_m = scenario.fence, scenario.geofence.margin_m
    level = np.hypot(fence.normals[:, 0], fence.normals[:, 1])
    inside = fence.face_distances(points) + more_m * level <= -margin_m
    free: NDArray[np.bool_] = np.asarray(inside.all(axis=1))
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        free &= hull.signed_distance(points) >= radius_m + obstacle.safe_distance_m + more_m
    return points, free


def _waypoints_out_of_reach(scenario: UncheckedScenario) -> Iterator[str]:
    for index, waypoint in enumerate(scenario.waypoints):
        points, free = _free_part(scenario, index, 0.0)
        high = _is_high_enough(scenario, points)
        if free.any() and not (free & high).any():
            yield (
                f"waypoints[{index}].position_m: the sphere around {_point(waypoint.position_m)} "
                f"can be covered only from below min_height_m {scenario.min_height_m:g}, so no "
                f"planner will cover it; move it up or enlarge radius_m"
            )
        if not free.any():
            yield (
                f"waypoints[{index}].position_m: no part of the sphere around "
                f"{_point(waypoint.position_m)} keeps all safe distances, so no planner will "
                f"cover it; move it or enlarge radius_m"
            )


def _is_high_enough(
    scenario: UncheckedScenario, points_m: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """(P,) Whether the least height allows points (P, 3) to some UAS."""
    high = -points_m[:, 2] >= scenario.min_height_m
    for hull in scenario.hulls:
        high &= hull.distance_when_raised(points_m, scenario.min_height_m) >= 0.0
    for uas in scenario.uas:
        for place_m in (uas.start_m, uas.home_m):
            away_m = np.hypot(*(points_m[:, :2] - place_m[:2]).T)
            high |= away_m <= scenario.landing_zone_m
    return high


def _mission_too_long(scenario: UncheckedScenario) -> Iterator[str]:
    plan = back_and_forth(scenario)
    packs = scenario.sorties.packs if scenario.sorties else 1
    if not plan.complete and (packs == 1 or plan.flight_s.sum() > packs * plan.air_time_s.sum()):
        yield (
            f"uas: the batteries will hardly finish this mission: flown back and forth it takes "
            f"about {plan.flight_s.sum():.0f} s in the air, and they hold "
            f"{plan.air_time_s.sum():.0f} s ({_each(scenario, plan.air_time_s)}); add UAS, "
            f"charge them or take waypoints away"
        )
    if plan.makespan_s > scenario.max_steps * scenario.dt_s:
        yield (
            f"max_steps: {scenario.max_steps} steps of {scenario.dt_s:g} s end before a plan "
            f"that flies back and forth, in about {plan.makespan_s:.0f} s; raise it"
        )


def _each(scenario: UncheckedScenario, seconds: NDArray[np.float64]) -> str:
    named = zip(scenario.uas[:4], seconds, strict=False)
    more = ", …" if len(seconds) > 4 else ""
    return ", ".join(f"{uas.name} {time_s:.0f} s" for uas, time_s in named) + more


def _point(position_m: Iterable[float]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in position_m) + ")"


def _ball() -> NDArray[np.float64]:
    """Points spread over the unit ball: its centre and three shells of 100."""
    rank = np.arange(0.5, 100.0)
    z = 1.0 - rank / 50.0
    turn = math.pi * (1.0 + math.sqrt(5.0)) * rank
    ring = np.sqrt(1.0 - z**2)
    shell = np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])
    return np.vstack([np.zeros((1, 3)), 0.4 * shell, 0.7 * shell, shell]).astype(np.float64)


_BALL = _ball()
