"""What the tube of a stated wind is made of, and how much of it a tighter bound could save.

    python benchmarks/tube_sources.py
    python benchmarks/tube_sources.py --vehicle hexacopter --level moderate

Per level, metres that a UAS of the velocity loop may be off its prediction after so many seconds:

- *tube*: what clearances grow by (`vehicle/tube.py`): every wind that departs by no more than
  stated, at its worst in every step;
- its parts by the two terms of what is stated, turbulence and gusts, each alone;
- *gust*: the largest gust of the level at its worst moment, flown through the loop, exact;
- *turbulence*: two standard deviations of what Dryden turbulence leads to, from its covariance, at
  the airspeed and height given;
- *position held*: the tube, were the position fed back as well (`milp_mpc/in_wind.py`) against a
  belief that is held, and the share of the angular acceleration that this may take.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from uas_coverage_baselines.milp_mpc.in_wind import position_gain

from uas_coverage_env import generate_scenario
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS
from uas_coverage_env.vehicle import VehicleParams, load_vehicle
from uas_coverage_env.vehicle.governor import design_velocity_loop, horizontal_axis
from uas_coverage_env.vehicle.layout import POSITION, RATE, SPEED
from uas_coverage_env.vehicle.tube import belief_gain, tube_of

FloatArray = NDArray[np.float64]

SECONDS = (1, 2, 3, 5, 8, 14)
_FEET = 0.3048
_LONG = 400

_BELIEF, _WIND, _FIRST_BELIEF, _ALL = range(RATE + 1, RATE + 5)
"""What follows the states of an axis in that of an error: the belief of the wind beyond the first
one, the wind, the first belief; and how many there are."""


def loop(vehicle: VehicleParams, dt_s: float) -> tuple[FloatArray, FloatArray]:
    """Map of an error and the belief, and what a wind of 1 m/s does to them (see `_BELIEF`)."""
    A, B = horizontal_axis(vehicle, dt_s)
    _, k_tilt, _ = gain = design_velocity_loop(vehicle, dt_s).gain
    closed = np.zeros((_WIND, _WIND))
    closed[:_BELIEF, :_BELIEF] = A - np.outer(B, [0.0, *gain])
    closed[:_BELIEF, _BELIEF] = -B * k_tilt * vehicle.trim_tilt_rad_per_mps
    closed[_BELIEF, _BELIEF] = 1.0 - belief_gain(dt_s)
    return closed, np.append(_by_wind(A, dt_s), belief_gain(dt_s))


def _by_wind(A: FloatArray, dt_s: float) -> FloatArray:
    """What an unknown wind of 1 m/s does to the states of an axis in a step."""
    carried = -A[:, SPEED]
    carried[POSITION] += dt_s
    carried[SPEED] += 1.0
    return carried


def off_m(vehicle: VehicleParams, dt_s: float, wind_mps: FloatArray, steps: int) -> FloatArray:
    """Largest error (steps + 1,) of predictions that begin anywhere in a wind, known till then."""
    closed, by_wind = loop(vehicle, dt_s)
    most_m, belief = np.zeros(steps + 1), 0.0
    for start in range(len(wind_mps) - steps):
        error = np.zeros(_WIND)
        for k in range(steps):
            error = closed @ error + by_wind * (wind_mps[start + k] - belief)
            most_m[k + 1] = max(most_m[k + 1], abs(error[POSITION]))
        belief += belief_gain(dt_s) * (wind_mps[start] - belief)
    return most_m


def gust_mps(lasts_s: float, phase_s: float, dt_s: float, steps: int) -> FloatArray:
    """The mean over each step of a gust of 1 m/s that comes after as many steps of none."""
    times_s = np.clip((np.arange(3 * steps + 1) - steps) * dt_s + phase_s, 0.0, lasts_s)
    turn = 2.0 * math.pi / lasts_s
    return np.diff(0.5 * (times_s - np.sin(turn * times_s) / turn)) / dt_s


def turbulence_m(vehicle: VehicleParams, dt_s: float, scale_s: float, steps: int) -> FloatArray:
    """Two standard deviations (steps + 1,) of the error in turbulence along the wind of 1 m/s.

    Args:
        vehicle: Parameters.
        dt_s: Length of a step [s].
        scale_s: Length scale over airspeed [s].
        steps: How far.
    """
    closed, by_wind = loop(vehicle, dt_s)
    gain, kept = belief_gain(dt_s), math.exp(-dt_s / scale_s)
    # wind and belief, stationary
    ahead = np.array([[kept, 0.0], [gain, 1.0 - gain]])
    drawn = np.diag([1.0 - kept * kept, 0.0])
    both = np.zeros((2, 2))
    for _ in range(_LONG):
        both = ahead @ both @ ahead.T + drawn
    # error and belief of it (5), wind, and the belief with which the prediction begins
    step = np.zeros((_ALL, _ALL))
    step[:_WIND, :_WIND] = closed
    step[:_WIND, _WIND], step[:_WIND, _FIRST_BELIEF] = by_wind, -by_wind
    step[_WIND, _WIND], step[_FIRST_BELIEF, _FIRST_BELIEF] = kept, 1.0
    noise = np.zeros((_ALL, _ALL))
    noise[_WIND, _WIND] = drawn[0, 0]
    covariance, result = np.zeros((_ALL, _ALL)), [0.0]
    covariance[_WIND:, _WIND:] = both
    for _ in range(steps):
        covariance = step @ covariance @ step.T + noise
        result.append(2.0 * math.sqrt(covariance[POSITION, POSITION]))
    return np.array(result)


def held(vehicle: VehicleParams, dt_s: float, steps: int) -> tuple[FloatArray, float]:
    """The tube (steps + 1,) with the position fed back, and its angular acceleration, per m/s."""
    A, B = horizontal_axis(vehicle, dt_s)
    gain = position_gain(vehicle, dt_s)
    response = _by_wind(A, dt_s)
    total, alpha, result = 0.0, 0.0, [0.0]
    for _ in range(_LONG):
        total, alpha = total + abs(response[0]), alpha + abs(float(gain @ response))
        result.append(total)
        response = (A - np.outer(B, gain)) @ response
    return np.array(result[: steps + 1]), alpha


def main(
    vehicle: Annotated[str, typer.Option(help="Which vehicle.")] = "s500_v2",
    level: Annotated[str, typer.Option(help="Which level; all.")] = "all",
    height_m: Annotated[float, typer.Option(help="Of the turbulence.")] = 20.0,
    airspeed_mps: Annotated[float, typer.Option(help="Through it.")] = 12.0,
) -> None:
    """Print a table for each level."""
    flown, dt_s, steps = load_vehicle(vehicle), 1.0, SECONDS[-1]
    feet = height_m / _FEET
    scale_s = feet / (0.177 + 0.000823 * feet) ** 1.2 * _FEET / airspeed_mps
    tube = tube_of(flown, dt_s, steps, learns=True)
    tight, alpha = held(flown, dt_s, steps)
    rest_m = turbulence_m(flown, dt_s, scale_s, steps)
    for name in DISTURBANCE_LEVELS if level == "all" else (level,):
        scenario = generate_scenario(1, n_uas=1, n_waypoints=4, n_obstacles=0, disturbances=name)
        stated, wind = scenario.conditions, scenario.wind
        assert stated is not None
        assert wind is not None
        assert wind.random_gusts is not None
        gust = wind.random_gusts
        of_gust_mps = 0.65 * gust.peak_mps
        of_turbulence_mps = math.sqrt(stated.unknown_mps**2 - of_gust_mps**2)
        worst_m = np.max(
            [
                off_m(flown, dt_s, gust_mps(gust.lasts_s, phase_s, dt_s, steps), steps)
                for phase_s in np.arange(0.0, dt_s, 0.1)
            ],
            axis=0,
        )
        rows = {
            "tube": stated.unknown_mps * tube.position,
            "its turbulence alone": of_turbulence_mps * tube.position,
            "its gust alone": of_gust_mps * tube.position,
            "gust at its worst moment": gust.peak_mps * worst_m,
            "turbulence, 2 standard deviations": 0.5 * of_turbulence_mps * rest_m,
            "tube, position held": stated.unknown_mps * tight,
        }
        print(
            f"{name}: {stated.unknown_mps:.2f} m/s unknown, of turbulence {of_turbulence_mps:.2f}"
        )
        print(
            f"| m after s | {' | '.join(str(s) for s in SECONDS)} |\n|---|{'---|' * len(SECONDS)}"
        )
        for what, values in rows.items():
            print(f"| {what} | {' | '.join(f'{values[s]:.1f}' for s in SECONDS)} |")
        most = flown.limits.angular_acceleration_xy_max_radps2
        print(
            f"position held takes {stated.unknown_mps * alpha / most:.0%} of the angular "
            f"acceleration, the velocity loop {stated.unknown_mps * tube.alpha / most:.0%}\n"
        )


if __name__ == "__main__":
    typer.run(main)
