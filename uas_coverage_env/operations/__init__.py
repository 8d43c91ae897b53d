"""Missions at places on the Earth: areas that were drawn become scenarios, flights become files.

Needs the extra `ops`.
"""

from uas_coverage_env.operations.area_import.area_options import minutes_of
from uas_coverage_env.operations.area_import.cameras import Camera, camera_names, load_camera
from uas_coverage_env.operations.area_import.drawn_areas import Drawn, DrawnPolygon, TakeOff
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
from uas_coverage_env.operations.mission_export.formats import ENDINGS, FORMATS
from uas_coverage_env.operations.mission_export.formats.parameters import FIRMWARES
from uas_coverage_env.operations.mission_export.tracks import Tolerances

__all__ = [
    "ENDINGS",
    "FIRMWARES",
    "FORMATS",
    "Camera",
    "Drawn",
    "DrawnPolygon",
    "Export",
    "ExportOptions",
    "Flown",
    "ImportOptions",
    "Imported",
    "LocalFrame",
    "Logged",
    "TakeOff",
    "Tolerances",
    "camera_names",
    "flown_flight",
    "load_camera",
    "make_export",
    "make_scenario",
    "minutes_of",
    "read_drawings",
    "read_log",
]
