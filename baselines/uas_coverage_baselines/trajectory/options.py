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
        description="of these, so many get flights before take-off, the cheapest first",
    )
    moves: int = Field(
        default=300_000,
        ge=0,
        description="changes tried in each search; up to six times as many for large fleets",
    )
    programs: int = Field(
        default=150, ge=0, description="programs solved to make one UAS's flight shorter, about"
    )
    idle_work: int = Field(
        default=450,
        ge=0,
        le=100_000,
        description="steps of flights looked for in each later decision, to improve the plan "
        "while flying; 0: none",
    )
    weight_energy: float = Field(
        default=0.6,
        ge=0.0,
        le=100.0,
        description="worth of a second of each UAS's flight against one of the mission; "
        "of more than four UAS, of four seconds shared by all",
    )
    speed_share: float = Field(
        default=1.0,
        ge=0.2,
        le=1.0,
        description="of the largest horizontal speed: so fast is flown at most",
    )
    margin_m: MarginM = 0.3
    moving_margin_m: MovingMarginM = 3.0
    threads: int = Field(
        default=2,
        ge=1,
        le=64,
        description="searches and UAS planned side by side; plans stay the same",
    )
