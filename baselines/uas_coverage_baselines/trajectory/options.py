"""Options of `trajectory`."""

from __future__ import annotations

from pydantic import Field

from uas_coverage_baselines.margins import MarginM, MovingMarginM
from uas_coverage_env.flight import PlannerOptions


class TrajectoryOptions(PlannerOptions):
    """Options of `trajectory`."""

    orders: int = Field(
        default=3,
        ge=1,
        le=100,
        description="orders searched before take-off; one where more than 8 UAS fly",
    )
    planned_orders: int = Field(
        default=1,
        ge=1,
        le=100,
        description="of these orders, how many are planned in full before take-off",
    )
    moves: int = Field(
        default=300_000,
        ge=0,
        description="changes tried in each search; up to six times as many for large fleets",
    )
    programs: int = Field(
        default=150, ge=0, description="programs solved to shorten one UAS's flight, about"
    )
    idle_work: int = Field(
        default=450,
        ge=0,
        le=100_000,
        description="work on a better plan in each later decision, in steps of planned "
        "flights; 0: none",
    )
    weight_energy: float = Field(
        default=0.6,
        ge=0.0,
        le=100.0,
        description="weight of a second of each UAS's flight against one of the mission; "
        "more than four UAS share the weight of four",
    )
    speed_share: float = Field(
        default=1.0,
        ge=0.2,
        le=1.0,
        description="highest speed flown, as a share of the largest horizontal speed",
    )
    margin_m: MarginM = None
    moving_margin_m: MovingMarginM = None
    threads: int = Field(
        default=2,
        ge=1,
        le=64,
        description="searches and UAS planned in parallel; plans stay the same",
    )
