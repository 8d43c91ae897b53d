"""Margins that planners with programs add to clearances, as options."""

from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.vehicle.scale import length_scale

_MARGIN_M, _MOVING_MARGIN_M = 0.3, 3.0  # at scale 1
_CHANGE_MPS = 3.0  # of velocity, between two samples
_LONGEST_S = 1.0  # of a sample for which it is kept from


def _derived(text: Any) -> Any:
    return None if text == "none" else text


MarginM = Annotated[
    float | None,
    Field(
        ge=0.0,
        le=10.0,
        description="added to every clearance, for the path between samples [m]; none: "
        f"{_MARGIN_M:g} m, in proportion for vehicles that stop in less or more than 25 to 30 m",
    ),
    BeforeValidator(_derived),
]

MovingMarginM = Annotated[
    float | None,
    Field(
        ge=0.0,
        le=50.0,
        description="added for a moving obstacle's next change of velocity [m]; none: "
        f"{_MOVING_MARGIN_M:g} m, likewise; of the MILP planners no less than 3 m/s times a step",
    ),
    BeforeValidator(_derived),
]


class Margins(NamedTuple):
    """What a planner adds in a mission [m]."""

    fixed_m: float
    moving_m: float


def margins_in(
    brief: MissionBrief, fixed_m: float | None, moving_m: float | None, *, sampled: bool = False
) -> Margins:
    """The margins that are given, or that follow from the vehicles of a mission.

    Args:
        brief: The mission.
        fixed_m: Option `margin_m`.
        moving_m: Option `moving_margin_m`.
        sampled: Whether nothing else covers that what moves changes its velocity by 3 m/s until the
            next sample; how far that leads has nothing to do with the size of the fleet.
    """
    scale = length_scale(brief.vehicles, brief.dt_s)
    least_m = _CHANGE_MPS * min(brief.dt_s, _LONGEST_S) if sampled else 0.0
    return Margins(
        _MARGIN_M * scale if fixed_m is None else fixed_m,
        max(_MOVING_MARGIN_M * scale, least_m) if moving_m is None else moving_m,
    )
