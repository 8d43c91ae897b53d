"""What the numbers of an observation mean: the one table that the space and the docs come from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

K_WAYPOINTS = 12
"""Open waypoints in an observation, nearest first; the waypoint action chooses among them."""

K_UAS = 3
"""Other UAS in an observation, nearest first."""

K_MOVING = 2
"""Moving obstacles in an observation, nearest first."""

N_RAYS = 10
"""Eight horizontal rays from north over east, then up and down."""

NEARBY_M = 30.0
"""Distances d appear as 1/(1 + d/NEARBY_M): fine near by, coarse far away [m]."""

RAY_M = 80.0
"""How far a ray looks [m]."""

HEIGHT_M = 20.0
"""Scale of heights relative to the UAS, and of clearances [m]."""

FAR_M = 250.0
"""Scale of the way to the centre of what is left [m]."""

CROWD_M = 100.0
"""Open waypoints within this distance of a waypoint are its crowd [m]."""

CROWD = 8
"""Size of a full crowd."""

MARGIN = 0.3
"""Scale of energy margins, as depth of discharge."""

SCALES = {
    "nearby_m": NEARBY_M,
    "ray_m": RAY_M,
    "height_m": HEIGHT_M,
    "far_m": FAR_M,
    "crowd_m": CROWD_M,
    "crowd": float(CROWD),
    "margin": MARGIN,
}
"""All of the scales above by name: a policy that was trained with others sees another world."""


@dataclass(frozen=True)
class Feature:
    """Some numbers of an observation.

    Attributes:
        name: What they are.
        size: How many.
        low: Smallest value.
        high: Largest value; what lies beyond is clipped.
        meaning: In words, with scale.
    """

    name: str
    size: int
    low: float
    high: float
    meaning: str


@dataclass(frozen=True)
class Group:
    """Features that belong together, `repeats` times in a row.

    Attributes:
        name: Of what.
        repeats: How often all features follow one another.
        features: In order.
    """

    name: str
    repeats: int
    features: tuple[Feature, ...]

    @property
    def size(self) -> int:
        """How many numbers."""
        return self.repeats * sum(feature.size for feature in self.features)


def _flag(name: str, meaning: str) -> Feature:
    return Feature(name, 1, 0.0, 1.0, meaning)


_DIRECTION = "unit vector to it, north and east; 0 where it is straight above or below"

OBSERVATION_LAYOUT: tuple[Group, ...] = (
    Group(
        "own",
        1,
        (
            Feature(
                "position", 3, -1, 1, "north, east, up in the box around the fence; ±1: its sides"
            ),
            Feature("velocity", 3, -2, 2, "north, east, down / the vehicle's limits"),
            Feature("attitude", 3, -2, 2, "roll, pitch / tilt limit, yaw / yaw limit"),
            Feature("rates", 3, -2, 2, "body rates / the vehicle's limits"),
            Feature("reference", 2, -2, 2, "velocity that the inner loop tracks, as `velocity`"),
            _flag("flying", "1 while it flies, 0 once landed or lost"),
            _flag("departed", "1 once it has left its start: it may land there"),
            _flag("returning", "1 once return mode has taken over"),
            _flag("rank", "its place in the fleet, 0 the first, 1 the last"),
            _flag("dod", "depth of discharge"),
            Feature("polarisation", 1, -1, 1, "polarisation voltage of the battery / 1 V"),
            Feature("charge_left", 1, -1, 1, "(dod_max - dod) / dod_max"),
            Feature(
                "energy_margin",
                1,
                -1,
                1,
                "dod left at home if it flew there now at top speed / 0.3",
            ),
            _flag("time_left", "steps left / max_cycles"),
            _flag("uncovered", "share of the waypoints' weight still to be covered"),
        ),
    ),
    Group(
        "home",
        1,
        (
            Feature("direction", 2, -1, 1, "unit vector of the first leg home past obstacles"),
            _flag("closeness", "1/(1 + way home / 30 m)"),
            Feature("below", 1, -1, 1, "how far the start is below / 20 m"),
        ),
    ),
    Group(
        "remaining",
        1,
        (
            Feature("sectors", 8, 0, 1, "share of the open weight in 45° from north over east"),
            Feature("centre", 2, -1, 1, "north and east to the centre of the open weight / 250 m"),
        ),
    ),
    Group(
        "surroundings",
        1,
        (
            Feature(
                "rays",
                N_RAYS,
                0,
                1,
                "1 - free way / 80 m to obstacle or fence: N, NE, …, NW, up, down",
            ),
            Feature("clearance", 1, -1, 1, "clearance from the nearest fixed obstacle / 20 m"),
            Feature("fence", 1, -1, 1, "distance to the fence beyond its margin / 20 m"),
        ),
    ),
    Group(
        "waypoints",
        K_WAYPOINTS,
        (
            _flag("valid", "1 for an open waypoint; all are 0 where there is none"),
            Feature("direction", 2, -1, 1, _DIRECTION),
            _flag("closeness", "1/(1 + distance / 30 m)"),
            Feature("below", 1, -1, 1, "how far it is below / 20 m"),
            _flag("weight", "weight / heaviest of the scenario"),
            _flag("neighbour", "closeness of the open waypoint next to it"),
            _flag("crowd", "open waypoints within 100 m of it / 8, at most 1"),
            _flag("rival", "its closeness to the nearest other flying UAS"),
            _flag("taken", "1 where another UAS is on its way to it (waypoint action)"),
            _flag("from_home", "its closeness to the start"),
            Feature("energy_margin", 1, -1, 1, "dod left after visiting it and going home / 0.3"),
        ),
    ),
    Group(
        "others",
        K_UAS,
        (
            _flag("valid", "1 for a flying UAS; all are 0 where there is none"),
            Feature("direction", 2, -1, 1, _DIRECTION),
            _flag("closeness", "1/(1 + distance / 30 m)"),
            Feature("below", 1, -1, 1, "how far it is below / 20 m"),
            Feature("velocity", 2, -2, 2, "relative, north and east / own limit"),
            Feature("charge_left", 1, -1, 1, "its (dod_max - dod) / dod_max"),
        ),
    ),
    Group(
        "moving_obstacles",
        K_MOVING,
        (
            _flag("valid", "1 for a moving obstacle; all are 0 where there is none"),
            Feature("direction", 2, -1, 1, _DIRECTION),
            _flag("closeness", "1/(1 + clearance / 30 m)"),
            Feature("below", 1, -1, 1, "how far its centre is below / 20 m"),
            Feature("velocity", 3, -2, 2, "relative, north, east, down / own limits"),
        ),
    ),
)
"""The groups of an observation, in their order."""

OBSERVATION_SIZE = sum(group.size for group in OBSERVATION_LAYOUT)
"""Numbers in the observation of one UAS, the same in every scenario."""


def observation_bounds() -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The smallest and the largest value of every number of an observation.

    Returns:
        (low, high), each (OBSERVATION_SIZE,).
    """
    rows = [
        (feature.low, feature.high)
        for group in OBSERVATION_LAYOUT
        for _ in range(group.repeats)
        for feature in group.features
        for _ in range(feature.size)
    ]
    low, high = np.array(rows, dtype=np.float32).T
    return np.ascontiguousarray(low), np.ascontiguousarray(high)


def observation_columns(group_name: str, feature_name: str) -> NDArray[np.int64]:
    """Where a feature is in an observation.

    Args:
        group_name: As in `OBSERVATION_LAYOUT`.
        feature_name: As in that group.

    Returns:
        (repeats, size) indices.

    Raises:
        ValueError: There is no such feature.
    """
    start = 0
    for group in OBSERVATION_LAYOUT:
        width = group.size // group.repeats
        for feature in group.features:
            if (group.name, feature.name) == (group_name, feature_name):
                rows = start + width * np.arange(group.repeats)
                return rows[:, None] + np.arange(feature.size)
            start += feature.size
        start += width * (group.repeats - 1)
    known = ", ".join(f"{g.name}.{f.name}" for g in OBSERVATION_LAYOUT for f in g.features)
    raise ValueError(f"there is no feature {group_name}.{feature_name}; there are {known}")


def layout_table() -> str:
    """The layout as a Markdown table, one row per feature, with ranges of indices."""
    lines = ["| index | feature | min | max | meaning |", "|---|---|---|---|---|"]
    start = 0
    for group in OBSERVATION_LAYOUT:
        width = group.size // group.repeats
        for feature in group.features:
            index = str(start) if feature.size == 1 else f"{start}-{start + feature.size - 1}"
            if group.repeats > 1:
                index += f" + {width} k, k < {group.repeats}"
            bounds = f"{feature.low:g} | {feature.high:g}"
            lines.append(
                f"| {index} | {group.name}.{feature.name} | {bounds} | {feature.meaning} |"
            )
            start += feature.size
        start += width * (group.repeats - 1)
    return "\n".join(lines)
