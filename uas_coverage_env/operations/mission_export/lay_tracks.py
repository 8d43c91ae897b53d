"""A flight as few straight legs that an autopilot can fly, every one of them checked.

An autopilot takes corners, not samples. A leg may stand for a part of the flight where

* all samples lie within a tolerance of it,
* it leaves as much room to obstacles and fence as the flight did, or a full safe distance less what
  of it may be spent, and is never in contact,
* it passes what the UAS covered on the way within its radius.

Legs are made as long as that allows, one after the other. At a corner that must not be cut,
because the cut would be too close to something or miss a waypoint, the autopilot stops.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight, covered_at
from uas_coverage_env.flight.take_offs import TAKE_OFF_HEIGHT_M, Sortie, sorties_of
from uas_coverage_env.operations.mission_export.leg_builder import SPENT_M, LegBuilder
from uas_coverage_env.operations.mission_export.tracks import FloatArray, Leg, Tolerances, Track
from uas_coverage_env.operations.path_geometry import distances_m
from uas_coverage_env.world.coverage import covering_samples

_GROUND_M = 0.3


def make_tracks(
    flight: Flight, uas: int, tolerances: Tolerances, covered: NDArray[np.int64] | None = None
) -> list[Track]:
    """The legs of each sortie of a UAS; of those that leave the ground.

    Args:
        flight: In which the UAS has landed; its scenario is that at the end, homes where they are
            then.
        uas: Index of the UAS.
        tolerances: How far legs may be from the flight.
        covered: (W,) the sample in which each waypoint was covered; None: where all were to be
            covered from the start on.

    Raises:
        InputError: No legs could be found that are free of contact.
    """
    if covered is None:
        covered = covered_at(flight)
    found = (make_track(flight, uas, one, covered, tolerances) for one in sorties_of(flight, uas))
    return [track for track in found if track is not None]


def make_track(
    flight: Flight, uas: int, sortie: Sortie, covered: NDArray[np.int64], tolerances: Tolerances
) -> Track | None:
    """The legs of a sortie; None where the UAS stays on the ground.

    Args:
        flight: As for `make_tracks`; likewise the other arguments.
        uas: Index of the UAS.
        sortie: From which take-off to which landing.
        covered: (W,) samples.
        tolerances: How far legs may be from the flight.

    Raises:
        InputError: No legs could be found that are free of contact.
    """
    path = flight.x[sortie.first : sortie.landed, uas, 0:3]
    high = np.flatnonzero(-path[:, 2] >= TAKE_OFF_HEIGHT_M)
    if not len(high):
        return None
    first, last = int(high[0]), int(high[-1])
    _check_in_air(flight, uas, sortie, path[first:last], first)
    home_m, landing_m = (
        _place_m(flight, uas, sample) * (1.0, 1.0, 0.0) for sample in (sortie.first, sortie.landed)
    )
    builder = LegBuilder(flight, uas, sortie, _covered_by(flight, uas, sortie, covered), tolerances)
    take_off_m = np.array([*home_m[:2], path[first, 2]])
    above_m = np.array([*landing_m[:2], path[last, 2]])
    points = builder.corners(first, last, take_off_m, above_m)
    legs = tuple(
        Leg(end_m, sortie.first + j, builder.speed_mps(i, j), builder.around.room(start_m, end_m))
        for (start_m, i), (end_m, j) in pairwise(points)
    )
    corners = np.array([point for point, _ in points])
    legs = builder.with_stops(corners, legs)
    off_m = max(
        float(distances_m(path[i : j + 1], a, b).max()) for (a, i), (b, j) in pairwise(points)
    )
    track = Track(
        uas=uas,
        name=flight.scenario.uas[uas].name,
        sortie=sortie,
        home_m=home_m,
        landing_m=landing_m,
        take_off_m=take_off_m,
        legs=legs,
        off_m=off_m,
        waypoints=tuple(builder.waypoints),
        passed_m=builder.passed_m(corners, [leg.stop for leg in legs]),
        flown_m=path,
    )
    up_m = (0.0, 0.0, TAKE_OFF_HEIGHT_M)
    ups_m = [
        builder.around.path_room(np.array([above, ground_m - up_m])).contact_m
        for above, ground_m in ((take_off_m, home_m), (above_m, landing_m))
    ]
    if min(track.room.contact_m, *ups_m) <= 0.0:
        raise InputError(
            f"{track.name}: no legs are free of contact within --tolerance {tolerances.path_m:g}; "
            f"make it smaller"
        )
    return track


def _check_in_air(flight: Flight, uas: int, sortie: Sortie, path: FloatArray, first: int) -> None:
    """Refuse a flight made of a log, which does not say that a UAS had landed in between."""
    touches = first + np.flatnonzero(-path[:, 2] < _GROUND_M)
    if len(touches):
        at_s = (sortie.first + int(touches[0])) * flight.scenario.dt_s
        raise InputError(
            f"{flight.scenario.uas[uas].name} is on the ground {at_s:g} s after the start and "
            f"flies on; export the flight that was planned instead"
        )


def _place_m(flight: Flight, uas: int, sample: int) -> FloatArray:
    """(3,) the home at which a UAS stands at a sample: its first, or that at the end."""
    homes = np.array([flight.x[0, uas, :3], flight.scenario.uas[uas].home_m])
    away_m = np.linalg.norm(homes - flight.x[sample, uas, :3], axis=1)
    return homes[1 if away_m[1] <= away_m[0] else 0]


def _covered_by(
    flight: Flight, uas: int, sortie: Sortie, covered: NDArray[np.int64]
) -> dict[int, int]:
    """The waypoints that a UAS covers in a sortie, and in which of the samples of that."""
    scenario, (first, landed) = flight.scenario, sortie[:2]
    return {
        w: sample - first
        for w, sample in enumerate(covered.tolist())
        if first <= sample < landed and covering_samples(scenario, w, flight.x[sample])[uas]
    }


def relaid(
    flight: Flight,
    track: Track,
    corners: FloatArray,
    leg_of: list[int],
    tolerances: Tolerances,
    layer: str,
) -> Track | None:
    """A track with other corners; None where it is not as clear, or misses a waypoint.

    Args:
        flight: The flight.
        track: The track as it is.
        corners: (C, 3) the new ones [m].
        leg_of: (C - 1,) the leg of the track that each new one stands for.
        tolerances: How far legs may be from the flight.
        layer: What is different, in words.
    """
    covered = dict.fromkeys(track.waypoints, 0)
    builder = LegBuilder(flight, track.uas, track.sortie, covered, tolerances)
    legs = tuple(
        replace(track.legs[n], end_m=end_m, room=builder.around.room(start_m, end_m), stop=False)
        for (start_m, end_m), n in zip(pairwise(corners), leg_of, strict=True)
    )
    legs = builder.with_stops(corners, legs)
    new = replace(
        track,
        legs=legs,
        passed_m=builder.passed_m(corners, [leg.stop for leg in legs]),
        layer=layer,
    )
    radii = np.array([flight.scenario.waypoints[w].radius_m for w in track.waypoints])
    passes = new.passed_m <= np.maximum(radii - tolerances.path_m, track.passed_m) + 1e-9
    spent_m = min(SPENT_M, tolerances.path_m)
    clear = new.room.contact_m > 0.0 and new.room.spare_m >= min(-spent_m, track.room.spare_m)
    return new if clear and passes.all() else None
