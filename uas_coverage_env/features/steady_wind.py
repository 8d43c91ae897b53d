"""Mean wind, the same at all times, and over height constant or by a profile.

What it does follows from the vehicle: it flies in moving air, with the drag, the trim tilt and the
power of its velocity relative to the air (see `vehicle.air`).
"""

import math
from typing import Any

from uas_coverage_env.compiled.kernels import inlined_kernel, interpreted, kernel
from uas_coverage_env.features.feature import Disturbance
from uas_coverage_env.features.true_vehicles import true_vehicle
from uas_coverage_env.vehicle import layout as S

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
        parameters[_LAW], parameters[_VALUE], parameters[_REFERENCE_M], -state.x[i, S.Z]
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


def mean_wind(wind: Any) -> Disturbance:
    """The mean of the wind of a scenario."""
    law, value = _profile(wind)
    plain = constant_wind(wind.mean_mps, wind.from_deg, wind.up_mps)
    if law == CONSTANT and wind.power == "fitted":
        return plain
    rotor_power = wind.power == "rotor"
    more = (float(law), value, wind.reference_height_m, float(rotor_power))
    return Disturbance("wind", blow, (*plain.parameters, *more), perturbs=rotor_power)


def mean_wind_mps(wind: Any, height_m: float) -> float:
    """Horizontal speed of the mean wind at a height above ground [m/s]."""
    share = interpreted(profile_share)(*_profile(wind), wind.reference_height_m, height_m)
    return wind.mean_mps * share


def _profile(wind: Any) -> tuple[int, float]:
    if wind.roughness_m is not None:
        return LOGARITHMIC, wind.roughness_m
    if wind.exponent is not None:
        return POWER_LAW, wind.exponent
    return CONSTANT, 0.0
