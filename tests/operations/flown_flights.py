"""A small mission and how a vehicle flies it: for tests of what comes back from its logs."""

import json

import numpy as np

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.operations import LocalFrame, flown_flight
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.scenario import Place, Scenario, load_scenario

PLACE = Place(latitude_deg=47.5, longitude_deg=19.05)
FRAME = LocalFrame(PLACE)
HEIGHT_M, SPEED_MPS, FAR_M = 20.0, 12.0, 180.0
RADIUS_M = 5.9
"""Of the waypoints: at 12 m/s a second is longer than a sphere is wide at its edge."""

STARTS_M = ((0.0, 0.0), (0.0, 40.0))
WAYPOINTS_M = tuple((north, 3.0, -HEIGHT_M) for north in range(30, 170, 20))
_CORNERS = (
    (0.0, 0.0, 0.0), (0.0, 0.0, HEIGHT_M), (FAR_M, 0.0, HEIGHT_M), (0.0, 0.0, HEIGHT_M),
    (0.0, 0.0, 0.0),
)  # fmt: skip
_SPEEDS_MPS = (2.5, SPEED_MPS, SPEED_MPS, 1.0)
FLIES_S = sum(
    np.linalg.norm(np.subtract(b, a)) / speed
    for a, b, speed in zip(_CORNERS, _CORNERS[1:], _SPEEDS_MPS, strict=False)
)
"""From the ground to the ground, out and back over the waypoints."""


def mission(obstacles=(), uas=2):
    """A scenario of waypoints in a row to the north."""
    data = load_scenario("open_field").model_dump(mode="json", by_alias=True)
    corners = [(n, e, d) for n in (-100.0, 300.0) for e in (-100.0, 200.0) for d in (-120.0, 0.0)]
    data["geofence"]["vertices_m"] = corners
    data |= {"obstacles": list(obstacles), "moving_obstacles": [], "decorations": []}
    data |= {"place": PLACE.model_dump(), "max_steps": 400}
    data["waypoints"] = [
        {"position_m": place, "radius_m": RADIUS_M, "weight": 1.0} for place in WAYPOINTS_M
    ]
    data["uas"] = data["uas"][:uas]
    for table, (north, east) in zip(data["uas"], STARTS_M, strict=False):
        table["start_m"] = [north, east, -1.0]
    return Scenario.model_validate_json(json.dumps(data))


def plan(**changes):
    """A flight of it that was planned; where its UAS were to fly does not matter here."""
    return rollout(mission(**changes), load_planner("hover"), 0, max_steps=2)


def places_m(times_s, begins_s=0.0, east_m=0.0):
    """(N, 3) north, east, height [m] of a vehicle that takes off at a time."""
    at_s, found = 0.0, []
    for a, b, speed in zip(_CORNERS, _CORNERS[1:], _SPEEDS_MPS, strict=False):
        found.append((at_s, a))
        at_s += float(np.linalg.norm(np.subtract(b, a))) / speed
    found.append((at_s, _CORNERS[-1]))
    knots_s, knots_m = np.array([t for t, _ in found]), np.array([c for _, c in found])
    flown_s = np.asarray(times_s) - begins_s
    flown = np.stack([np.interp(flown_s, knots_s, column) for column in knots_m.T], axis=1)
    return flown + np.array([0.0, east_m, 0.0])


def geodetic(flown_m):
    """(N, 3) degrees and metres of north, east, height."""
    return FRAME.to_geodetic(flown_m * np.array([1.0, 1.0, -1.0]))


def logged(times_s, flown_m, uas="uas_1", **more):
    """A log of a flight."""
    places = geodetic(flown_m)
    return Logged(uas, np.asarray(times_s, float), *places.T, **more)


def judged(logs, numbers=None, **changes):
    """What becomes of logs, of one UAS or by name."""
    logs = {"uas_1": logs} if isinstance(logs, Logged) else logs
    return flown_flight(plan(uas=len(logs), **changes), logs, FRAME, numbers)


def said(made):
    """All notes, in a text."""
    return "\n".join(made.notes)
