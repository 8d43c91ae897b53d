"""What the independent checker says of a flight that is compared, in words of a row."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory

from uas_coverage_env.flight import Flight
from uas_coverage_env.independent_check import BadFlightError, NotJudgedError, check
from uas_coverage_env.leaderboard.row import AGREES, NOT_JUDGED

_PLAN_TOLERANCE_M = 1e-3
_LONGEST = 2000


def verdict_on(flight: Flight, directory: Path | None = None) -> str:
    """`agrees`, in what the checker disagrees, or `not judged:` and why.

    A contact is no disagreement where the flight says so, too.

    Args:
        flight: The flight.
        directory: Where it is saved; None: it is saved for the check alone.
    """
    if directory is None:
        with TemporaryDirectory() as folder:
            return verdict_on(flight, flight.save(folder))
    # what a planner predicts is flown where nothing else flies, steers or pushes
    assisted = flight.return_mode or flight.safety_filter or flight.scenario.execution is not None
    exact = flight.dynamics == "lpv" and not assisted and not flight.disturbances
    try:
        report = check(directory, _PLAN_TOLERANCE_M if exact else math.inf)
    except NotJudgedError as error:
        return f"{NOT_JUDGED}: {str(error).removeprefix(f'{directory}: ')}"
    except BadFlightError as error:
        return f"cannot be judged: {str(error).removeprefix(f'{directory}: ')}"
    return "; ".join(report.disagreements)[:_LONGEST] or AGREES
