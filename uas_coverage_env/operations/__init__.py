"""Missions at places on the Earth: areas that were drawn become scenarios, flights become files.

Needs the extra `ops`.
"""

from uas_coverage_env.operations.cameras import Camera, camera_names, load_camera
from uas_coverage_env.operations.drawing import Drawn, DrawnPolygon, TakeOff
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.make import Imported, ImportOptions, make_scenario
from uas_coverage_env.operations.reading import read_drawings

__all__ = [
    "Camera",
    "Drawn",
    "DrawnPolygon",
    "ImportOptions",
    "Imported",
    "LocalFrame",
    "TakeOff",
    "camera_names",
    "load_camera",
    "make_scenario",
    "read_drawings",
]
