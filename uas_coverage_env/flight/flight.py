"""A flight: its record, to be saved and loaded."""

from pathlib import Path
from typing import Self

from uas_coverage_env.flight.directory import write_flight
from uas_coverage_env.flight.figures import FlightFigures
from uas_coverage_env.flight.reading import read_flight
from uas_coverage_env.flight.record import FlightRecord


class Flight(FlightRecord):
    """One mission as it was flown; its fields are those of `FlightRecord`."""

    @property
    def figures(self) -> FlightFigures:
        """Its figures by name, as in `flight.figures["energy_Wh"]`; docs/flight_directory.md."""
        return FlightFigures(self)

    def save(self, directory: str | Path, *, overwrite: bool = False) -> Path:
        """Write the flight as a flight directory, see `uas_coverage_env.flight.directory`.

        Raises:
            InputError: The directory cannot be written, or is not empty and `overwrite` not set.
        """
        return write_flight(self, Path(directory), overwrite=overwrite)

    @classmethod
    def load(cls, directory: str | Path) -> Self:
        """Read a flight directory back; equal to the flight that was saved.

        Raises:
            InputError: A file is missing or was damaged.
        """
        return cls(**read_flight(Path(directory)))


def unless_stopped(flight: Flight) -> Flight:
    """The same flight, if it came to its end: half a flight says nothing of its planner.

    Raises:
        KeyboardInterrupt: It was stopped by hand.
    """
    if flight.ended == "stopped":
        raise KeyboardInterrupt
    return flight
