"""Options that every MILP-MPC takes."""

from collections.abc import Mapping
from copy import copy
from dataclasses import fields
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from uas_coverage_baselines.margins import MarginM, Margins, MovingMarginM, margins_in
from uas_coverage_baselines.milp_mpc.model.named_blocks import block_named
from uas_coverage_baselines.milp_mpc.model.problem import Weights
from uas_coverage_baselines.milp_mpc.solvers import solver_named
from uas_coverage_env.flight import PlannerOptions
from uas_coverage_env.mission import MissionBrief


def weight(default: float, what: str) -> Any:
    """A cost coefficient of the objective as an option."""
    return Field(default=default, ge=0.0, le=1000.0, description=f"weight {what}")


def with_default(model: type[PlannerOptions], name: str, default: Any) -> Any:
    """An option of a model with another default, for a model that derives from it."""
    field = copy(model.model_fields[name])
    field.default = default
    return field


def _split(text: Any) -> Any:
    """A list of names as it is typed: A,B; nothing, or none, is no name."""
    if not isinstance(text, str):
        return text
    names = (part.strip() for part in text.split(","))
    return tuple(name for name in names if name not in ("", "none"))


def _endless(text: Any) -> Any:
    return None if text == "inf" else _unless_none(text)


def _unless_none(text: Any) -> Any:
    return None if text == "none" else text


TimeLimitS = Annotated[float | None, BeforeValidator(_endless)]
"""A limit as it is typed: seconds, or none."""

UnlessNone = BeforeValidator(_unless_none)
"""Of an option that may be typed as none."""


class OcpOptions(PlannerOptions):
    """What the OCP of every MILP-MPC takes; the defaults are the paper's table and our tuning."""

    GONE: ClassVar[Mapping[str, str]] = {
        "deterministic": "every flight repeats unless time_limit_s is given, so leave it out",
        "moving_acceleration_mps2": "a larger moving_margin_m keeps away from what may set off",
        "moving_speed_mps": "a larger moving_margin_m keeps away from what may set off",
    }

    solver: Literal["highs", "scip", "gurobi"] = Field(default="highs", description="MILP solver")
    horizon: int = Field(default=18, ge=8, le=60, description="N, steps of the prediction")
    obstacle_sides: int = Field(default=8, ge=4, le=32, multiple_of=2, description="H_O")
    waypoint_sides: int = Field(default=4, ge=4, le=16, multiple_of=4, description="H_WP")
    margin_m: MarginM = None
    moving_margin_m: MovingMarginM = None
    in_wind: Literal["guidance", "wrenches"] = Field(
        default="guidance",
        description="how to fly where bounds of wind or vehicles are stated: along the order by "
        "the world's guidance, or by plans as in still air",
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

    def margins(self, brief: MissionBrief) -> Margins:
        """What is added to clearances in a mission."""
        return margins_in(brief, self.margin_m, self.moving_margin_m, sampled=True)

    @model_validator(mode="before")
    @classmethod
    def _gone(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("in_wind") == "tube":
            raise ValueError(
                "in_wind = 'tube' went after version 0.3.0; give in_wind=guidance, which takes "
                "less energy and keeps as much"
            )
        return given

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

    @property
    def form(self) -> dict[str, Any]:
        """How the OCP is approximated: fields of `PlanningProblem`; others have their default."""
        return {"obstacle_sides": self.obstacle_sides, "waypoint_sides": self.waypoint_sides}


class MovingHorizonOptions(OcpOptions):
    """What a MILP-MPC in real time takes."""

    effort: float = Field(
        default=1.0,
        gt=0.0,
        le=1000.0,
        description="work per decision, the same on every machine; 1 takes about 1 s of a core, or "
        "a step where that is shorter",
    )
    time_limit_s: TimeLimitS = Field(
        default=None,
        gt=0.0,
        le=3600.0,
        description="wall clock at which a decision ends all the same [s]; none: never",
    )
    threads: int = Field(
        default=2, ge=1, le=64, description="programs solved side by side; changes no flight"
    )
    limit_sides: int = Field(
        default=16,
        ge=4,
        le=64,
        multiple_of=4,
        description="H_P of the polygons inside the limits of speed, tilt and tilt rate",
    )
    teams: int = Field(
        default=6, ge=1, le=20, description="constructed teams whose flights are refined"
    )
    at_once: int = Field(
        default=64,
        ge=1,
        le=64,
        description="most UAS planned in one decision; the others continue with their plans",
    )

    @property
    def form(self) -> dict[str, Any]:
        """How the OCP is approximated."""
        return super().form | {"limit_sides": self.limit_sides}


class ModeOptions(OcpOptions):
    """What a MILP-MPC takes whose targets are chosen by operation modes, as the paper's are."""

    priority_per_s: float = Field(
        default=0.15,
        ge=0.0,
        le=10.0,
        description="added to a waypoint's weight per second that covering it saves later",
    )
    return_rule: Annotated[Literal["waypoints", "vehicle"] | None, UnlessNone] = Field(
        default="waypoints",
        description="D_r,max: the way home by an open waypoint, or the vehicle file's return_rule; "
        "none: the vehicle's for a UAS that lands where it starts, else by an open waypoint",
    )
    return_detour: float = Field(
        default=1.5,
        ge=1.0,
        le=20.0,
        description="D_r,max over the quickest way to a waypoint and home (rule waypoints)",
    )
    target_scale: Literal["fixed", "candidates"] = Field(
        default="fixed",
        description="what normalises a transit target's costs: 100 m, 40 m and half a turn, or "
        "the largest among the candidates",
    )
    return_scale: Literal["horizon", "distance"] = Field(
        default="horizon",
        description="what normalises the way home: the distance; or, while waypoints are covered "
        "on the way, at least the distance flown in N steps",
    )
    weight_transit: float = weight(Weights.transit, "of the way to a transit target")
    weight_return_home: float = weight(Weights.return_home, "of the way home")
    weight_home_per_m_max: float = weight(
        Weights.home_per_m_max, "of a metre from home in a step, at most"
    )
