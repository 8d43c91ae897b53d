"""An independent check of flights: it shares no code with the world, the planners or the writer.

What is in a flight directory is judged anew from the scenario, with NumPy and SciPy alone, and
compared with `summary.json`.
"""

from uas_coverage_env.independent_check.judge import Report, check
from uas_coverage_env.independent_check.record import BadFlightError

__all__ = ["BadFlightError", "Report", "check"]
