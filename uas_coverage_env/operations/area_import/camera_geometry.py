"""How each camera of a fleet looks at the ground: from which height, and how far apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.area_options import AreaOptions
from uas_coverage_env.operations.area_import.cameras import Camera, named_camera

_UNEVEN_M = 1.0
"""Ground that falls away by less than that under a waypoint is not worth a word."""


@dataclass(frozen=True)
class CameraView:
    """How a camera looks at the ground.

    Attributes:
        name: Of the camera, and of the sensor that UAS carry.
        camera: The camera.
        height_m: Of its waypoints above the ground [m].
        pitch_m: How far apart they are at most, east and north [m].
    """

    name: str
    camera: Camera
    height_m: float
    pitch_m: tuple[float, float]

    def sensor(self) -> dict[str, Any]:
        """The table of the camera on a UAS."""
        return {"name": self.name, "field_of_view_deg": list(self.camera.field_of_view_deg())}

    def note(self, hectares: float, heights_m: Sequence[float], *, uneven: bool = False) -> str:
        """What is seen, from how many waypoints, for the user.

        Args:
            hectares: What is to be seen [ha].
            heights_m: Of the waypoints above the lowest ground that they see [m].
            uneven: Whether the ground is.
        """
        east_m, north_m = self.pitch_m
        line = (
            f"{hectares:.1f} ha in {len(heights_m)} waypoints, at most {east_m:.1f} m apart from "
            f"west to east and {north_m:.1f} m from south to north; "
            f"{100.0 * self.camera.ground_sample_m(self.height_m):.1f} cm per pixel"
        )
        least_m = self.height_m + (_UNEVEN_M if uneven else 1e-3)
        raised = sum(height_m > least_m for height_m in heights_m)
        if raised:
            over = "roofs, or ground that falls away" if uneven else "roofs"
            worst_cm = 100.0 * self.camera.ground_sample_m(max(heights_m))
            line += f" (up to {worst_cm:.1f} from {raised} that lie higher, over {over})"
        return line


def view_of(
    name_or_path: str, height_m: float, resolution_cm: float | None, radius_m: float, overlap: float
) -> CameraView:
    """How a camera looks at the ground.

    Args:
        name_or_path: A shipped camera, or a file.
        height_m: Of waypoints above the ground, where no resolution is asked for [m].
        resolution_cm: The most that a pixel may show; None: whatever it is [cm].
        radius_m: Of a waypoint's sphere [m].
        overlap: Share of a cell that the next picture shows again [-].

    Raises:
        InputError: There is no such camera, or nothing is left from this height.
    """
    name, camera = named_camera(name_or_path)
    if resolution_cm is not None:
        height_m = camera.height_m(resolution_cm, radius_m)
    return CameraView(name, camera, height_m, camera.pitch_m(height_m, radius_m, overlap))


def view_with(
    view: CameraView, options: AreaOptions, radius_m: float, overlap: float
) -> CameraView:
    """The look at an area whose drawing says how.

    Args:
        view: As at all areas.
        options: What the drawing says.
        radius_m: Of a waypoint's sphere [m].
        overlap: As in all areas [-].

    Raises:
        InputError: It cannot be looked at so.
    """
    height_m = view.height_m if options.height_m is None else options.height_m
    if options.pixel_cm is not None:
        height_m = view.camera.height_m(options.pixel_cm, radius_m)
    share = overlap if options.overlap is None else options.overlap
    return replace(view, height_m=height_m, pitch_m=view.camera.pitch_m(height_m, radius_m, share))


def view_by(views: Sequence[CameraView], camera: str | None, source: str) -> CameraView:
    """The look at an area; the first is the usual one.

    Raises:
        InputError: No UAS carries the camera that the area names.
    """
    for view in views:
        if camera in (None, view.name):
            return view
    carried = ", ".join(view.name for view in views)
    raise InputError(
        f"{source} is to be seen by {camera!r}, which no UAS carries (they carry {carried}); give "
        f"one of them the camera, --fleet VEHICLE+{camera}:1"
    )
