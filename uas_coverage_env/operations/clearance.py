"""Room that straight lines leave to the fixed obstacles and the geofence, exact between samples."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.geometry.segments import segment_clearance
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Clearance:
    """What is left on a line.

    Attributes:
        spare_m: Beyond safe distances and the margin of the fence; negative: a breach [m].
        contact_m: Beyond the radius of the UAS and within the fence; negative: a contact [m].
    """

    spare_m: float
    contact_m: float

    def least(self, other: "Clearance") -> "Clearance":
        """The smaller of two."""
        return Clearance(min(self.spare_m, other.spare_m), min(self.contact_m, other.contact_m))


class Surroundings:
    """What a UAS has to be clear of.

    Args:
        scenario: The mission.
        uas: Index of the UAS.
    """

    def __init__(self, scenario: Scenario, uas: int) -> None:
        self._fence, self._margin_m = scenario.fence, scenario.geofence.margin_m
        self._radius_m = scenario.uas[uas].radius_m
        self._hulls = scenario.hulls
        self._safe_m = np.array([o.safe_distance_m for o in scenario.obstacles])
        self._low = np.array([h.vertices_m.min(axis=0) for h in self._hulls]).reshape(-1, 3)
        self._high = np.array([h.vertices_m.max(axis=0) for h in self._hulls]).reshape(-1, 3)

    def room(self, start_m: FloatArray, end_m: FloatArray, most_m: float = 10.0) -> Clearance:
        """Room on a straight line.

        Args:
            start_m: (3,) [m].
            end_m: (3,) [m].
            most_m: More is not told apart [m].
        """
        # signed distance is convex: in a convex fence it is largest at an end
        inside_m = -float(self._fence.signed_distance([start_m, end_m]).max())
        room = Clearance(min(inside_m - self._margin_m, most_m), min(inside_m, most_m))
        reach_m = (self._safe_m + self._radius_m + most_m)[:, None]
        beside = np.minimum(start_m, end_m) > self._high + reach_m
        beside |= np.maximum(start_m, end_m) < self._low - reach_m
        for o in np.flatnonzero(~beside.any(axis=1)):
            hull = self._hulls[o]
            clear_m = segment_clearance(
                hull.normals, hull.offsets_m, 0, hull.n_faces, *start_m, *end_m
            )
            contact_m = float(clear_m) - self._radius_m
            room = room.least(Clearance(contact_m - float(self._safe_m[o]), contact_m))
        return room

    def path_room(self, places_m: FloatArray) -> Clearance:
        """Room on a path.

        Args:
            places_m: (N, 3) its corners; at least two [m].
        """
        rooms = [self.room(a, b) for a, b in pairwise(places_m)]
        least = rooms[0]
        for room in rooms:
            least = least.least(room)
        return least
