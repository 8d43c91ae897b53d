"""What is stated of a mission's wind and vehicles before it is flown: bounds, never what is drawn.

An operator knows up to which wind a fleet may fly, and how far its vehicles may be from their
files; neither the wind of the day nor the true vehicle. So the bounds are those of a level of wind
(light, moderate, strong), which all scenarios within that level have in common, and the table
`[uncertainty]`, which holds bounds and nothing else.
"""

import math
from typing import Annotated

from pydantic import Field

from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.wind import Wind
from uas_coverage_env.files.strict_toml import StrictModel

STATED_MPS = (4.0, 7.0, 10.0)
"""Mean winds up to which missions are flown, as the levels have them; beyond, each 5 m/s."""

_BEYOND_MPS = 5.0
_LOW_M = 6.1  # 20 ft, to which the intensities of MIL-F-8785C refer
_GUSTINESS = 0.18  # sigma_u over that wind, at a height of 20 m
_OF_TURBULENCE, _OF_A_GUST = 2.0, 0.65


class Conditions(StrictModel):
    """The stated bounds.

    Attributes:
        mean_mps: The mean wind is at most this [m/s].
        unknown_mps: The wind seldom departs by more than this from what a UAS has found out of it,
            within the time that braking takes [m/s].
        uncertainty: Bounds of the true vehicles; None: they are as their files say.
    """

    mean_mps: Annotated[float, Field(ge=0.0)]
    unknown_mps: Annotated[float, Field(ge=0.0)]
    uncertainty: Uncertainty | None = None

    @property
    def charge_share(self) -> float:
        """Of the flight time that the vehicles' files promise, what is left in the worst case."""
        bounds = self.uncertainty
        if bounds is None:
            return 1.0
        heavier = (1.0 + bounds.mass) ** 1.5  # of the induced power of a hover
        return (1.0 - bounds.capacity_lost) / ((1.0 + bounds.power) * heavier)


def conditions_of(wind: Wind | None, uncertainty: Uncertainty | None) -> Conditions | None:
    """What is stated of a mission with these tables; None where these change nothing."""
    uncertainty = None if uncertainty == Uncertainty() else uncertainty
    if wind is None and uncertainty is None:
        return None
    if wind is None:
        return Conditions(mean_mps=0.0, unknown_mps=0.0, uncertainty=uncertainty)
    mean_mps = _stated(wind.mean_mps)
    gusts_mps = [math.hypot(gust.peak_mps, gust.up_mps) for gust in wind.gusts]
    if wind.random_gusts is not None:
        gusts_mps.append(wind.random_gusts.peak_mps)
    turbulent_mps = wind.turbulence * _GUSTINESS * mean_mps * _low_share(wind)
    unknown_mps = math.hypot(
        _OF_TURBULENCE * turbulent_mps, _OF_A_GUST * max(gusts_mps, default=0.0)
    )
    if uncertainty is None and mean_mps == unknown_mps == wind.up_mps == 0.0:
        return None
    return Conditions(mean_mps=mean_mps, unknown_mps=unknown_mps, uncertainty=uncertainty)


def _stated(mean_mps: float) -> float:
    """The weakest wind up to which missions are flown and that is not exceeded."""
    if mean_mps == 0.0:
        return 0.0
    for stated_mps in STATED_MPS:
        if mean_mps <= stated_mps:
            return stated_mps
    return _BEYOND_MPS * math.ceil(mean_mps / _BEYOND_MPS)


def _low_share(wind: Wind) -> float:
    """The mean wind at 20 ft over that at the reference height."""
    if wind.roughness_m is not None:
        of_low, of_reference = (
            math.log(height_m / wind.roughness_m) for height_m in (_LOW_M, wind.reference_height_m)
        )
        return of_low / of_reference
    if wind.exponent is not None:
        return float((_LOW_M / wind.reference_height_m) ** wind.exponent)
    return 1.0
