"""What a UAS that needs a target sees: the one table that kernel, network and policy files share.

Times and lengths are told in units of the scenario: `unit_m` is the mean distance of a waypoint
from its nearest neighbour, `unit_s` the time to fly it. So one policy serves towns of any size.
Nothing depends on where north is, or on the order of the fleet.
"""

import numpy as np

from uas_coverage_env.env.observation import Feature, Group

LAYOUT = "waypoint_v1"

K = 10
"""Open waypoints to choose from, nearest first along the routes; the last choice is home."""

HOME_CHOICE = K

CRUISE_SHARE = 0.8
"""Of the top speed: what legs of some tens of metres are flown at."""


def _number(name: str, high: float, meaning: str, low: float = 0.0) -> Feature:
    return Feature(name, 1, low, high, meaning)


TEAM = Group(
    "team",
    1,
    (
        _number("speed", 1.5, "horizontal, over the top speed"),
        _number("way_home", 3, "time to fly home / 20 unit_s"),
        _number("margin", 2, "flying time to spare after flying home now / 300 s", -1),
        _number("time_left", 2, "of the mission / 500 s"),
        _number("open", 4, "open waypoints / 25"),
        _number("share", 4, "open waypoints per covering UAS / 15"),
        _number("mates", 2, "other UAS that cover / 4"),
        _number("alone", 1, "1 where no other UAS covers"),
        _number("away", 2, "other UAS on their way home / 4"),
        _number("blocked", 1, "share of the open waypoints inside of a moving obstacle's keep-out"),
        _number("mates_margin", 2, "least flying time to spare among the covering mates / 300 s"),
        _number("nearest_mate", 3, "distance to the nearest covering mate / 5 unit_m"),
        _number("total", 4, "flying time of all, if each goes on greedily / 600 s"),
        _number("longest", 4, "longest of these flights / 300 s"),
        _number("left", 3, "waypoints that no battery reaches then / 5"),
        _number("home_total", 3, "change of total if this UAS goes home now / 5 unit_s", -3),
        _number("home_longest", 3, "change of longest if this UAS goes home now / 5 unit_s", -3),
        _number("home_left", 3, "change of left if this UAS goes home now / 5", -3),
        _number("spread", 3, "mean distance of the open waypoints from their centre / 3 unit_m"),
        _number("centre", 3, "distance to that centre / 5 unit_m"),
    ),
)

CANDIDATE = Group(
    "candidate",
    K,
    (
        _number("there", 1, "1 where there is one; else all is 0"),
        _number("way", 6, "route past the obstacles / 2 unit_m"),
        _number("time", 6, "time to fly it, turning first / 2 unit_s"),
        _number("turn", 3, "of which for turning / unit_s"),
        _number("home", 3, "time to fly home from there / 20 unit_s"),
        _number("margin", 2, "flying time to spare after that / 300 s", -1),
        _number("blocked", 1, "1 inside of a moving obstacle's keep-out now"),
        _number("claimed", 1, "1 where a mate flies to it"),
        _number("next", 3, "flying time to its nearest open neighbour / unit_s"),
        _number("after_next", 3, "to its second nearest / unit_s"),
        _number("near", 2, "open waypoints within 1.6 unit_s / 6"),
        _number("around", 2, "open waypoints within 3 unit_s / 15"),
        _number("remote", 3, "mean flying time to the open waypoints / 5 unit_s"),
        _number("lead", 3, "how much later the first mate could be there / 3 unit_s", -3),
        _number("outside", 3, "distance from the centre of the open waypoints / 5 unit_m"),
        _number("total", 5, "flying time of all if it comes next, over the best / 2 unit_s"),
        _number("longest", 5, "longest flight if it comes next, over the best / 2 unit_s"),
        _number("left", 3, "waypoints that no battery reaches then, over the fewest / 5"),
        _number("first", 1, "1 for the one whose time total + longest is best"),
        _number("ahead", 1, "cosine between the velocity and the first leg", -1),
    ),
)

N_TEAM = TEAM.size
N_CANDIDATE = CANDIDATE.size // K
OBSERVATION_SIZE = TEAM.size + CANDIDATE.size

WAY = 1
"""Column of a candidate's `way`: the greedy prior of the network reads it."""

TEAM_LOW = np.array([feature.low for feature in TEAM.features])
TEAM_HIGH = np.array([feature.high for feature in TEAM.features])
CANDIDATE_LOW = np.array([feature.low for feature in CANDIDATE.features])
CANDIDATE_HIGH = np.array([feature.high for feature in CANDIDATE.features])
