"""What only the directory of a flight from a log holds, read back."""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

from uas_coverage_env.files.strict_toml import InputError, StrictModel
from uas_coverage_env.flight.checked import chosen, each, number_of, read, rows_of, short, step_of
from uas_coverage_env.flight.directory import PASS_COLUMNS, PASS_FILE
from uas_coverage_env.flight.of_log import Estimate, OfLog, Pass, Unknown
from uas_coverage_env.scenario import Scenario


class EstimateEntry(StrictModel):
    """One of `estimated` in `summary.json`."""

    uas: str
    what: str
    how: str


class UnknownEntry(StrictModel):
    """One of `not_known`."""

    uas: str
    from_s: float
    to_s: float
    why: str


def read_of_log(
    summary: Path,
    estimated: Sequence[EstimateEntry],
    unknown: Sequence[UnknownEntry],
    scenario: Scenario,
) -> OfLog:
    """What was estimated and is not known, with the passes that lie beside the summary.

    Raises:
        InputError: The file of the passes is missing, or one of both was damaged.
    """
    names = [uas.name for uas in scenario.uas]
    for entry in (*estimated, *unknown):
        if entry.uas not in names:
            raise InputError(
                f"{summary}: was damaged: estimated or not_known is of {short(entry.uas)}; there "
                f"are {', '.join(names)}"
            )
    return OfLog(
        tuple(Estimate(**dict(entry)) for entry in estimated),
        tuple(Unknown(**dict(entry)) for entry in unknown),
        read(summary.with_name(PASS_FILE), lambda text: _passes(text, scenario)),
    )


def _passes(text: str, scenario: Scenario) -> tuple[Pass, ...]:
    index = {uas.name: i for i, uas in enumerate(scenario.uas)}

    def read(row: list[str]) -> Pass:
        time_s, uas, *x = row
        step_of(time_s, scenario)
        chosen("uas", uas, index)
        return Pass(number_of(time_s), uas, tuple(number_of(value) for value in x))

    found = each(rows_of(text, PASS_COLUMNS), read)
    if any(one.time_s > other.time_s for one, other in pairwise(found)):
        raise ValueError("its times are not in order")
    return tuple(found)
