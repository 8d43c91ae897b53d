"""The legs of one sortie, as an autopilot is to fly them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.take_offs import Sortie
from uas_coverage_env.operations.clearance import Clearance

FloatArray = NDArray[np.float64]

STOP_S = 1.0
"""How long an autopilot stops at a corner that must not be cut [s]."""


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight leg.

    Attributes:
        end_m: (3,) where it ends [m].
        sample: Of the flight, at its end.
        speed_mps: Mean of the flight on it; where it was planned for an autopilot, which flies it
            from rest to rest, the largest [m/s].
        room: On the leg, and on what cuts the corner at its end.
        stop: Whether the autopilot stops at its end.
    """

    end_m: FloatArray
    sample: int
    speed_mps: float
    room: Clearance
    stop: bool = False


@dataclass(frozen=True, eq=False)
class Track:
    """The legs of one UAS, from above its start to above where it lands: there again, mostly.

    Attributes:
        uas: Index of the UAS.
        name: Of its file: that of the UAS, and which of its sorties it is, if there are several.
        sortie: Which part of the flight it is.
        home_m: (3,) its start on the ground [m].
        landing_m: (3,) where it lands, on the ground: its start, or another place [m].
        take_off_m: (3,) where the first leg begins, above the start [m].
        legs: One or more.
        off_m: Largest distance of a sample from its leg [m].
        waypoints: Which this UAS covers.
        passed_m: (len(waypoints),) how close the legs, corners cut, come to each centre [m].
        flown_m: (T, 3) the samples that the legs stand for, from the first of the sortie on [m].
        layer: How heights differ from those of the flight, in words; empty: they do not.
        number: Of the sortie among those of the UAS, from 1 on.
    """

    uas: int
    name: str
    sortie: Sortie
    home_m: FloatArray
    landing_m: FloatArray
    take_off_m: FloatArray
    legs: tuple[Leg, ...]
    off_m: float
    waypoints: tuple[int, ...]
    passed_m: FloatArray
    flown_m: FloatArray
    layer: str = ""
    number: int = 1

    @property
    def lands_elsewhere(self) -> bool:
        """Whether it does not land where it takes off."""
        return bool((self.landing_m != self.home_m).any())

    @property
    def corners_m(self) -> FloatArray:
        """(len(legs) + 1, 3) [m]."""
        return np.array([self.take_off_m, *(leg.end_m for leg in self.legs)])

    @property
    def room(self) -> Clearance:
        """The least on all legs."""
        least = self.legs[0].room
        for leg in self.legs:
            least = least.least(leg.room)
        return least


@dataclass(frozen=True)
class Tolerances:
    """How far an autopilot may be from the flight.

    Attributes:
        path_m: Of a sample from its leg [m].
        corner_m: How far from a corner it may pass [m].
    """

    path_m: float = 2.0
    corner_m: float = 2.0
