"""One flight of many: the job that every command gives to the runner."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Literal, NamedTuple

from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, PlannerError, Progress, rollout
from uas_coverage_env.flight.demonstrations import Demonstrator, written
from uas_coverage_env.flight.directory import flight_files
from uas_coverage_env.flight.flight import unless_stopped
from uas_coverage_env.leaderboard.check import verdict_on
from uas_coverage_env.leaderboard.row import Row
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.plugins.users_code import described

Kept = Literal["row", "flight", "demonstration"]
"""What is kept of a flight: its row alone, or its directory or what learners see of it, too."""


class FlownEntry(NamedTuple):
    """What a flight leaves.

    Attributes:
        row: Of the store.
        files: Beside the store, path -> content.
    """

    row: Row
    files: Mapping[str, bytes]

    def write(self, directory: Path) -> None:
        """Write the files; those of a folder all or none.

        Raises:
            InputError: One cannot be written.
        """
        folders: dict[Path, dict[str, bytes]] = {}
        for path, content in self.files.items():
            place = directory / path
            folders.setdefault(place.parent, {})[place.name] = content
        for folder, contents in folders.items():
            prepare_folder(folder)
            write_files(folder, contents)


def kept_as(row: Row | Entry) -> str:
    """The folder of a flight's directory, where flights are kept."""
    if isinstance(row, Entry):
        return f"flights/{row.scenario.name}-{row.spec.label}-{row.seed}"
    return f"flights/{row.scenario}-{row.label}-{row.seed}"


def flown(entry: Entry, on_step: Callable[[Progress], object] | None = None) -> Flight:
    """Fly one flight.

    Raises:
        InputError: The planner refuses the scenario, or is another one by now.
        PlannerError: The planner raised an exception, or gave commands that cannot be flown.
        KeyboardInterrupt: It was stopped by hand.
    """
    return unless_stopped(
        rollout(
            entry.scenario,
            entry.spec.load(),
            entry.seed,
            dynamics=entry.dynamics,
            return_mode=entry.return_mode,
            safety_filter=entry.safety_filter,
            reward=entry.environment.reward,
            reward_weights=entry.reward_weights,
            on_step=on_step,
        )
    )


def fly(entry: Entry, source_sha256: str, kept: Kept = "row", *, check: bool = False) -> FlownEntry:
    """Fly one flight, whatever becomes of it.

    Args:
        entry: What to fly.
        source_sha256: Hash of the source code that flies.
        kept: What is kept of it.
        check: Whether the independent checker judges it; what it disagrees with is kept.

    Raises:
        KeyboardInterrupt: It was stopped by hand.
    """
    watch = Demonstrator(entry.scenario) if kept == "demonstration" else None
    files: dict[str, bytes] = {}
    try:
        flight = flown(entry, watch)
        if watch is not None:
            files = {f"{entry.scenario.name}.npz": written(watch.shown(flight))}
        verdict = verdict_on(flight) if check else None
        row = Row.of(entry, flight, source_sha256, verdict)
        if kept == "flight" or row.disagrees:
            folder = kept_as(entry)
            files = {f"{folder}/{name}": text for name, text in flight_files(flight).items()}
    except (InputError, PlannerError) as error:
        return FlownEntry(Row.failed(entry, str(error), source_sha256), {})
    except Exception as error:  # an error in one flight must not end the others
        return FlownEntry(Row.failed(entry, described(error), source_sha256), {})
    return FlownEntry(row, files)
