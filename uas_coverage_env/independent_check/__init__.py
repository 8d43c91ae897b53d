"""An independent check of flights: it shares no code with the world, the planners or the writer.

What is in a flight directory is judged anew from the scenario, with NumPy and SciPy alone, and
compared with `summary.json`: `python -m uas_coverage_env.independent_check DIR`.
"""

from uas_coverage_env.independent_check.judge import Report as Report
from uas_coverage_env.independent_check.judge import check as check
from uas_coverage_env.independent_check.record import BadFlightError as BadFlightError
from uas_coverage_env.independent_check.record import NotJudgedError as NotJudgedError
