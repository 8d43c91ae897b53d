"""R1: whole missions in still air and at the levels of wind and wrong models, per planner."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Mapping
from itertools import product

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown, share
from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished, coverage, energy_Wh, home
from uas_coverage_env.scenario import sample_scenario
from uas_coverage_env.scenario.families.generated import N_OBSTACLES, N_UAS, N_WAYPOINTS

LEVELS = ("still", "light", "moderate", "strong")
FIRST_SEED = 3000

_QUICKER = {"at_once": "1", "horizon": "12", "threads": "1"}
OPTIONS: Mapping[str, Mapping[str, str]] = {
    "nearest-waypoint": {},
    "lawnmower": {},
    "tour": {},
    "trajectory": {},
    "learned-velocity": {},
    "learned-route": {},
    "milp-mpc": _QUICKER,
}
"""Planner, and what tells its options apart -> options."""

# missions of each level: (quick, small of the full run, large of it)
_MISSIONS = {
    "tour": (6, 60, 10),
    "trajectory": (4, 60, 10),
    "learned-route": (1, 30, 5),
    "milp-mpc": (1, 15, 1),
}
_OTHERS = (30, 300, 300)

_LARGE = "; large: {} to {} UAS, {} to {} waypoints, {} to {} blocks".format(
    *N_UAS, *N_WAYPOINTS, *N_OBSTACLES
)

SMALL = ((1, 2), (8, 12), (3, 8))
"""Least and most UAS, waypoints and obstacles of the small missions; the large ones are those of
`sample_scenario`."""


def fly(planner: str, level: str, seed: int, small: bool) -> Result:
    """One mission: what there is to count.

    Args:
        planner: One of `OPTIONS`.
        level: One of `LEVELS`.
        seed: Of the generated scenario, and of the mission.
        small: Whether it is one of the quick missions.
    """
    disturbances = None if level == "still" else level
    if small:
        scenario = sample_scenario(seed, *SMALL, disturbances=disturbances)
    else:
        scenario = sample_scenario(seed, disturbances=disturbances)
    began = time.process_time()
    flight = rollout(scenario, load_planner(planner.split()[0], OPTIONS[planner]), seed)
    return {
        "planner": planner,
        "level": level,
        "seed": seed,
        "small": small,
        "uas": len(flight.names),
        "accomplished": accomplished(flight),
        "coverage": float(coverage(flight)),
        "home": int(home(flight).sum()),
        "steps": flight.steps,
        "energy_Wh": round(float(energy_Wh(flight).sum()), 3),
        "breaches": flight.breaches,
        "violations": [
            [v.kind, v.partner, v.uas, v.time_s, v.value, v.limit] for v in flight.violations
        ],
        "fallbacks": sum(decision.fallback for decision in flight.decisions),
        "cpu_s": round(time.process_time() - began, 2),
    }


def trials(quick: bool) -> list[Trial]:
    """Every planner at every level on the same missions, quick planners and small missions first.

    Within these, mission by mission: a run that is ended has as many of each level and planner.
    """
    result = []
    slowest = [planner for planner in OPTIONS if planner.startswith("milp-mpc")]
    slow = [planner for planner in OPTIONS if planner in _MISSIONS and planner not in slowest]
    others = [planner for planner in OPTIONS if planner not in _MISSIONS]
    quicker = product((True, False), (others, slow))
    for small, planners in (*quicker, (True, slowest), (False, slowest)):
        size, column = ("small", int(not quick)) if small else ("large", 2)
        many = {planner: _MISSIONS.get(planner, _OTHERS)[column] for planner in planners}
        if quick and not small:
            continue
        for number, planner, level in product(range(max(many.values())), planners, LEVELS):
            # where nothing is stated, the planner flies as it does without the option
            if number < many[planner] and (level != "still" or "in_wind" not in planner):
                seed = FIRST_SEED + number
                key = f"{planner} {level} {seed} {size}"
                result.append(Trial(key, fly, (planner, level, seed, small)))
    return result


def finding(results: Mapping[str, Result]) -> Finding:
    """Per level and planner; a mission with a violation has failed."""
    cells: dict[tuple[bool, str, str], list[Result]] = defaultdict(list)
    for result in results.values():
        if "error" not in result:
            cells[result["small"], result["level"], result["planner"]].append(result)
    order = [
        (small, level, planner)
        for small in (True, False)
        for level in LEVELS
        for planner in OPTIONS
    ]
    rows = [_line(*cell, cells[cell]) for cell in order if cells[cell]]
    headings = ("size", "level", "planner", "missions", "accomplished", "covered, %", "UAS lost")
    headings += ("missions with a limit exceeded", "breaches", "missions with breaches", "Wh")
    failed = sum(bool(one["violations"]) for many in cells.values() for one in many)
    failed += len(errors(results))
    return Finding(len(results), failed, markdown(headings, rows))


def _line(small: bool, level: str, planner: str, flown: list[Result]) -> list[object]:
    uas = sum(one["uas"] for one in flown)
    lost = Counter(kind for one in flown for kind, *_ in one["violations"] if kind != "limit")
    to_what = ", ".join(f"{kind} {count}" for kind, count in sorted(lost.items()))
    beyond = sum(any(kind == "limit" for kind, *_ in one["violations"]) for one in flown)
    return [
        "small" if small else "large",
        level,
        f"`{planner}`",
        len(flown),
        sum(one["accomplished"] for one in flown),
        f"{100.0 * sum(one['coverage'] for one in flown) / len(flown):.1f}",
        share(sum(lost.values()), uas) + (f" ({to_what})" if to_what else ""),
        beyond,
        sum(one["breaches"] for one in flown),
        share(sum(one["breaches"] > 0 for one in flown), len(flown)),
        f"{sum(one['energy_Wh'] for one in flown) / len(flown):.1f}",
    ]


ROW = Row(
    "R1",
    "Missions in still air, in wind, with wrong models",
    "missions",
    "no violation: no contact, no limit exceeded, no battery beyond its limit",
    trials,
    finding,
    lambda quick: (
        f"generated missions from {FIRST_SEED} on, the same for every level; small: 1 or 2 UAS, "
        "8 to 12 waypoints, 3 to 8 blocks" + _LARGE * (not quick)
    ),
    "Other families than `generated`, the nonlinear plant, and the MILP planner at its full "
    "effort. `milp-mpc` flies with "
    + " ".join(f"`{key}={value}`" for key, value in _QUICKER.items())
    + ".",
)
