"""Record the flight that `uas-coverage demo` shows first: python docs/recorded_flight.py.

A test says when that is due: when the viewer wants other data, or the planner flies another way.
"""

import tempfile
from pathlib import Path

from uas_coverage_env.flight import Flight, rollout
from uas_coverage_env.replay import recorded

SCENARIO, PLANNER = "village", "trajectory"
ARCHIVE = Path(recorded.__file__).with_name("recorded.zip")


def fly() -> Flight:
    """The flight."""
    return rollout(SCENARIO, PLANNER, 0)


def main() -> None:
    """Fly it and write the archive."""
    with tempfile.TemporaryDirectory() as folder:
        ARCHIVE.write_bytes(recorded.archive_of(fly().save(Path(folder) / "flight")))


if __name__ == "__main__":
    main()
