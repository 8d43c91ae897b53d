"""What exports write, and what vehicles do when something fails: tables for the docs."""

from collections.abc import Mapping

from uas_coverage_env.operations.mission_export.failure_responses import FAILURES
from uas_coverage_env.operations.mission_export.formats import ENDINGS
from uas_coverage_env.operations.mission_export.formats.parameters import (
    FIRMWARES,
    PARAMETERS,
    Named,
)
from uas_coverage_env.operations.mission_export.return_paths import RETRACE, RETURN
from uas_coverage_env.operations.tables import Table


def exported_files() -> Table:
    """What an export writes, and what reads it."""
    rows = [
        (f"`{ending}`", ", ".join(f"`{kind}`" for kind in formats.split(", ")), whom, holds)
        for ending, (formats, whom, holds) in ENDINGS.items()
    ]
    return ("file", "`--format`", "for", "holds"), rows


def autopilot_parameters() -> Table:
    """Every parameter that exports set, by its name in each firmware."""

    def cell(named: Named | None) -> str:
        unit = f" ({named.unit})" if named and named.unit else ""
        return f"`{named.name}`{unit}" if named else ""

    rows = [
        (parameter.purpose, *(cell(parameter.names.get(key)) for key in FIRMWARES))
        for parameter in PARAMETERS
    ]
    return ("what", *(f"`{key}`" for key in FIRMWARES)), rows


def autopilot_failures() -> Table:
    """What vehicles do when something fails."""

    def cell(says: Mapping[str, str]) -> str:
        texts = [says[a].replace("{height:g} m", "its height") for a in (RETURN, RETRACE)]
        if texts[0] == texts[1]:
            return texts[0]
        return f"{texts[0]}; where no such way is clear: {texts[1]}"

    rows = [
        (failure.event, cell(failure.copter), cell(failure.px4), failure.checked)
        for failure in FAILURES
    ]
    return ("if", "ArduCopter", "PX4", "checked"), rows
