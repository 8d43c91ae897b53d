"""Missions at places on the Earth: areas that were drawn become scenarios, flights become files.

Needs the extra `ops`. Four rooms that do not know each other, over what they share: `area_import`,
`mission_export`, `logs`, `stream`.
"""

from uas_coverage_env.operations.area_import.cameras import Camera, camera_names, load_camera
from uas_coverage_env.operations.area_import.drawn_areas import DrawnPolygon, TakeOff
from uas_coverage_env.operations.area_import.import_area import (
    Imported,
    ImportOptions,
    make_scenario,
)
from uas_coverage_env.operations.area_import.read_drawings import read_drawings
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.logs.import_log import Flown, flown_flight
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.operations.logs.read_log import read_log
from uas_coverage_env.operations.mission_export.export import Export, ExportOptions, make_export

__all__ = [
    "Camera",
    "DrawnPolygon",
    "Export",
    "ExportOptions",
    "Flown",
    "ImportOptions",
    "Imported",
    "LocalFrame",
    "Logged",
    "TakeOff",
    "camera_names",
    "flown_flight",
    "load_camera",
    "make_export",
    "make_scenario",
    "read_drawings",
    "read_log",
]
