"""Options that every MILP-MPC takes."""

from dataclasses import fields
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator

from uas_coverage_baselines.milp_mpc.model.named_blocks import block_named
from uas_coverage_baselines.milp_mpc.model.problem import Weights
from uas_coverage_baselines.milp_mpc.solvers import solver_named
from uas_coverage_env.flight import PlannerOptions


def weight(default: float, what: str) -> Any:
    """A cost coefficient of the objective as an option."""
    return Field(default=default, ge=0.0, le=1000.0, description=f"weight {what}")


def _split(text: Any) -> Any:
    """A list of names as it is typed: A,B; nothing, or none, is no name."""
    if not isinstance(text, str):
        return text
    names = (part.strip() for part in text.split(","))
    return tuple(name for name in names if name not in ("", "none"))


class MovingHorizonOptions(PlannerOptions):
    """What every MILP-MPC takes; the defaults are the paper's table and our tuning."""

    time_limit_s: float = Field(
        default=1.0, gt=0.0, le=3600.0, description="wall clock per decision"
    )
    threads: int = Field(default=2, ge=1, le=64, description="programs solved side by side")
    horizon: int = Field(default=18, ge=8, le=60, description="N, steps of the prediction")
    solver: Literal["highs", "scip", "gurobi"] = Field(default="highs", description="MILP solver")
    deterministic: bool = Field(
        default=False,
        description="limit work by nodes, not by the clock: the same seed flies the same",
    )
    limit_sides: int = Field(
        default=16,
        ge=4,
        le=64,
        multiple_of=4,
        description="H_P of the polygons inside the limits of speed, tilt and tilt rate",
    )
    obstacle_sides: int = Field(default=8, ge=4, le=32, multiple_of=2, description="H_O")
    waypoint_sides: int = Field(default=4, ge=4, le=16, multiple_of=4, description="H_WP")
    margin_m: float = Field(
        default=0.3,
        ge=0.0,
        le=10.0,
        description="added to every clearance, for the path between samples",
    )
    moving_margin_m: float = Field(
        default=3.0,
        ge=0.0,
        le=50.0,
        description="added for a moving obstacle's next change of velocity",
    )
    teams: int = Field(
        default=6, ge=1, le=20, description="constructed teams whose flights are refined"
    )
    at_once: int = Field(
        default=64,
        ge=1,
        le=64,
        description="UAS planned anew in a decision, at most; the others go on with their plans",
    )
    blocks: Annotated[tuple[str, ...], BeforeValidator(_split)] = Field(
        default=(),
        description="added to the OCP: names (entry points) or MODULE:CLASS, separated by commas",
    )
    weight_lift: float = weight(Weights.lift, "of the lift")
    weight_torque: float = weight(Weights.torque, "of the torques")
    weight_rate: float = weight(Weights.rate, "of the angular rates")
    weight_yaw: float = weight(Weights.yaw, "of the yaw angle")
    weight_energy: float = weight(Weights.energy, "of the charge taken")
    weight_climb: float = weight(Weights.climb, "of the climb rate")

    @property
    def weights(self) -> Weights:
        """The cost coefficients; those that are no option have their default."""
        named = {one.name: getattr(self, f"weight_{one.name}", None) for one in fields(Weights)}
        return Weights(**{name: value for name, value in named.items() if value is not None})

    @field_validator("solver")
    @classmethod
    def _installed(cls, name: str) -> str:
        solver_named(name)
        return name

    @field_validator("blocks")
    @classmethod
    def _found(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for name in names:
            block_named(name)
        return names
