"""Wind: its table. What it does follows from the vehicle (docs/wind_and_models.md)."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    model_serializer,
    model_validator,
)

from uas_coverage_env.features.dryden import turbulence
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.features.gusts import discrete_gusts, random_gusts
from uas_coverage_env.features.steady_wind import mean_wind
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.files.strict_toml import StrictModel

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

    def features(self) -> Iterator[MissionFeature]:
        """The mean comes first: turbulence is flown through with the airspeed in it."""
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
