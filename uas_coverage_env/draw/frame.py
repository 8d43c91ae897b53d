"""Where things lie in a picture: the map, the header, the footer and the altitude scale."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

SMOOTHING = 2
"""Everything is drawn at this multiple of the size and averaged down, which smooths all edges."""

_DESIGN_PX = 512
# In smaller pictures the writing shrinks less than the rest.
_SMALL_PX, _LARGER = 384, 1.25
# Of the row below the map with scale and north, where no mark covers them.
_SCALE = 14


@dataclass(frozen=True)
class Frame:
    """The layout of a picture in canvas pixels (`SMOOTHING` per picture pixel).

    Attributes:
        side: Side of the square canvas.
        unit: Canvas pixels per pixel of the 512-pixel design.
        letter: Canvas pixels per pixel of its writing.
        detailed: Whether there is room for all that could be written.
        header: Height of the strip above the map.
        footer: Top edge of the strip below the map.
        gauge: Left edge of the altitude scale.
        south_m: North coordinate at the lower edge of the map.
        west_m: East coordinate at its left edge.
        ceiling_m: Highest altitude of the fence.
        floor_m: Its lowest.
        scale: Canvas pixels per metre.
        left: Left edge of the map.
        bottom: Lower edge of the map.
    """

    side: int
    unit: float
    letter: float
    detailed: bool
    header: float
    footer: float
    gauge: float
    south_m: float
    west_m: float
    ceiling_m: float
    floor_m: float
    scale: float
    left: float
    bottom: float

    @classmethod
    def around(cls, fence_vertices_m: NDArray[np.float64], size_px: int) -> "Frame":
        """Fit a fence into a square picture.

        Args:
            fence_vertices_m: (V, 3) [m] corners of the geofence.
            size_px: Side of the picture.
        """
        side = size_px * SMOOTHING
        unit = side / _DESIGN_PX
        header, footer, gauge = 30 * unit, side - 28 * unit, side - 44 * unit
        low, high = fence_vertices_m.min(axis=0), fence_vertices_m.max(axis=0)
        room_x, room_y = gauge - 14 * unit, footer - header - (12 + _SCALE) * unit
        scale = float(min(room_x / (high[1] - low[1]), room_y / (high[0] - low[0])))
        left = 8 * unit + (room_x - scale * (high[1] - low[1])) / 2
        bottom = footer - (6 + _SCALE) * unit - (room_y - scale * (high[0] - low[0])) / 2
        return cls(
            side=side,
            unit=unit,
            letter=unit * (_LARGER if size_px < _SMALL_PX else 1.0),
            detailed=size_px >= _SMALL_PX,
            header=header,
            footer=footer,
            gauge=gauge,
            south_m=float(low[0]),
            west_m=float(low[1]),
            ceiling_m=float(-low[2]),
            floor_m=float(-high[2]),
            scale=scale,
            left=float(left),
            bottom=float(bottom),
        )

    def pixels(self, positions_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Canvas coordinates of positions: east to the right, north up.

        Args:
            positions_m: (..., 2 or 3) [m] north, east (, down).

        Returns:
            (..., 2).
        """
        x = self.left + self.scale * (positions_m[..., 1] - self.west_m)
        y = self.bottom - self.scale * (positions_m[..., 0] - self.south_m)
        return np.stack([x, y], axis=-1)

    def gauge_height(self, altitude_m: float) -> float:
        """Canvas row of an altitude on the scale."""
        top, bottom = self.header + 22 * self.unit, self.footer - 14 * self.unit
        share = (altitude_m - self.floor_m) / (self.ceiling_m - self.floor_m)
        return bottom - min(1.0, max(0.0, share)) * (bottom - top)
