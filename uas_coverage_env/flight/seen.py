"""What the cameras of a flight have seen of the ground: their pictures, laid on a grid of cells.

A camera takes a picture at each sample, where the UAS flies at a tilt that the camera allows, and
at a height and a speed that some waypoint asks for of it, if any does. The ground is flat, z = 0,
but for obstacles of kind `terrain`, whose tops are the ground; what is hidden is not considered.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, FlightRecord
from uas_coverage_env.scenario import Scenario, Sensor
from uas_coverage_env.vehicle import layout as S

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


@dataclass(frozen=True)
class SeenPictures:
    """The pictures of a kind of camera that showed ground which was in none before.

    Attributes:
        sensor: Its name; of all UAS that carry it.
        sample: (P,) when they were taken, in order of time.
        corners_m: (P, 4, 2) north and east of their corners at z = 0, in order round the
            picture [m]; where terrain is higher, less of it is seen.
        share: (T,) of the ground to be seen, how much was until each sample, 0..1.
    """

    sensor: str
    sample: NDArray[np.intp]
    corners_m: FloatArray
    share: FloatArray


def seen_ground(flight: FlightRecord, until: int | None = None) -> tuple[SeenGround, ...]:
    """What each kind of camera has seen; empty where no UAS carries one.

    Args:
        flight: The flight.
        until: The last sample that counts; None: that of the flight.
    """
    return tuple(
        SeenGround(name, ground.north_m, ground.east_m, ground.asked, seen)
        for name, ground, seen, _ in _seen(flight, slice(None if until is None else until + 1))
    )


def seen_pictures(flight: FlightRecord) -> tuple[SeenPictures, ...]:
    """What each kind of camera has seen, picture by picture; empty where no UAS carries one."""
    found = []
    for name, ground, _, kept in _seen(flight, slice(None)):
        new_cells = np.zeros(len(flight.x))
        for picture, asked_cells in kept:
            new_cells[picture.sample] += asked_cells
        total = ground.asked.sum()
        share = new_cells.cumsum() / total if total else np.ones(len(flight.x))
        samples = np.array([picture.sample for picture, _ in kept], np.intp)
        corners = np.array([picture.corners_m for picture, _ in kept]).reshape(-1, 4, 2)
        found.append(SeenPictures(name, samples, corners, share))
    return tuple(found)


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
    rays = _turned(rays, kept * x[:, S.PHI], kept * x[:, S.THETA], x[:, S.PSI])
    meets = rays[..., 2] > _LEVEL * np.linalg.norm(rays, axis=-1)
    meets &= (x[:, S.Z] < 0.0)[:, None]
    if sensor.max_tilt_deg is not None:
        tilt = np.arccos(np.clip(np.cos(x[:, S.PHI]) * np.cos(x[:, S.THETA]), -1.0, 1.0))
        meets &= (tilt <= math.radians(sensor.max_tilt_deg))[:, None]
    way = -x[:, None, S.Z] / np.where(meets, rays[..., 2], np.nan)
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


class _Picture(NamedTuple):
    sample: int
    place_m: FloatArray  # (3,) of the UAS
    corners_m: FloatArray  # (4, 2) at z = 0


@dataclass(frozen=True)
class _Ground:
    """The middles of cells, which of them are to be seen, and how high they lie (N, E) [m]."""

    north_m: FloatArray
    east_m: FloatArray
    asked: BoolArray
    tops_m: FloatArray

    def cells(self, picture: _Picture) -> tuple[tuple[slice, slice], BoolArray]:
        """The cells around a picture, and which of them are in it."""
        around_m = np.vstack([picture.corners_m, picture.place_m[:2]])
        rows, columns = (
            _window(middles_m, around_m[:, k])
            for k, middles_m in enumerate((self.north_m, self.east_m))
        )
        north_m, east_m = self.north_m[rows], self.east_m[columns]
        tops_m = self.tops_m[rows, columns]
        inside = np.zeros(tops_m.shape, np.bool_)
        for top_m in np.unique(tops_m).tolist():
            lifted_m = _lifted(picture, top_m)
            inside |= (tops_m == top_m) & _inside(lifted_m, north_m, east_m)
        return (rows, columns), inside


def _seen(
    flight: FlightRecord, samples: slice
) -> Iterator[tuple[str, _Ground, BoolArray, list[tuple[_Picture, int]]]]:
    """Name of each kind of camera, the ground, and what it has seen of it.

    That is cells (N, E), and the pictures that showed new ones, with how many were to be seen.
    """
    for name, pictures in _taken(flight, samples).items():
        ground = _ground(flight.scenario, name)
        seen = np.zeros_like(ground.asked)
        kept: list[tuple[_Picture, int]] = []
        for picture in pictures:
            window, inside = ground.cells(picture)
            new = inside & ~seen[window]
            if new.any():
                seen[window] |= new
                kept.append((picture, int((new & ground.asked[window]).sum())))
        yield name, ground, seen, kept


def _taken(flight: FlightRecord, samples: slice) -> dict[str, Iterator[_Picture]]:
    """Camera -> its pictures that count, in order of time."""
    x = flight.x[samples].copy()
    flies = (flight.mode[samples] < LANDED) & ~flight.resting[samples] & flight.known[samples]
    x[..., S.PHI : S.WX] = flight.attitude_rad[samples]
    carried: dict[str, list[tuple[int, Sensor]]] = {}
    for i, uas in enumerate(flight.scenario.uas):
        for sensor in uas.sensors:
            if sensor.field_of_view_deg is not None:
                carried.setdefault(sensor.name, []).append((i, sensor))
    return {
        name: _in_time(flight.scenario, name, cameras, x, flies)
        for name, cameras in carried.items()
    }


def _in_time(
    scenario: Scenario,
    name: str,
    cameras: list[tuple[int, Sensor]],
    x: FloatArray,
    flies: BoolArray,
) -> Iterator[_Picture]:
    corners_m = np.full((len(x), len(cameras), 4, 2), np.nan)
    for c, (i, sensor) in enumerate(cameras):
        counts = flies[:, i] & _as_asked(scenario, name, x[:, i])
        corners_m[counts, c] = footprints_m(sensor, x[counts, i])
    for k, c in np.argwhere(np.isfinite(corners_m).all(axis=(2, 3))).tolist():
        yield _Picture(k, x[k, cameras[c][0], :3], corners_m[k, c])


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


def _lifted(picture: _Picture, top_m: float) -> FloatArray:
    """(4, 2) the corners of a picture on ground that is so high; one point where it is higher."""
    if top_m == 0.0:
        return picture.corners_m
    share = max(1.0 + top_m / float(picture.place_m[2]), 0.0)
    return picture.place_m[:2] + share * (picture.corners_m - picture.place_m[:2])


def _as_asked(scenario: Scenario, name: str, x: FloatArray) -> BoolArray:
    """(T,) whether a waypoint that asks for a sensor asks for this height and speed, or none."""
    demands = {(w.heights_m, w.max_speed_mps) for w in scenario.waypoints if w.sensor == name}
    if not demands:
        return np.ones(len(x), np.bool_)
    height_m, speed_mps = -x[:, S.Z], np.linalg.norm(x[:, S.VX : S.VZ + 1], axis=1)
    fits = np.zeros(len(x), np.bool_)
    for heights_m, max_speed_mps in demands:
        lowest_m, highest_m = heights_m or (-math.inf, math.inf)
        slow = speed_mps <= (math.inf if max_speed_mps is None else max_speed_mps)
        fits |= (lowest_m <= height_m) & (height_m <= highest_m) & slow
    return fits


def _ground(scenario: Scenario, name: str) -> _Ground:
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
    return _Ground(north_m, east_m, asked, _tops_m(scenario, north_m, east_m))


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
