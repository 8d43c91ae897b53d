"""Walls with gaps: walls up to the ceiling that are passed through their gaps alone."""

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import (
    CEILING_M,
    GAP_M,
    Rng,
    Size,
    Square,
    Wanted,
    outline,
    prism,
    tag,
)
from uas_coverage_env.scenario.fields import Obstacle
from uas_coverage_env.scenario.model import Scenario

_PITCH_M = 52.0
_THICK_M = 4.0
_WIDER_M = 10.0
_FIELD_M = 70.0  # between two walls, at the least


def walls(rng: Rng, size: Size) -> Scenario:
    """Fields one behind the other; each wall between two has one gap, or two."""
    n_uas, n_waypoints = size.draw(rng)
    square = Square.at_pitch(n_uas, n_waypoints, _PITCH_M)
    side_m = square.side_m
    n_walls = max(1, min(3, int(side_m // _FIELD_M) - 1))
    pieces: list[Obstacle] = []
    for k in range(n_walls):
        east_m = square.west_m + side_m * (k + 1 + rng.uniform(-0.1, 0.1)) / (n_walls + 1)
        pieces += _wall(rng, f"wall_{k + 1}", east_m, side_m)
    wanted = [Wanted(place) for place in square.spread_places(rng, n_waypoints)]
    return square.site(pieces).scenario(rng, f"walls-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"walls": Family(walls)}


def _wall(rng: Rng, name: str, east_m: float, side_m: float) -> list[Obstacle]:
    """The pieces that stand between the gaps of a wall."""
    two = side_m > 6.0 * GAP_M and rng.uniform() < 0.5
    middles = rng.uniform(0.15, 0.40 if two else 0.85, size=1).tolist()
    if two:
        middles += rng.uniform(0.60, 0.85, size=1).tolist()
    edges = [0.0]
    for middle in middles:
        wide_m = GAP_M + rng.uniform(0.0, _WIDER_M)
        edges += [middle * side_m - 0.5 * wide_m, middle * side_m + 0.5 * wide_m]
    edges.append(side_m)
    span = (east_m - 0.5 * _THICK_M, east_m + 0.5 * _THICK_M)
    return [
        prism(f"{name}_{i + 1}", "wall", outline((edges[2 * i], edges[2 * i + 1]), span), CEILING_M)
        for i in range(len(edges) // 2)
    ]
