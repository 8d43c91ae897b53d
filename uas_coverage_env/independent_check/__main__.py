"""Judge flight directories.

    python -m uas_coverage_env.independent_check DIR [DIR ...]

Exits 0 where nothing was touched and everything agrees, 1 otherwise, 2 where a directory is no
flight.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from uas_coverage_env.independent_check.judge import PLAN_TOLERANCE_M, Report, check
from uas_coverage_env.independent_check.record import BadFlightError


def _text(directory: Path, report: Report) -> str:
    lines = [
        f"{directory}: covered {report.coverage:.1%} in {report.steps} steps, "
        f"{report.energy_Wh:.3f} Wh, {'all' if report.all_home else 'not all'} home, "
        f"{len(report.contacts)} contacts, {len(report.limits)} limits exceeded, "
        f"{report.breaches} breaches"
    ]
    for kind, straight in report.straight_room_m.items():
        curved = report.curved_room_m[kind]
        lines.append(f"  room left to {kind}: straight {straight:.3f} m, curved {curved:.3f} m")
    lines += [f"  problem: {problem}" for problem in report.problems]
    return "\n".join([*lines, "  FAILED" if report.problems else "  agrees, nothing touched"])


def main(argv: Sequence[str] | None = None) -> int:
    """Check flight directories; the exit code."""
    parser = argparse.ArgumentParser(description="Check flight directories independently.")
    parser.add_argument("directories", metavar="DIR", nargs="+", type=Path)
    parser.add_argument(
        *("--plan-tolerance-m", "-p"),
        type=float,
        default=PLAN_TOLERANCE_M,
        help="how far a plan's first step may be from what was flown; more for nonlinear "
        "flights and for those with disturbances",
    )
    arguments = parser.parse_args(argv)
    clean = True
    for directory in arguments.directories:
        try:
            report = check(directory, arguments.plan_tolerance_m)
        except BadFlightError as error:
            sys.stderr.write(f"error: {error}\n")
            return 2
        sys.stdout.write(_text(directory, report) + "\n")
        clean = clean and not report.problems
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
