"""A mission, complete: its fields together make sense."""

from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.scenario.checks import first_of, problems
from uas_coverage_env.scenario.toml_text import toml_text
from uas_coverage_env.scenario.unchecked import UncheckedScenario


class Scenario(UncheckedScenario):
    """A mission, complete and checked; immutable, hashable, the same for every planner and learner.

    Attributes:
        schema_version: Version of the file format; `schema` in files.
        name: Name of the scenario.
        dt_s: Length of a time step [s].
        max_steps: Steps after which a flight ends.
        landing_distance_m: A UAS this close to its home can land [m].
        landing_speed_mps: ... when it is slower than this [m/s].
        uas_safe_distance_m: Kept between two UAS in addition to their radii [m].
        min_height_m: Least height of a UAS above the ground (z = 0) and above roofs, except for
            take-off and landing; without it, or at 0, there is no such rule [m].
        route_margin_m: What routes keep beyond the distances that count as a breach; without it,
            it follows from the vehicles: 1 m where they stop in 25 to 30 m, as the S500
            and the hexacopter do, and in proportion where they stop in less or more [m].
        from_ground: Whether UAS climb from the ground to their starts before t = 0, and descend to
            it after the last sample; without it missions begin and end in the air.
        relaunch: Whether landed UAS take off again on their remaining charge, when no other UAS is
            working; without it, a UAS that has landed stays on the ground.
        doors_m: Middles of openings at which routes may turn, north and east, (D, 2) [m].
        planar: For missions in a plane: the height at which all UAS fly, start and land.
        geofence: The volume to stay in.
        obstacles: Fixed obstacles.
        walls: Walls with doors; in the scenario that is read they are `obstacles`, and their doors
            `doors_m`.
        moving_obstacles: Moving obstacles.
        uas: The fleet.
        waypoints: Points to be covered.
        decorations: Drawn only.
        place: Where on the Earth the origin lies; for maps and exported files.
        wind: Wind; without it, the air is still.
        uncertainty: By how much the vehicles may differ from their files; without it, they do not.
        disturbances: Other disturbances: a table `[disturbances.NAME]` for each, with the keys of
            the package that installed NAME.
        sensing: Errors with which planners and autopilots know the UAS; without it, none.
        events: What happens during the mission: a table `[[events]]` for each.
        sorties: Battery packs of each UAS; without it, one.
        reserve: Charge with which UAS land at the latest; without it, what `dod_max` leaves.
        execution: For missions that an autopilot will fly from files.
    """

    def __getstate__(self) -> dict[Any, Any]:
        # unlike the rest of what is computed: where the copy goes their files may be others
        state = super().__getstate__()
        state["__dict__"]["vehicles"] = self.vehicles
        return state

    @model_validator(mode="after")
    def _has_no_problem(self) -> Self:
        found = problems(self)
        if found:
            raise ValueError(first_of(found))
        return self

    def moving_positions(self, time_s: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Centres of the moving obstacles, integrated exactly.

        Args:
            time_s: Time since the start of the mission, or (T,) times; not negative [s].

        Returns:
            (M, 3) or (T, M, 3) [m].
        """
        time_s = np.asarray(time_s, dtype=float)
        positions = np.empty((*time_s.shape, len(self.moving_obstacles), 3))
        for m, (from_s, velocity_mps) in enumerate(self._schedules):
            until_s = np.append(from_s[1:], np.inf)
            flown_s = np.clip(np.minimum(time_s[..., None], until_s) - from_s, 0.0, None)
            way_m = (flown_s[..., None, :] @ velocity_mps)[..., 0, :]
            positions[..., m, :] = self.moving_obstacles[m].start_m + way_m
        return positions

    def moving_velocities(self, time_s: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities of the moving obstacles; at a change, the new one.

        Args:
            time_s: Time since the start of the mission, or (T,) times; not negative [s].

        Returns:
            (M, 3) or (T, M, 3) [m/s].
        """
        velocities = np.empty((*np.shape(time_s), len(self.moving_obstacles), 3))
        for m, (from_s, velocity_mps) in enumerate(self._schedules):
            now = np.searchsorted(from_s, time_s, side="right") - 1
            velocities[..., m, :] = velocity_mps[now]
        return velocities

    @cached_property
    def _schedules(self) -> tuple[tuple[NDArray[np.float64], NDArray[np.float64]], ...]:
        """(pieces,) [s] and (pieces, 3) [m/s] of each moving obstacle."""
        return tuple(
            (
                np.array([piece.from_s for piece in obstacle.schedule]),
                np.array([piece.velocity_mps for piece in obstacle.schedule]),
            )
            for obstacle in self.moving_obstacles
        )

    def content(self) -> dict[str, Any]:
        """All that it says as plain data, vehicles included, whatever files it came from."""
        data = self.model_dump(mode="json", by_alias=True)
        for uas, vehicle in zip(data["uas"], self.vehicles, strict=True):
            uas["vehicle"] = vehicle.model_dump(mode="json")
        return data

    def file_text(self) -> str:
        """The text of a scenario file that `load_scenario` reads back as an equal scenario."""
        return toml_text(self.model_dump(mode="json", by_alias=True))

    def to_file(self, path: str | Path) -> None:
        """Write a scenario file that `load_scenario` reads back as an equal scenario."""
        write_atomically(Path(path), self.file_text().encode())
