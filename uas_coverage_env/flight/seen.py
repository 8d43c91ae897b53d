"""What the cameras of a flight have seen of the ground: their pictures, laid on a grid of cells.

A camera takes a picture at each sample, where the UAS flies at a tilt that the camera allows, and
at a height and a speed that some waypoint asks for of it, if any does. The ground is flat, z = 0,
but for obstacles of kind `terrain`, whose tops are the ground; what is hidden is not considered.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, FlightRecord
from uas_coverage_env.scenario import Scenario, Sensor
from uas_coverage_env.vehicle import PHI, PSI, THETA, VX, VZ, WX, Z

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

SEARCH_AREA = "search_area"
"""The kind of the decorations that are the ground to be seen, as `import` writes them; with `_` and
the name of a sensor, by that one."""

TERRAIN = "terrain"
"""The kind of the obstacles that are ground, as `import` writes them: upright boxes."""

_CELLS = 250_000
_FINEST_M = 0.5
_LEVEL = 0.1  # a ray that leads down by less of its length shows nothing of use


@dataclass(frozen=True)
class SeenGround:
    """The ground that was to be seen by a sensor, and what of it was.

    Attributes:
        sensor: Its name; of all UAS that carry it.
        north_m: (N,) of the middles of the cells, which cover the geofence [m].
        east_m: (E,) likewise [m].
        asked: (N, E) the cells to be seen: those of the decorations of kind `search_area`, or where
            there are none, under the spheres of the waypoints that ask for the sensor, or where
            none does, of all.
        seen: (N, E) the cells that were in a picture, those that were to be seen or not.
    """

    sensor: str
    north_m: FloatArray
    east_m: FloatArray
    asked: BoolArray
    seen: BoolArray

    @property
    def share(self) -> float:
        """Of the ground to be seen, how much was, 0..1."""
        return float(self.seen[self.asked].mean()) if self.asked.any() else 1.0


def seen_ground(flight: FlightRecord, until: int | None = None) -> tuple[SeenGround, ...]:
    """What each kind of camera has seen; empty where no UAS carries one.

    Args:
        flight: The flight.
        until: The last sample that counts; None: that of the flight.
    """
    samples = slice(None if until is None else until + 1)
    x, flies = flight.x[samples].copy(), flight.mode[samples] < LANDED
    x[..., PHI:WX] = flight.attitude_rad[samples]
    carried: dict[str, list[tuple[int, Sensor]]] = {}
    for i, uas in enumerate(flight.scenario.uas):
        for sensor in uas.sensors:
            if sensor.field_of_view_deg is not None:
                carried.setdefault(sensor.name, []).append((i, sensor))
    return tuple(
        _seen_by(flight.scenario, name, cameras, x, flies) for name, cameras in carried.items()
    )


def seen_shares(flight: FlightRecord) -> dict[str, float]:
    """Sensor -> share of the ground that it has seen; empty where no UAS carries a camera."""
    return {ground.sensor: ground.share for ground in seen_ground(flight)}


def footprints_m(sensor: Sensor, x: FloatArray) -> FloatArray:
    """The corners of the pictures of a camera on the ground.

    Args:
        sensor: With a field of view.
        x: (T, 14) states, their angles those of the body (`FlightRecord.attitude_rad`).

    Returns:
        (T, 4, 2) north and east [m], in order round the picture; NaN where a ray does not meet the
        ground, or the tilt is more than the camera allows.
    """
    assert sensor.field_of_view_deg is not None
    aside, ahead = (math.tan(0.5 * math.radians(angle)) for angle in sensor.field_of_view_deg)
    corners = np.array([[ahead, aside], [ahead, -aside], [-ahead, -aside], [-ahead, aside]])
    rays = np.concatenate([corners, np.ones((4, 1))], axis=1)  # forward, right, down
    kept = 0.0 if sensor.stabilised else 1.0
    rays = _turned(rays, kept * x[:, PHI], kept * x[:, THETA], x[:, PSI])
    meets = rays[..., 2] > _LEVEL * np.linalg.norm(rays, axis=-1)
    meets &= (x[:, Z] < 0.0)[:, None]
    if sensor.max_tilt_deg is not None:
        tilt = np.arccos(np.clip(np.cos(x[:, PHI]) * np.cos(x[:, THETA]), -1.0, 1.0))
        meets &= (tilt <= math.radians(sensor.max_tilt_deg))[:, None]
    way = -x[:, None, Z] / np.where(meets, rays[..., 2], np.nan)
    places_m = x[:, None, :2] + way[..., None] * rays[..., :2]
    places_m[~meets.all(axis=1)] = np.nan
    return places_m


def _turned(rays: FloatArray, phi: FloatArray, theta: FloatArray, psi: FloatArray) -> FloatArray:
    """(T, R, 3) rays (R, 3) of body axes in NED: roll, then pitch, then yaw."""
    forward, right, down = rays.T[:, None]
    phi, theta, psi = phi[:, None], theta[:, None], psi[:, None]
    right, down = (
        right * np.cos(phi) - down * np.sin(phi),
        right * np.sin(phi) + down * np.cos(phi),
    )
    forward, down = (
        forward * np.cos(theta) + down * np.sin(theta),
        down * np.cos(theta) - forward * np.sin(theta),
    )
    north = forward * np.cos(psi) - right * np.sin(psi)
    east = forward * np.sin(psi) + right * np.cos(psi)
    return np.stack(np.broadcast_arrays(north, east, down), axis=-1)


def _seen_by(
    scenario: Scenario,
    name: str,
    cameras: list[tuple[int, Sensor]],
    x: FloatArray,
    flies: BoolArray,
) -> SeenGround:
    north_m, east_m, asked = _ground(scenario, name)
    tops_m = _tops_m(scenario, north_m, east_m)
    seen = np.zeros_like(asked)
    for i, sensor in cameras:
        looking = x[flies[:, i] & _as_asked(scenario, name, x[:, i]), i]
        for place_m, picture in zip(looking[:, :3], footprints_m(sensor, looking), strict=True):
            if np.isfinite(picture).all():
                rows, columns = _window(north_m, picture[:, 0]), _window(east_m, picture[:, 1])
                north, east, tops = north_m[rows], east_m[columns], tops_m[rows, columns]
                for top_m in np.unique(tops):
                    lifted = _lifted(picture, place_m, top_m)
                    seen[rows, columns] |= (tops == top_m) & _inside(lifted, north, east)
    return SeenGround(name, north_m, east_m, asked, seen)


def _tops_m(scenario: Scenario, north_m: FloatArray, east_m: FloatArray) -> FloatArray:
    """(N, E) how high the ground is, by the terrain that is an obstacle [m]."""
    tops_m = np.zeros((len(north_m), len(east_m)))
    for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True):
        if obstacle.kind == TERRAIN:
            corners = hull.vertices_m
            rows, columns = _window(north_m, corners[:, 0]), _window(east_m, corners[:, 1])
            part = tops_m[rows, columns]
            np.maximum(part, -corners[:, 2].min(), out=part)
    return tops_m


def _lifted(picture: FloatArray, place_m: FloatArray, top_m: float) -> FloatArray:
    """(4, 2) the corners of a picture on ground that is so high; one point where it is higher."""
    if top_m == 0.0:
        return picture
    share = max(1.0 - top_m / -float(place_m[2]), 0.0)
    return place_m[:2] + share * (picture - place_m[:2])


def _as_asked(scenario: Scenario, name: str, x: FloatArray) -> BoolArray:
    """(T,) whether a waypoint that asks for a sensor asks for this height and speed, or none."""
    demands = {(w.heights_m, w.max_speed_mps) for w in scenario.waypoints if w.sensor == name}
    if not demands:
        return np.ones(len(x), np.bool_)
    height_m, speed_mps = -x[:, Z], np.linalg.norm(x[:, VX : VZ + 1], axis=1)
    fits = np.zeros(len(x), np.bool_)
    for heights_m, max_speed_mps in demands:
        lowest_m, highest_m = heights_m or (-math.inf, math.inf)
        slow = speed_mps <= (math.inf if max_speed_mps is None else max_speed_mps)
        fits |= (lowest_m <= height_m) & (height_m <= highest_m) & slow
    return fits


def _ground(scenario: Scenario, name: str) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Middles of cells to the north and east, and which of them are to be seen."""
    corners_m = scenario.fence.vertices_m[:, :2]
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    cell_m = max(math.sqrt(float(np.prod(high - low)) / _CELLS), _FINEST_M)
    north_m, east_m = (np.arange(low[k] + 0.5 * cell_m, high[k], cell_m) for k in range(2))
    asked = np.zeros((len(north_m), len(east_m)), np.bool_)
    kinds = (SEARCH_AREA, f"{SEARCH_AREA}_{name}")
    areas = [np.array(d.polygon_m) for d in scenario.decorations if d.kind in kinds]
    for area in areas:
        asked |= _inside(area, north_m, east_m)
    asking = [w for w in scenario.waypoints if w.sensor == name] or scenario.waypoints
    for waypoint in () if areas else asking:
        (north, east, _), radius = waypoint.position_m, waypoint.radius_m
        rows = _window(north_m, np.array([north - radius, north + radius]))
        columns = _window(east_m, np.array([east - radius, east + radius]))
        away_m = np.hypot(north_m[rows, None] - north, east_m[None, columns] - east)
        asked[rows, columns] |= away_m <= radius
    return north_m, east_m, asked


def _window(middles_m: FloatArray, places_m: FloatArray) -> slice:
    """The cells between the least and the largest of some places."""
    first, last = np.searchsorted(middles_m, (places_m.min(), places_m.max()))
    return slice(int(first), int(last))


def _inside(polygon_m: FloatArray, north_m: FloatArray, east_m: FloatArray) -> BoolArray:
    """(N, E) whether places of a grid lie in a polygon (V, 2): even-odd rule."""
    inside = np.zeros((len(north_m), len(east_m)), np.bool_)
    for (n0, e0), (n1, e1) in zip(polygon_m, np.roll(polygon_m, -1, axis=0), strict=True):
        if e0 == e1:
            continue
        beside = (e0 <= east_m) != (e1 <= east_m)
        crossing_m = n0 + (east_m[beside] - e0) / (e1 - e0) * (n1 - n0)
        inside[:, beside] ^= north_m[:, None] < crossing_m
    return inside
