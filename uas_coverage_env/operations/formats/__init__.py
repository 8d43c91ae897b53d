"""What an export writes for each UAS; a new format is a line in `FORMATS`."""

from collections.abc import Callable, Mapping, Sequence

from uas_coverage_env.operations.apart import Part
from uas_coverage_env.operations.exported import Exported
from uas_coverage_env.operations.formats.ardupilot import parameters_text, waypoints_text
from uas_coverage_env.operations.formats.qgc import plan_text
from uas_coverage_env.operations.formats.tracks import csv_text, geojson_text, kml_text
from uas_coverage_env.operations.tracks import Tolerances
from uas_coverage_env.scenario import Scenario

Flown = Sequence[tuple[Part, Exported]]
"""The sorties of one UAS in their order, each with the flight that it is part of."""

Writer = Callable[[str, Flown, Tolerances, str], Mapping[str, str]]
"""Name of a UAS, its sorties, tolerances, autopilot -> name of a file and its text."""


def _qgc(
    scenario: Scenario, one: Exported, tolerances: Tolerances, autopilot: str
) -> Mapping[str, str]:
    files = {".plan": plan_text(scenario, one, tolerances, autopilot)}
    if autopilot == "ardupilot":
        files[".param"] = parameters_text(scenario, one, tolerances)
    return files


def _ardupilot(
    scenario: Scenario, one: Exported, tolerances: Tolerances, autopilot: str
) -> Mapping[str, str]:
    del autopilot
    return {
        ".waypoints": waypoints_text(one, tolerances),
        ".param": parameters_text(scenario, one, tolerances),
    }


def _each(write: Callable[[Scenario, Exported, Tolerances, str], Mapping[str, str]]) -> Writer:
    """Files for each sortie: a mission of an autopilot is one take-off and one landing."""

    def written(
        name: str, flown: Flown, tolerances: Tolerances, autopilot: str
    ) -> Mapping[str, str]:
        del name
        return {
            f"{one.track.name}{ending}": text
            for part, one in flown
            for ending, text in write(part.flight.scenario, one, tolerances, autopilot).items()
        }

    return written


FORMATS: Mapping[str, Writer] = {
    "qgc": _each(_qgc),
    "ardupilot": _each(_ardupilot),
    "kml": lambda name, flown, *_: {f"{name}.kml": kml_text(name, flown)},
    "geojson": lambda name, flown, *_: {f"{name}.geojson": geojson_text(name, flown)},
    "csv": lambda name, flown, *_: {f"{name}.csv": csv_text(name, flown)},
}

ENDINGS = frozenset({".plan", ".waypoints", ".param", ".kml", ".geojson", ".csv"})
"""Of the files of all formats."""
