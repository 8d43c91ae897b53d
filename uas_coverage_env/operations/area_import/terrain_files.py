"""The ground of a real place: a grid of heights, GeoTIFF or ESRI ASCII, in local metres.

Between the grid's points the ground is bilinear. It is sampled on a lattice over the fence, where
the grid is finer than that by the highest of what lies between two places.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
import pyproj
import rasterio
import shapely
from numpy.typing import NDArray
from pyproj.exceptions import ProjError
from rasterio.enums import ColorInterp
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window
from scipy.ndimage import map_coordinates, maximum_filter
from shapely.geometry import Polygon

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.ground import Ground
from uas_coverage_env.operations.geodesy import LocalFrame

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

AROUND_M = 10.0
"""Beyond the fence, what is sampled, too."""

_DRIVERS = {".tif": "GTiff", ".tiff": "GTiff", ".asc": "AAIGrid"}
_FINEST_M, _MOST_ACROSS = 2.0, 250
_MOST_READ = 25_000_000
_EDGE = 0.5  # cells: a grid's points are the middles of its cells
LOWEST_M, HIGHEST_M = -500.0, 9_000.0
"""No ground is lower or higher; what is marks missing data that the grid does not name [m]."""

_METRES = ("m", "metre", "meter", "metres", "meters")
_COLOURS = (ColorInterp.gray, ColorInterp.undefined)


def read_ground(
    path: Path, frame: LocalFrame, fence: Polygon, starts_m: FloatArray
) -> tuple[Ground, FloatArray]:
    """The ground of a fence, and the heights of the starts as the grid counts them.

    Heights are above the lowest of the starts.

    Args:
        path: `.tif`, or `.asc` (with its coordinates in a `.prj` beside it, else in degrees).
        frame: The local metres.
        fence: In these, x east, y north.
        starts_m: (U, 2) east and north of the take-off places [m].

    Raises:
        InputError: The file is no grid, does not cover the fence, or has holes in it.
    """
    west, south, east, north = fence.buffer(AROUND_M).bounds
    step_m = max(_FINEST_M, max(east - west, north - south) / _MOST_ACROSS)
    east_m = np.arange(west, east + step_m, step_m)
    north_m = np.arange(south, north + step_m, step_m)
    x, y = np.meshgrid(east_m, north_m)
    with _opened(path) as grid:
        _check(path, grid)
        column, row = _cells(path, grid, frame, x, y)
        within = shapely.intersects_xy(fence.buffer(AROUND_M), x, y)
        _check_covers(path, grid, frame, (column, row), (x, y), within)
        first, window = _window(path, grid, column, row)
        heights, missing = _read(path, grid, window)
        start_column, start_row = _cells(path, grid, frame, starts_m[:, 0], starts_m[:, 1])
    finer = max(float(np.abs(np.diff(a, axis=k)).max()) for a in (column, row) for k in (0, 1))
    size = 2 * math.ceil(finer / 2.0) + 1 if finer > 1.0 else 1
    reach = maximum_filter(missing, size=max(size, 3))
    holes = within & (_at(reach.astype(np.float64), column, row, first) > 0.0)
    if holes.any():
        raise InputError(
            f"{path}: has no height at {_named(frame, x[holes][0], y[holes][0])}, within the "
            f"fence; fill the gaps of the grid, or take one without"
        )
    starts = _at(heights, start_column, start_row, first)
    highest = _at(maximum_filter(heights, size=size), column, row, first) - starts.min()
    cells = within[:-1, :-1] | within[1:, :-1] | within[:-1, 1:] | within[1:, 1:]
    return Ground(east_m, north_m, highest, cells), starts


def _opened(path: Path) -> rasterio.DatasetReader:
    driver = _DRIVERS.get(path.suffix.lower())
    if driver is None:
        raise InputError(f"{path}: unknown kind of grid; take a GeoTIFF (.tif) or an .asc")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)  # it is refused below
            return rasterio.open(path.resolve(), driver=driver)
    except (RasterioError, ValueError):
        raise InputError(f"{path}: is no grid of heights that can be read") from None


def _check(path: Path, grid: rasterio.DatasetReader) -> None:
    if grid.transform.is_identity or grid.transform == grid.transform.scale(1.0, -1.0):
        raise InputError(f"{path}: does not say where it lies; take a GeoTIFF with coordinates")
    if grid.crs is None:
        west, south, east, north = grid.bounds
        if west < -180.0 or east > 360.0 or south < -90.0 or north > 90.0:
            raise InputError(
                f"{path}: its coordinates are no degrees and it does not say which they are; put "
                f"the .prj of its coordinate system beside it"
            )
    _check_bands(path, grid)
    _check_units(path, grid)


def _check_bands(path: Path, grid: rasterio.DatasetReader) -> None:
    """Refuse pictures: heights are one band, and more than 256 of them."""
    second = grid.colorinterp[1:]
    if grid.count > 2 or any(one != ColorInterp.alpha for one in second):
        raise InputError(
            f"{path}: has {grid.count} bands, as a picture does; take a grid of heights alone"
        )
    kind = grid.dtypes[0]
    if grid.colorinterp[0] not in _COLOURS or kind in ("uint8", "int8") or "complex" in kind:
        raise InputError(
            f"{path}: its band holds {grid.colorinterp[0].name} of {kind}, as a picture does; take "
            f"a grid of heights, of 16 bits or more"
        )


def _check_units(path: Path, grid: rasterio.DatasetReader) -> None:
    """Refuse heights that are said, or seem, to be in other units than metres."""
    unit = (grid.units[0] or "").strip()
    if unit and unit.lower() not in _METRES:
        raise InputError(f"{path}: heights in {unit!r}; convert them to metres")
    try:
        axes = pyproj.CRS.from_wkt(grid.crs.to_wkt()).axis_info if grid.crs else []
    except ProjError:
        return  # it is refused where its coordinates are used
    upright = [axis for axis in axes if axis.direction in ("up", "down")]
    level = [axis for axis in axes if axis not in upright]
    for axis in upright or ([] if unit else level):
        if "degree" in axis.unit_name or axis.unit_conversion_factor == 1.0:
            continue
        raise InputError(
            f"{path}: its coordinates are in {axis.unit_name!r}, and so its heights may be; "
            f"convert them to metres, and name the unit of the band"
        )


def _cells(
    path: Path, grid: rasterio.DatasetReader, frame: LocalFrame, x: FloatArray, y: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Column and row of places, counted from the middle of the first cell."""
    places = frame.to_geodetic(np.stack([y, x, np.zeros_like(x)], axis=-1))
    latitude, longitude = places[..., 0], places[..., 1]
    try:
        system = pyproj.CRS.from_wkt(grid.crs.to_wkt()) if grid.crs else None
        if system is not None and not system.equals(pyproj.CRS(4326), ignore_axis_order=True):
            to_grid = pyproj.Transformer.from_crs(4326, system, always_xy=True)
            longitude, latitude = to_grid.transform(longitude, latitude)
    except ProjError:
        raise InputError(
            f"{path}: its coordinate system is not known; save it again in WGS 84"
        ) from None
    if system is None or system.is_geographic:  # also where it counts to 360, or past the date line
        west = grid.bounds.left
        longitude = west + (longitude - west + _EDGE) % 360.0 - _EDGE
    with np.errstate(invalid="ignore"):
        to = ~grid.transform
        column = to.a * longitude + to.b * latitude + to.c
        row = to.d * longitude + to.e * latitude + to.f
    return column - _EDGE, row - _EDGE


def _check_covers(
    path: Path,
    grid: rasterio.DatasetReader,
    frame: LocalFrame,
    cells: tuple[FloatArray, FloatArray],
    places_m: tuple[FloatArray, FloatArray],
    within: BoolArray,
) -> None:
    outside = np.zeros_like(within)
    for at, count in zip(cells, (grid.width, grid.height), strict=True):
        outside |= ~((at >= -_EDGE) & (at <= count - _EDGE))
    outside &= within
    if outside.any():
        x, y = (m[outside][0] for m in places_m)
        share = outside.sum() / within.sum()
        raise InputError(
            f"{path}: does not cover {_named(frame, x, y)} and {share:.0%} of the fence with "
            f"{AROUND_M:g} m around it; take the grid of this place"
        )


def _window(
    path: Path, grid: rasterio.DatasetReader, column: FloatArray, row: FloatArray
) -> tuple[tuple[int, int], Window]:
    """First row and column of what is needed, and all of it."""
    spans = []
    for at, count in ((row, grid.height), (column, grid.width)):
        low = min(max(math.floor(at.min()) - 2, 0), count - 1)
        spans.append((low, min(math.ceil(at.max()) + 3, count)))
    (top, bottom), (left, right) = spans
    if (bottom - top) * (right - left) > _MOST_READ:
        millions = (bottom - top) * (right - left) / 1e6
        raise InputError(
            f"{path}: {millions:.0f} million heights over the fence, more than "
            f"{_MOST_READ / 1e6:.0f} million; resample the grid to a few metres"
        )
    return (top, left), Window(left, top, right - left, bottom - top)


def _read(path: Path, grid: rasterio.DatasetReader, window: Window) -> tuple[FloatArray, BoolArray]:
    """Heights [m], and where there are none."""
    try:
        found = grid.read(1, window=window, masked=True).astype(np.float64)
        found = found * grid.scales[0] + grid.offsets[0]
    except (RasterioError, ValueError):
        raise InputError(f"{path}: is damaged; take it from its source again") from None
    heights = found.filled(np.nan)
    missing = ~np.isfinite(heights)
    wrong = heights[~missing & ((heights < LOWEST_M) | (heights > HIGHEST_M))]
    if wrong.size:
        raise InputError(
            f"{path}: a height of {wrong[0]:g} m is on no ground; name the value that stands for "
            f"no data in the grid"
        )
    return np.where(missing, 0.0, heights), missing


def _at(
    values: NDArray[np.float64], column: FloatArray, row: FloatArray, first: tuple[int, int]
) -> FloatArray:
    """Bilinear between the points of a window; beyond its outermost ones as at these."""
    at = np.stack([row - first[0], column - first[1]])
    return map_coordinates(values, at, order=1, mode="nearest")


def _named(frame: LocalFrame, east_m: float, north_m: float) -> str:
    latitude, longitude, _ = frame.to_geodetic([north_m, east_m, 0.0]).tolist()
    return f"{latitude:.6f}, {longitude:.6f}"
