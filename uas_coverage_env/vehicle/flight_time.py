"""How long and how far a vehicle flies on its own battery, in still air."""

from collections.abc import Callable
from typing import NamedTuple

from uas_coverage_env.vehicle import derived
from uas_coverage_env.vehicle.battery import (
    BatterySegment,
    BatteryState,
    battery_current_A,
    battery_segments,
    steady_current_A,
)
from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.thrust_correction import level_flight_N

_STEP_S = 1.0


class Cruise(NamedTuple):
    """Level flight at v_cruise_mps, from full to dod_max."""

    power_W: float
    time_min: float
    range_km: float


class SteadySpeed(NamedTuple):
    """A level speed and the exact power there."""

    speed_mps: float
    power_W: float


class Endurance(NamedTuple):
    """What follows from a vehicle's parts, to be compared with what is known of it."""

    thrust_to_weight: float
    hover_current_A: float
    """At dod_max."""
    hover_min: float
    """From full to empty."""
    hover_usable_min: float
    """From full to dod_max."""
    cruise_lpv: Cruise
    """With the power of the LPV model, which is never below that of a hover."""
    cruise_nonlinear: Cruise
    longest: SteadySpeed
    """At which it stays in the air the longest."""
    farthest: SteadySpeed
    """At which a charge leads the farthest, within v_xy_max_mps."""


def endurance(vehicle: VehicleParams) -> Endurance:
    """Hover and level flight of a vehicle."""
    battery, power, speed_mps = vehicle.battery, vehicle.power, vehicle.limits.v_cruise_mps

    def cruise(power_W: float) -> Cruise:
        time_s = flight_time_s(vehicle, power_W, battery.dod_max)
        return Cruise(power_W, time_s / 60.0, 1e-3 * speed_mps * time_s)

    extra_N = vehicle.thrust_correction.speed_N_per_mps * speed_mps
    exact_N = vehicle.weight_N + level_flight_N(vehicle, speed_mps)
    return Endurance(
        thrust_to_weight=vehicle.thrust_max_N / vehicle.weight_N,
        hover_current_A=steady_current_A(battery, battery.dod_max, power.hover_W),
        hover_min=flight_time_s(vehicle, power.hover_W, 1.0) / 60.0,
        hover_usable_min=flight_time_s(vehicle, power.hover_W, battery.dod_max) / 60.0,
        cruise_lpv=cruise(power.hover_W + power.slope_W_per_N * extra_N),
        cruise_nonlinear=cruise(derived.power_W(vehicle, exact_N)),
        longest=_best_speed(vehicle, lambda flown: flown.power_W),
        farthest=_best_speed(vehicle, lambda flown: flown.power_W / flown.speed_mps),
    )


def _best_speed(vehicle: VehicleParams, cost: Callable[[SteadySpeed], float]) -> SteadySpeed:
    """The speed up to v_xy_max_mps with the least cost, in steps of a hundredth of that."""
    speeds = [0.01 * n * vehicle.limits.v_xy_max_mps for n in range(1, 101)]
    flown = [
        SteadySpeed(
            speed, derived.power_W(vehicle, vehicle.weight_N + level_flight_N(vehicle, speed))
        )
        for speed in speeds
    ]
    return min(flown, key=cost)


def flight_time_s(vehicle: VehicleParams, power_W: float, dod_end: float) -> float:
    """Time for which a full battery gives a power, as in the nonlinear plant [s].

    Args:
        vehicle: parameters.
        power_W: [W] drawn throughout.
        dod_end: depth of discharge at which the time ends, in (0, 1].
    """
    resistance_ohm = vehicle.battery.resistance_0_ohm

    def current_A(segment: BatterySegment, state: BatteryState) -> float:
        open_V = segment.ocv_V - segment.ocv_slope_V * state.dod
        return battery_current_A(open_V - sum(state.pairs_V), resistance_ohm, power_W)

    return _time_s(vehicle, current_A, dod_end)


def linearised_hover_time_s(vehicle: VehicleParams, dod_end: float) -> float:
    """Time for which a full battery holds a hover, as in the LPV model [s].

    Args:
        vehicle: parameters.
        dod_end: depth of discharge at which the time ends, in (0, 1].
    """

    def current_A(segment: BatterySegment, state: BatteryState) -> float:
        drop_V = segment.ocv_slope_V * state.dod + sum(state.pairs_V) - segment.drop_V
        return segment.current_A + segment.current_A_per_V * drop_V

    return _time_s(vehicle, current_A, dod_end)


def _time_s(
    vehicle: VehicleParams,
    current_A: Callable[[BatterySegment, BatteryState], float],
    dod_end: float,
) -> float:
    """Steps of the battery under the current of its state, the last of a segment up to its end."""
    battery = vehicle.battery
    state, time_s = BatteryState.rested(battery, 0.0), 0.0
    for segment in battery_segments(vehicle):
        end = min(segment.dod_end, dod_end)
        while state.dod < end:
            current = current_A(segment, state)
            step_s = min(_STEP_S, (end - state.dod) * 3600.0 * battery.capacity_Ah / current)
            state = state.after(battery, current, step_s)
            if step_s < _STEP_S:
                state = state._replace(dod=end)
            time_s += step_s
    return time_s
