"""What an export writes for each UAS; a new format is a line in `FORMATS`."""

from collections.abc import Callable, Mapping

from uas_coverage_env.operations.mission_export.formats.ardupilot import waypoints_text
from uas_coverage_env.operations.mission_export.formats.firmware import PX4
from uas_coverage_env.operations.mission_export.formats.geofence import fence_text
from uas_coverage_env.operations.mission_export.formats.parameters import (
    Facts,
    param_text,
    params_text,
)
from uas_coverage_env.operations.mission_export.formats.qgc import plan_text
from uas_coverage_env.operations.mission_export.formats.track_files import (
    UasFiles,
    csv_text,
    geojson_text,
    kml_text,
)
from uas_coverage_env.operations.mission_export.tracks import Tolerances

Writer = Callable[[str, UasFiles, Tolerances, str | None], Mapping[str, str]]
"""Name of a UAS, its sorties, tolerances, firmware -> name of a file and its text."""

_OneSortie = Callable[[Facts, str | None, int], Mapping[str, str]]
"""A sortie, firmware, system id of its vehicle -> ending of a file and its text."""


def _qgc(facts: Facts, firmware: str | None, system_id: int) -> Mapping[str, str]:
    px4 = firmware == PX4
    files = {
        ".plan": plan_text(*facts, px4=px4),
        ".params": params_text(facts, firmware, system_id),
    }
    return files if px4 else files | {".param": param_text(facts, firmware)}


def _ardupilot(facts: Facts, firmware: str | None, system_id: int) -> Mapping[str, str]:
    del system_id
    return {
        ".waypoints": waypoints_text(facts.one, facts.tolerances),
        ".fence": fence_text(facts.scenario, facts.one),
        ".param": param_text(facts, firmware),
    }


def _each(write: _OneSortie) -> Writer:
    """Files for each sortie: a mission of an autopilot is one take-off and one landing."""

    def written(
        name: str, flown: UasFiles, tolerances: Tolerances, firmware: str | None
    ) -> Mapping[str, str]:
        system_id = 1 + flown[0][0].flight.names.index(name)
        return {
            f"{one.track.name}{ending}": text
            for part, one in flown
            for ending, text in write(
                Facts(part.flight.scenario, one, tolerances), firmware, system_id
            ).items()
        }

    return written


FORMATS: Mapping[str, Writer] = {
    "qgc": _each(_qgc),
    "ardupilot": _each(_ardupilot),
    "kml": lambda name, flown, *_: {f"{name}.kml": kml_text(name, flown)},
    "geojson": lambda name, flown, *_: {f"{name}.geojson": geojson_text(name, flown)},
    "csv": lambda name, flown, *_: {f"{name}.csv": csv_text(name, flown)},
}

AUTOPILOTS = ("qgc", "ardupilot")
"""Formats that a vehicle flies, with parameters; the others are for maps and tables."""

ENDINGS: Mapping[str, tuple[str, str, str]] = {
    ".plan": (
        "qgc",
        "QGroundControl",
        "take-off, waits, waypoints, speeds, heading, camera triggers, landing; the fence and "
        "no-fly zones; a rally point where it lands",
    ),
    ".params": (
        "qgc",
        "QGroundControl of any version, for ArduPilot and for PX4",
        "the parameters below, in QGroundControl's own form, for the vehicle of that system id: "
        "`uas_1` is 1, `uas_2` is 2",
    ),
    ".param": (
        "qgc, ardupilot",
        "Mission Planner, MAVProxy; QGroundControl since June 2026; none for PX4",
        "the same parameters, a line `NAME,VALUE` for each",
    ),
    ".waypoints": (
        "ardupilot",
        "Mission Planner, MAVProxy",
        "the commands of `.plan` (QGC WPL 110), without fence and rally point",
    ),
    ".fence": ("ardupilot", "MAVProxy", "the fence and no-fly zones (QGC WPL 110)"),
    ".kml": ("kml", "Google Earth and other maps", "the flown track and the legs of each sortie"),
    ".geojson": ("geojson", "maps", "the same"),
    ".csv": (
        "csv",
        "tables, `log`",
        "the flown samples in degrees, of which sortie they are, charge, voltage and current",
    ),
}
"""Of the files of all formats -> the formats that write them, the reader, and what they hold."""
