"""What a UAS that needs a target sees: the one table that kernel, network and policy files share.

Times and lengths are told in units of the scenario: `unit_m` is the mean distance of a waypoint
from its nearest neighbour, `unit_s` the time to fly it. So one policy serves towns of any size.
Nothing depends on where north is, or on the order of the fleet.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.observation import Feature
from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.files.blocks import numbered
from uas_coverage_env.planning.reserves import LEARNED_LEG

LAYOUT = "waypoint_v1"

K = 10
"""Open waypoints to choose from, nearest first along the routes; the last choice is home."""

HOME_CHOICE = K

CRUISE_SHARE = LEARNED_LEG.speed_share
"""Of the top speed: what legs of some tens of metres are flown at."""


@dataclass(frozen=True)
class Number(Feature):
    """One number of the observation.

    Attributes:
        over: What it is divided by: a number, a unit, or both; "" where it is told as it is.
    """

    over: str = ""

    @property
    def scale(self) -> tuple[float, int]:
        """The number of `over`, and its unit: 0 for none, 1 for `unit_m`, 2 for `unit_s`."""
        words = self.over.split()
        number = float(words[0]) if words and words[0].isdecimal() else 1.0
        return number, _UNITS.get(words[-1], 0) if words else 0


_UNITS = {"unit_m": 1, "unit_s": 2}


def _number(name: str, over: str, high: float, meaning: str, low: float = 0.0) -> Number:
    return Number(name, 1, low, high, f"{meaning} / {over}" if over else meaning, over)


TEAM = Group(
    "team",
    1,
    (
        _number("speed", "", 1.5, "horizontal, over the top speed"),
        _number("way_home", "20 unit_s", 3, "time to fly home"),
        _number("margin", "300 s", 2, "flying time to spare after flying home now", -1),
        _number("time_left", "500 s", 2, "of the mission"),
        _number("open", "25", 4, "open waypoints"),
        _number("share", "15", 4, "open waypoints per covering UAS"),
        _number("mates", "4", 2, "other UAS that cover"),
        _number("alone", "", 1, "1 where no other UAS covers"),
        _number("away", "4", 2, "other UAS on their way home"),
        _number(
            "blocked", "", 1, "share of the open waypoints inside of a moving obstacle's keep-out"
        ),
        _number("mates_margin", "300 s", 2, "least flying time to spare among the covering mates"),
        _number("nearest_mate", "5 unit_m", 3, "distance to the nearest covering mate"),
        _number("total", "600 s", 4, "flying time of all, if each goes on greedily"),
        _number("longest", "300 s", 4, "longest of these flights"),
        _number("left", "5", 3, "waypoints that no battery reaches then"),
        _number("home_total", "5 unit_s", 3, "change of total if this UAS goes home now", -3),
        _number("home_longest", "5 unit_s", 3, "change of longest if this UAS goes home now", -3),
        _number("home_left", "5", 3, "change of left if this UAS goes home now", -3),
        _number("spread", "3 unit_m", 3, "mean distance of the open waypoints from their centre"),
        _number("centre", "5 unit_m", 3, "distance to that centre"),
    ),
)

CANDIDATE = Group(
    "candidate",
    K,
    (
        _number("there", "", 1, "1 where there is one; else all is 0"),
        _number("way", "2 unit_m", 6, "route past the obstacles"),
        _number("time", "2 unit_s", 6, "time to fly it, turning first"),
        _number("turn", "unit_s", 3, "of which for turning"),
        _number("home", "20 unit_s", 3, "time to fly home from there"),
        _number("margin", "300 s", 2, "flying time to spare after that", -1),
        _number("blocked", "", 1, "1 inside of a moving obstacle's keep-out now"),
        _number("claimed", "", 1, "1 where a mate flies to it"),
        _number("next", "unit_s", 3, "flying time to its nearest open neighbour"),
        _number("after_next", "unit_s", 3, "to its second nearest"),
        _number("near", "6", 2, "open waypoints within 1.6 unit_s"),
        _number("around", "15", 2, "open waypoints within 3 unit_s"),
        _number("remote", "5 unit_s", 3, "mean flying time to the open waypoints"),
        _number("lead", "3 unit_s", 3, "how much later the first mate could be there", -3),
        _number("outside", "5 unit_m", 3, "distance from the centre of the open waypoints"),
        _number("total", "2 unit_s", 5, "flying time of all if it comes next, over the best"),
        _number("longest", "2 unit_s", 5, "longest flight if it comes next, over the best"),
        _number("left", "5", 3, "waypoints that no battery reaches then, over the fewest"),
        _number("first", "", 1, "1 for the one whose time total + longest is best"),
        _number("ahead", "", 1, "cosine between the velocity and the first leg", -1),
    ),
)

N_TEAM = TEAM.size
N_CANDIDATE = CANDIDATE.size // K
OBSERVATION_SIZE = TEAM.size + CANDIDATE.size

TEAM_AT = numbered((feature.name for feature in TEAM.features), range(N_TEAM))
"""The column of each number by its name, for kernels too."""

CANDIDATE_AT = numbered((feature.name for feature in CANDIDATE.features), range(N_CANDIDATE))
"""The same, from the first column of a candidate on."""

WAY = CANDIDATE_AT.way
"""Column of a candidate's `way`: the greedy prior of the network reads it."""


LOW, HIGH, SCALE, UNIT = range(4)
"""Columns of the tables below; the last two are a `Number.scale`."""


def _table(group: Group) -> NDArray[np.float64]:
    return np.array([(f.low, f.high, *f.scale) for f in group.features if isinstance(f, Number)])


TEAM_TABLE = _table(TEAM)
"""(N_TEAM, 4) bounds and scale of each number."""

CANDIDATE_TABLE = _table(CANDIDATE)
"""(N_CANDIDATE, 4) the same of a candidate."""
