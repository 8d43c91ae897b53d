"""What an export writes for each UAS; a new format is a line in `FORMATS`."""

from collections.abc import Callable, Mapping

from uas_coverage_env.operations.exported import Exported
from uas_coverage_env.operations.formats.ardupilot import parameters_text, waypoints_text
from uas_coverage_env.operations.formats.qgc import plan_text
from uas_coverage_env.operations.formats.tracks import csv_text, geojson_text, kml_text
from uas_coverage_env.operations.tracks import Tolerances
from uas_coverage_env.scenario import Scenario

Writer = Callable[[Scenario, Exported, Tolerances, str], Mapping[str, str]]
"""Scenario, UAS, tolerances, autopilot -> ending of a file and its text."""


def _qgc(
    scenario: Scenario, one: Exported, tolerances: Tolerances, autopilot: str
) -> Mapping[str, str]:
    files = {".plan": plan_text(scenario, one, tolerances, autopilot)}
    if autopilot == "ardupilot":
        files[".param"] = parameters_text(scenario, one, tolerances)
    return files


FORMATS: Mapping[str, Writer] = {
    "qgc": _qgc,
    "ardupilot": lambda scenario, one, tolerances, _: {
        ".waypoints": waypoints_text(one, tolerances),
        ".param": parameters_text(scenario, one, tolerances),
    },
    "kml": lambda scenario, one, *_: {".kml": kml_text(scenario, one)},
    "geojson": lambda scenario, one, *_: {".geojson": geojson_text(scenario, one)},
    "csv": lambda scenario, one, *_: {".csv": csv_text(scenario, one)},
}

ENDINGS = frozenset({".plan", ".waypoints", ".param", ".kml", ".geojson", ".csv"})
"""Of the files of all formats."""
