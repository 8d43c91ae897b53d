"""Local metres and places on the Earth: an azimuthal equidistant map about an origin.

Distance and bearing from the origin are exact; between two places 5 km from it, distances are wrong
by less than 1 mm (tests/operations/test_frame.py, against geographiclib). Heights stay as they are:
`down` is minus the height above the ground at the origin and no axis of a tangent plane, because
an autopilot holds its altitude above the ground of home, along the curve of the Earth (a tangent
plane is 2 m off at a distance of 5 km).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pyproj
from numpy.typing import ArrayLike, NDArray

from uas_coverage_env.scenario import Place

_DECIMALS = 7
"""Of an origin in degrees: 1 cm, as a person can read and copy it."""


@dataclass(frozen=True)
class LocalFrame:
    """North, east and down [m] about a place on WGS 84; z = 0 is the ground there.

    Attributes:
        place: Where the origin lies.
    """

    place: Place

    @classmethod
    def around(cls, latitude_deg: ArrayLike, longitude_deg: ArrayLike) -> "LocalFrame":
        """The frame whose origin is in the middle of places; poles and date line are no exception.

        Args:
            latitude_deg: (N,) [degrees].
            longitude_deg: (N,) [degrees].
        """
        latitude, longitude = np.radians(latitude_deg), np.radians(longitude_deg)
        east = np.cos(latitude) * np.sin(longitude)
        mean = np.array([(np.cos(latitude) * np.cos(longitude)).mean(), east.mean(), 0.0])
        mean[2] = np.sin(latitude).mean()
        first = cls._at(
            np.degrees(np.arctan2(mean[2], np.hypot(*mean[:2]))),
            np.degrees(np.arctan2(mean[1], mean[0])),
        )
        places_m = first.to_ned(latitude_deg, longitude_deg)
        middle_m = 0.5 * (places_m.min(axis=0) + places_m.max(axis=0))
        return cls._at(*first.to_geodetic(middle_m)[:2])

    def at_height(self, height_m: float) -> "LocalFrame":
        """The same frame, with its ground so high above mean sea level [m]."""
        return LocalFrame(self.place.model_copy(update={"height_m": height_m}))

    @classmethod
    def _at(cls, latitude_deg: float, longitude_deg: float) -> "LocalFrame":
        place = Place(
            latitude_deg=round(float(latitude_deg), _DECIMALS),
            longitude_deg=round(float(longitude_deg), _DECIMALS),
        )
        return cls(place)

    @cached_property
    def _map(self) -> pyproj.Proj:
        return pyproj.Proj(
            proj="aeqd",
            lat_0=self.place.latitude_deg,
            lon_0=self.place.longitude_deg,
            ellps="WGS84",
        )

    def to_ned(
        self, latitude_deg: ArrayLike, longitude_deg: ArrayLike, altitude_m: ArrayLike = 0.0
    ) -> NDArray[np.float64]:
        """(..., 3) north, east, down [m].

        Args:
            latitude_deg: (...) [degrees].
            longitude_deg: (...) [degrees].
            altitude_m: (...) above the ground at the origin [m].
        """
        east, north = self._map(
            np.asarray(longitude_deg, np.float64), np.asarray(latitude_deg, np.float64)
        )
        down = -np.broadcast_to(np.asarray(altitude_m, np.float64), np.shape(north))
        return np.stack([north, east, down], axis=-1)

    def to_geodetic(self, ned_m: ArrayLike) -> NDArray[np.float64]:
        """(..., 3) latitude and longitude [degrees], altitude above the ground at the origin [m].

        Args:
            ned_m: (..., 3) north, east, down [m].
        """
        ned_m = np.asarray(ned_m, np.float64)
        longitude, latitude = self._map(ned_m[..., 1], ned_m[..., 0], inverse=True)
        return np.stack([latitude, longitude, -ned_m[..., 2]], axis=-1)
