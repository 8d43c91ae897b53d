"""Wind: its table, and its mean, the same at all times, over height constant or by a profile.

What it does follows from the vehicle: it flies in moving air, with the drag, the trim tilt and the
power of its velocity relative to the air (see `vehicle.air` and docs/wind_and_models.md).
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    model_serializer,
    model_validator,
)

from uas_coverage_env.compiled.kernels import inlined_kernel, interpreted, kernel
from uas_coverage_env.features.feature import Disturbance, Feature
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.features.true_vehicles import true_vehicle
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.vehicle import Z

Gust_mps = Annotated[float, Field(gt=0.0, le=60.0)]
GustLength_s = Annotated[float, Field(gt=0.0, le=600.0)]
Direction_deg = Annotated[float, Field(ge=0.0, le=360.0)]


class Gust(StrictModel):
    """A discrete gust: it rises and falls once, as 1 - cos, at the same time everywhere.

    Attributes:
        at_s: When it begins [s].
        lasts_s: How long it lasts [s].
        peak_mps: Horizontal speed that it adds at its peak [m/s].
        from_deg: Where it comes from, clockwise from north [degrees].
        up_mps: Upward speed that it adds at its peak [m/s].
    """

    at_s: Annotated[float, Field(ge=0.0, le=1e6)]
    lasts_s: GustLength_s
    peak_mps: Annotated[float, Field(ge=0.0, le=60.0)]
    from_deg: Direction_deg
    up_mps: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0


class RandomGusts(StrictModel):
    """Gusts of the mean wind at random times, the same for all UAS, never two at a time.

    Attributes:
        per_min: How many begin in a minute in which none blows, on average [1/min].
        peak_mps: The largest peak; of each gust it is drawn uniformly from 0 to this [m/s].
        lasts_s: How long each lasts [s].
    """

    per_min: Annotated[float, Field(gt=0.0, le=60.0)]
    peak_mps: Gust_mps
    lasts_s: GustLength_s


class Wind(FeatureTable):
    """Wind, unknown to planners.

    Attributes:
        mean_mps: Horizontal speed of the air, or its mean [m/s].
        from_deg: Where it comes from, clockwise from north [degrees]: 270 is a west wind, which
            blows towards the east.
        up_mps: Vertical speed of the air, positive upward [m/s].
        reference_height_m: Above ground, where the speed is `mean_mps`, with a profile [m].
        roughness_m: Roughness length of a logarithmic profile; without it and `exponent`, the
            speed is the same at all heights [m].
        exponent: Exponent of a power-law profile [-].
        turbulence: Intensity of Dryden turbulence, as a multiple of MIL-F-8785C [-].
        gusts: Discrete gusts.
        random_gusts: Gusts at random times; without it, none.
        power: In the LPV model, "fitted" takes the power of all airspeeds from the vehicle's
            fitted thrust correction, "rotor" from the rotor model where that needs more; the
            nonlinear plant always flies the rotor model.
    """

    table: ClassVar[str] = "wind"

    mean_mps: Annotated[float, Field(ge=0.0, le=60.0)]
    from_deg: Direction_deg
    up_mps: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0
    reference_height_m: Annotated[float, Field(ge=1.0, le=1000.0)] = 10.0
    roughness_m: Annotated[float, Field(ge=1e-5, le=0.5)] | None = None
    exponent: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    turbulence: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
    gusts: Annotated[tuple[Gust, ...], Strict(False), Field(max_length=100)] = ()
    random_gusts: RandomGusts | None = None
    power: Literal["fitted", "rotor"] = "fitted"

    def features(self) -> Iterator[Feature]:
        """The mean comes first: turbulence is flown through with the airspeed in it."""
        # these files know the table
        from uas_coverage_env.features.dryden import turbulence
        from uas_coverage_env.features.gusts import discrete_gusts, random_gusts

        unsteady = bool((self.turbulence and self.mean_mps) or self.gusts or self.random_gusts)
        if self.mean_mps or self.up_mps or (unsteady and self.power == "rotor"):
            yield mean_wind(self)
        if self.turbulence and self.mean_mps:
            yield turbulence(self)
        if self.gusts:
            yield discrete_gusts(self)
        if self.random_gusts is not None:
            yield random_gusts(self)

    @model_validator(mode="after")
    def _has_one_profile(self) -> Self:
        if self.roughness_m is not None and self.exponent is not None:
            raise ValueError(
                f"roughness_m is {self.roughness_m:g} and exponent is {self.exponent:g}; a profile "
                "is logarithmic or a power law, take one away"
            )
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_off(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # files are those of scenarios before these fields
        data = serialise(self)
        for name, field in type(self).model_fields.items():
            if name != "up_mps" and not field.is_required() and data[name] == field.default:
                data.pop(name)
        if not self.gusts:
            data.pop("gusts", None)
        return data


LOWEST_M = 1.0
"""Below, the wind of a profile is that of this height [m]."""

CONSTANT, LOGARITHMIC, POWER_LAW = range(3)

_LAW, _VALUE, _REFERENCE_M, _ROTOR_POWER = range(3, 7)  # parameters after the velocity, see `blow`


@kernel
def profile_share(law, value, reference_m, height_m):
    """Mean wind at a height, as a share of that at the reference height.

    Args:
        law: CONSTANT, LOGARITHMIC or POWER_LAW.
        value: Roughness length [m], or exponent.
        reference_m: [m] above ground.
        height_m: [m] above ground.
    """
    height_m = max(height_m, LOWEST_M)
    if law == LOGARITHMIC:
        return math.log(height_m / value) / math.log(reference_m / value)
    if law == POWER_LAW:
        return (height_m / reference_m) ** value
    return 1.0


@inlined_kernel
def _blow_by_profile(state, outcome, i, parameters):
    event = outcome[i]
    share = profile_share(
        parameters[_LAW], parameters[_VALUE], parameters[_REFERENCE_M], -state.x[i, Z]
    )
    for axis in range(2):
        event.wind_mps[axis] += share * parameters[axis]
    event.wind_mps[2] += parameters[2]
    if parameters[_ROTOR_POWER] != 0.0:
        true_vehicle(state, i).rotor_power = True


@kernel
def blow(arena, state, outcome, i, parameters, memory, random):
    """Add the wind.

    Parameters: its velocity, NED [m/s]; where there are more, those of `profile_share`, and whether
    the LPV model takes its power from the rotor model.
    """
    event = outcome[i]
    if parameters.shape[0] > _LAW:
        _blow_by_profile(state, outcome, i, parameters)
        return
    for axis in range(3):
        event.wind_mps[axis] += parameters[axis]


def wind_velocity_mps(
    mean_mps: float, from_deg: float, up_mps: float = 0.0
) -> tuple[float, float, float]:
    """The velocity of the air, NED [m/s].

    Args:
        mean_mps: Horizontal speed.
        from_deg: Where the wind comes from, clockwise from north [degrees]: 270 is a west wind,
            which blows towards the east.
        up_mps: Vertical speed, upward.
    """
    towards_rad = math.radians(from_deg + 180.0)
    return (mean_mps * math.cos(towards_rad), mean_mps * math.sin(towards_rad), -up_mps)


def constant_wind(mean_mps: float, from_deg: float, up_mps: float = 0.0) -> Disturbance:
    """Constant wind; arguments as for `wind_velocity_mps`, and as in the table `[wind]`."""
    return Disturbance("wind", blow, wind_velocity_mps(mean_mps, from_deg, up_mps))


def mean_wind(wind: Wind) -> Disturbance:
    """The mean of the wind of a scenario."""
    law, value = _profile(wind)
    plain = constant_wind(wind.mean_mps, wind.from_deg, wind.up_mps)
    if law == CONSTANT and wind.power == "fitted":
        return plain
    rotor_power = wind.power == "rotor"
    more = (float(law), value, wind.reference_height_m, float(rotor_power))
    return Disturbance("wind", blow, (*plain.parameters, *more), perturbs=rotor_power)


def mean_wind_mps(wind: Wind, height_m: float) -> float:
    """Horizontal speed of the mean wind at a height above ground [m/s]."""
    share = interpreted(profile_share)(*_profile(wind), wind.reference_height_m, height_m)
    return wind.mean_mps * share


def _profile(wind: Wind) -> tuple[int, float]:
    if wind.roughness_m is not None:
        return LOGARITHMIC, wind.roughness_m
    if wind.exponent is not None:
        return POWER_LAW, wind.exponent
    return CONSTANT, 0.0
