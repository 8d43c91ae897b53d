"""R11: the battery of recorded flights against an integration of its differential equations."""

from __future__ import annotations

import csv
import tempfile
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown
from uas_coverage_env import Scenario, generate_scenario, load_planner, load_vehicle, rollout
from uas_coverage_env.entities.codes import DynamicsName

FIRST_SEED = 13000
MOST_DOD, MOST_V, MOST_WH = 1e-6, 0.1, 1e-3
"""The largest deviations that are claimed: of the depth of discharge, of the voltage [V], and of
the energy [share]."""

CASES: Mapping[str, tuple[DynamicsName, str]] = {
    "LPV model": ("lpv", "s500_v2"),
    "6-DOF plant": ("nonlinear", "s500_v2"),
    "hexacopter": ("lpv", "hexacopter"),
}
"""Name -> dynamics and vehicle."""


def replay(case: str, seed: int) -> Result:
    """One flight: its recorded currents through the equations of the Thevenin battery.

    d DoD / dt = I / (3600 C), du/dt = (R_th I - u) / tau, V = OCV(DoD) - u - R_0 I: by an
    integrator for stiff equations (SciPy's Radau), from the first row of the record to its last.

    Args:
        case: One of `CASES`.
        seed: Of the mission.
    """
    dynamics, vehicle = CASES[case]
    town = generate_scenario(seed, n_uas=1, n_waypoints=12, n_obstacles=4)
    fleet = tuple(uas.model_copy(update={"vehicle": vehicle}) for uas in town.uas)
    town = Scenario.model_validate(town.model_dump(by_alias=True) | {"uas": fleet})
    flight = rollout(town, load_planner("nearest-waypoint"), seed, dynamics=dynamics)
    with tempfile.TemporaryDirectory() as folder:
        flight.save(Path(folder) / "flight")
        with (Path(folder) / "flight" / "flight.csv").open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    names = ("t_s", "dod", "u_th_V", "voltage_V", "current_A")
    time_s, dod, u_th, volt, ampere = (np.array([float(r[k]) for r in rows]) for k in names)
    battery = load_vehicle(vehicle).battery
    state, deviations, energy_Wh = np.array([dod[0], u_th[0]]), [], 0.0
    for k in range(len(rows) - 1):
        span = time_s[k], time_s[k + 1]
        ocv = float(np.interp(state[0], battery.ocv_dod, battery.ocv_V))
        expected_V = ocv - state[1] - battery.resistance_0_ohm * ampere[k]
        deviations.append((abs(state[0] - dod[k]), abs(expected_V - volt[k])))
        energy_Wh += expected_V * ampere[k] * (span[1] - span[0]) / 3600.0

        def slope(_: float, y: np.ndarray, current: float = float(ampere[k])) -> list[float]:
            charge = current / (3600.0 * battery.capacity_Ah)
            polarises = battery.resistance_th_ohm * current - y[1]
            return [charge, polarises / battery.time_constant_th_s]

        state = solve_ivp(slope, span, state, method="Radau", rtol=1e-10, atol=1e-12).y[:, -1]
    recorded_Wh = float((volt[:-1] * ampere[:-1] * np.diff(time_s)).sum() / 3600.0)
    off_dod, off_V = np.max(deviations, axis=0).tolist()
    off_Wh = abs(energy_Wh / recorded_Wh - 1.0)
    return {"case": case, "dod": off_dod, "V": off_V, "Wh": off_Wh, "steps": len(rows) - 1}


def trials(quick: bool) -> list[Trial]:
    """Flights of both dynamics and both vehicles."""
    seeds = range(FIRST_SEED, FIRST_SEED + (4 if quick else 60))
    return [Trial(f"{case} {seed}", replay, (case, seed)) for case in CASES for seed in seeds]


def _is_off(one: Result) -> bool:
    return one["dod"] > MOST_DOD or one["V"] > MOST_V or one["Wh"] > MOST_WH


def finding(results: Mapping[str, Result]) -> Finding:
    """A flight has failed where one of the deviations is larger than claimed."""
    cases: dict[str, list[Result]] = defaultdict(list)
    for one in results.values():
        if "error" not in one:
            cases[one["case"]].append(one)
    rows = [
        [
            case,
            len(cases[case]),
            sum(one["steps"] for one in cases[case]),
            *(f"{max(one[k] for one in cases[case]):.1e}" for k in ("dod", "V", "Wh")),
        ]
        for case in CASES
        if cases[case]
    ]
    headings = ("flights", "how many", "steps", "depth of discharge", "voltage, V", "energy, share")
    failed = sum(map(_is_off, [one for many in cases.values() for one in many]))
    return Finding(len(results), failed + len(errors(results)), markdown(headings, rows))


ROW = Row(
    "R11",
    "Battery against an integration of its equations",
    "flights",
    f"over a whole flight, the recorded depth of discharge is off by at most {MOST_DOD:g}, the "
    f"voltage by {MOST_V:g} V, the energy by {MOST_WH:.1%}, from what SciPy makes of the recorded "
    "currents by the differential equations",
    trials,
    finding,
    lambda quick: (
        f"towns of one UAS and twelve waypoints from {FIRST_SEED} on, flown by `nearest-waypoint`; "
        "the table has the largest deviations"
    ),
    "Measured batteries: `tests/paper` compares with the published curves. What current a power "
    "takes is the model's own.",
)
