"""Cameras: what they show of the ground, and how far apart pictures may be."""

import math
from pathlib import Path
from typing import Annotated

from pydantic import Field, RootModel

from uas_coverage_env.files.errors import InputError, check_within
from uas_coverage_env.files.strict_toml import StrictModel, read_toml
from uas_coverage_env.files.suggestions import did_you_mean

_SHIPPED = Path(__file__).with_name("cameras.toml")

_Length_mm = Annotated[float, Field(gt=0.0, le=1_000.0)]
_Pixels = Annotated[int, Field(ge=1, le=1_000_000)]


class Camera(StrictModel):
    """A camera that looks straight down, the wide side of its picture from west to east.

    Attributes:
        sensor_mm: Width and height of the sensor [mm].
        focal_mm: Focal length [mm].
        picture_px: Width and height of a picture [pixels].
    """

    sensor_mm: tuple[_Length_mm, _Length_mm]
    focal_mm: _Length_mm
    picture_px: tuple[_Pixels, _Pixels]

    def footprint_m(self, height_m: float) -> tuple[float, float]:
        """West to east and south to north [m], what a picture shows from a height above ground."""
        width_mm, height_mm = self.sensor_mm
        return height_m * width_mm / self.focal_mm, height_m * height_mm / self.focal_mm

    def ground_sample_m(self, height_m: float) -> float:
        """Size of a pixel on the ground [m]."""
        return self.footprint_m(height_m)[0] / self.picture_px[0]

    def field_of_view_deg(self) -> tuple[float, float]:
        """Opening angles of a picture, across its width and its height [degrees]."""
        width_mm, height_mm = self.sensor_mm
        across, along = (
            round(math.degrees(2.0 * math.atan(0.5 * side / self.focal_mm)), 3)
            for side in (width_mm, height_mm)
        )
        return across, along

    def height_m(self, resolution_cm: float, radius_m: float) -> float:
        """Height of waypoints from anywhere in whose spheres a pixel shows so little ground [m].

        Args:
            resolution_cm: The most that a pixel may show [cm].
            radius_m: Of the spheres [m].

        Raises:
            InputError: There is no such height.
        """
        check_within("--resolution", resolution_cm, 0.01, 1_000.0)
        highest_m = 0.01 * resolution_cm / self.ground_sample_m(1.0)
        height_m = math.floor(10.0 * (highest_m - radius_m)) / 10.0
        if height_m <= radius_m:
            least_cm = 100.0 * self.ground_sample_m(2.0 * radius_m + 0.1)
            raise InputError(
                f"--resolution {resolution_cm:g}: needs a height below {highest_m:.1f} m, too low "
                f"for a sphere of {radius_m:g} m; take {least_cm:.2f} or more, or a smaller "
                f"--radius"
            )
        return height_m

    def pitch_m(self, height_m: float, radius_m: float, overlap: float) -> tuple[float, float]:
        """How far apart waypoints may be so that all between them is seen; (east, north) [m].

        A waypoint counts as covered from anywhere in its sphere: from the edge, and from its
        lowest point, where a picture shows least. The cell of ground that belongs to the waypoint
        has to be in the picture all the same.

        Args:
            height_m: Of the waypoint above the ground [m].
            radius_m: Of its sphere [m].
            overlap: Share of a cell that the next one shows again [-].

        Raises:
            InputError: From this height nothing is left.
        """
        lowest = self.footprint_m(height_m - radius_m)
        east_m, north_m = ((side - 2.0 * radius_m) * (1.0 - overlap) for side in lowest)
        if min(east_m, north_m) <= 0.0:
            enough_m = radius_m * (1.0 + 2.0 * self.focal_mm / min(self.sensor_mm))
            raise InputError(
                f"--height {height_m:g}: too low for a picture around a sphere of {radius_m:g} m; "
                f"fly higher than {enough_m:.1f} m, or take a smaller --radius"
            )
        return east_m, north_m


class _Cameras(RootModel[dict[str, Camera]]):
    """A file of cameras by name."""


def camera_names() -> tuple[str, ...]:
    """The names of the shipped cameras."""
    return tuple(read_toml(_SHIPPED, _Cameras).root)


def load_camera(name_or_path: str) -> Camera:
    """A shipped camera, or the only one of a file of the same form as `cameras.toml`.

    Raises:
        InputError: There is no such camera, or its file is wrong.
    """
    return named_camera(name_or_path)[1]


def named_camera(name_or_path: str) -> tuple[str, Camera]:
    """The same and its name; see `load_camera`."""
    shipped = read_toml(_SHIPPED, _Cameras).root
    if name_or_path in shipped:
        return name_or_path, shipped[name_or_path]
    if not name_or_path.endswith(".toml"):
        take = f"take {', '.join(shipped)} or the path of a .toml file"
        instead = did_you_mean(name_or_path, shipped, take)
        raise InputError(f"unknown camera {name_or_path[:80]!r}; {instead}")
    own = list(read_toml(name_or_path, _Cameras).root.items())
    if len(own) != 1:
        raise InputError(f"{name_or_path}: has {len(own)} cameras; keep one table [NAME]")
    return own[0]
