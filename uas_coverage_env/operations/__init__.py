"""Missions at places on the Earth: areas that were drawn become scenarios, flights become files.

Needs the extra `ops`.
"""

from uas_coverage_env.operations.cameras import Camera, camera_names, load_camera
from uas_coverage_env.operations.drawing import Drawn, DrawnPolygon, TakeOff
from uas_coverage_env.operations.export import Export, ExportOptions, make_export
from uas_coverage_env.operations.flown import Flown, flown_flight
from uas_coverage_env.operations.formats import ENDINGS, FORMATS
from uas_coverage_env.operations.formats.parameters import FIRMWARES
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.logs import Logged, read_log
from uas_coverage_env.operations.make import Imported, ImportOptions, make_scenario
from uas_coverage_env.operations.reading import read_drawings
from uas_coverage_env.operations.tracks import Tolerances
from uas_coverage_env.operations.wishes import minutes_of

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
