"""R6: every kind of event, at a drawn time of a drawn mission, ends as `docs/faults.md` defines."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from robustness_rows.row import Finding, Result, Row, Trial, errors, markdown, share
from uas_coverage_env import Scenario, generate_scenario, load_planner, rollout
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.metrics import accomplished, home

FIRST_SEED = 7000
PLANNERS = ("nearest-waypoint", "tour", "trajectory", "learned-velocity")

Rng = np.random.Generator
Made = tuple[dict[str, Any], dict[str, Any]]
"""Fields of the event, and what of the scenario changes for it."""


def _uas(rng: Rng, scenario: Scenario) -> str:
    return scenario.uas[int(rng.integers(len(scenario.uas)))].name


def _free_m(rng: Rng, scenario: Scenario, away_m: float) -> tuple[float, float]:
    """A place (north, east) in the fence's middle, this far from the starts."""
    corners_m = scenario.fence.vertices_m[:, :2]
    low_m, high_m = corners_m.min(axis=0) + 25.0, corners_m.max(axis=0) - 25.0
    starts_m = np.array([uas.start_m[:2] for uas in scenario.uas])
    for _ in range(1000):
        place_m = rng.uniform(low_m, high_m)
        if np.linalg.norm(starts_m - place_m, axis=1).min() > away_m:
            return round(float(place_m[0]), 1), round(float(place_m[1]), 1)
    raise RuntimeError("no place is free")


def _block_m(rng: Rng, scenario: Scenario) -> list[tuple[float, float, float]]:
    north_m, east_m = _free_m(rng, scenario, 50.0)
    half_m, top_m = float(rng.uniform(4.0, 10.0)), float(rng.uniform(10.0, 35.0))
    return [
        (north_m + n * half_m, east_m + e * half_m, down_m)
        for n in (-1, 1)
        for e in (-1, 1)
        for down_m in (0.0, -top_m)
    ]


def _mover(rng: Rng, scenario: Scenario) -> tuple[dict[str, Any], tuple[float, ...]]:
    place_m = (*_free_m(rng, scenario, 60.0), -25.0)
    return {"name": "helicopter", "radius_m": 4.0, "height_m": 5.0, "safe_distance_m": 3.0}, place_m


def _velocity_mps(rng: Rng, speed_mps: float = 2.0) -> tuple[float, float, float]:
    turn = float(rng.uniform(0.0, 2.0 * np.pi))
    return round(speed_mps * np.cos(turn), 2), round(speed_mps * np.sin(turn), 2), 0.0


def _radio(rng: Rng, scenario: Scenario) -> Made:
    fields = {"uas": _uas(rng, scenario), "for_s": round(float(rng.uniform(5.0, 90.0)), 1)}
    return fields | {"then": str(rng.choice(["go_on", "hover", "return"]))}, {}


def _added(rng: Rng, scenario: Scenario) -> Made:
    return {"position_m": (*_free_m(rng, scenario, 20.0), -42.0), "radius_m": 6.0}, {}


def _zone(rng: Rng, scenario: Scenario) -> Made:
    return {"name": "new", "safe_distance_m": 2.0, "vertices_m": _block_m(rng, scenario)}, {}


def _block(rng: Rng, scenario: Scenario) -> Made:
    waypoints_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    for _ in range(1000):
        made = _zone(rng, scenario)
        corners_m = np.array(made[0]["vertices_m"])
        inside = (waypoints_m >= corners_m.min(axis=0)) & (waypoints_m <= corners_m.max(axis=0))
        if not inside.all(axis=1).any():
            return made
    raise RuntimeError("no place is free")


def _appears(rng: Rng, scenario: Scenario) -> Made:
    body, place_m = _mover(rng, scenario)
    return {**body, "position_m": place_m, "velocity_mps": _velocity_mps(rng)}, {}


def _turns(rng: Rng, scenario: Scenario) -> Made:
    body, place_m = _mover(rng, scenario)
    before = {"from_s": 0.0, "velocity_mps": _velocity_mps(rng)}
    obstacle = {**body, "start_m": place_m, "schedule": [before]}
    event = {"moving_obstacle": "helicopter", "velocity_mps": _velocity_mps(rng)}
    return event, {"moving_obstacles": [obstacle]}


def _closed(rng: Rng, scenario: Scenario) -> Made:
    uas = scenario.uas[int(rng.integers(len(scenario.uas)))]
    north_m, east_m, down_m = uas.start_m
    starts_m = np.array([other.start_m[:2] for other in scenario.uas])
    for _ in range(1000):  # along the row of starts, but beside all of them
        other_m = np.array((north_m, east_m)) + rng.uniform(-30.0, 30.0, 2)
        inside = float(scenario.fence.signed_distance([(*other_m, -10.0)])[0]) < -5.0
        if inside and np.linalg.norm(starts_m - other_m, axis=1).min() > 8.0:
            return {"uas": uas.name, "alternative_m": (*np.round(other_m, 1).tolist(), down_m)}, {}
    raise RuntimeError("no place is free")


def _motor(rng: Rng, scenario: Scenario) -> Made:
    share_, factor = round(float(rng.uniform(0.85, 1.0)), 3), round(float(rng.uniform(1, 1.3)), 3)
    return {"uas": _uas(rng, scenario), "thrust_share": share_, "power_factor": factor}, {}


def _all_home(flight: Flight) -> bool:
    return bool(home(flight).all()) and not flight.violations


def _rest_home(flight: Flight) -> bool:
    """Whether all have landed that no event took away."""
    taken = [event.uas for event in flight.events if event.kind == "uas_lost"]
    landed = zip(flight.names, home(flight), strict=True)
    return all(there or name in taken for name, there in landed) and not flight.violations


KINDS: Mapping[str, tuple[Callable[[Rng, Scenario], Made], Callable[[Flight], bool], str]] = {
    "uas_lost": (lambda r, s: ({"uas": _uas(r, s)}, {}), accomplished, "accomplished"),
    "radio_lost": (_radio, accomplished, "accomplished"),
    "planner_lost": (
        lambda r, s: ({"then": str(r.choice(["go_on", "hover", "return"]))}, {}),
        _all_home,
        "all land",
    ),
    "gnss_lost": (
        lambda r, s: ({"uas": _uas(r, s), "for_s": 30.0, "drift_mps": 0.1}, {}),
        _all_home,
        "all land",
    ),
    "late_start": (lambda r, s: ({"uas": _uas(r, s)}, {}), accomplished, "accomplished"),
    "motor_degraded": (_motor, _all_home, "all land"),
    "charge_lost": (
        lambda r, s: ({"uas": _uas(r, s), "share": round(float(r.uniform(0.05, 0.3)), 3)}, {}),
        _all_home,
        "all land",
    ),
    "waypoint_dropped": (
        lambda r, s: ({"waypoint": int(r.integers(len(s.waypoints)))}, {}),
        accomplished,
        "accomplished",
    ),
    "waypoint_added": (_added, accomplished, "accomplished"),
    "obstacle_added": (_block, _all_home, "all land"),
    "no_fly_zone": (_zone, _all_home, "all land"),
    "moving_obstacle_added": (_appears, _all_home, "all land"),
    "moving_obstacle_turns": (_turns, _all_home, "all land"),
    "home_closed": (_closed, accomplished, "accomplished, landed at the alternative"),
}
"""Kind -> what is drawn of it, whether a flight ended as defined, and that in words."""

SEVERAL = "several, in wind"
"""In place of a kind: two or three events of different kinds, in light or moderate wind."""

ENDS: Mapping[str, tuple[Callable[[Flight], bool], str]] = {
    **{kind: (as_defined, words) for kind, (_, as_defined, words) in KINDS.items()},
    SEVERAL: (_rest_home, "all land that no event takes"),
}
"""Kind -> whether a flight ended as defined, and that in words."""


def mission(kind: str, seed: int) -> Scenario:
    """A small town in which the event happens once; of SEVERAL, two or three events in wind."""
    rng = np.random.default_rng([seed, *kind.encode()])
    level = str(rng.choice(["light", "moderate"])) if kind == SEVERAL else None
    town = generate_scenario(seed, n_uas=2, n_waypoints=10, n_obstacles=4, disturbances=level)
    kinds = [kind]
    if kind == SEVERAL:
        kinds = rng.choice(list(KINDS), int(rng.integers(2, 4)), replace=False).tolist()
    # a landed UAS takes off again for what a lost one leaves
    data: dict[str, Any] = {**town.model_dump(by_alias=True), "relaunch": True, "events": []}
    for each in kinds:
        event, changes = _event(each, rng, town)
        data |= changes
        data["events"].append(event)
    return Scenario.model_validate(data)


def _event(kind: str, rng: Rng, town: Scenario) -> Made:
    """A table `[[events]]`, and what of the scenario changes for it."""
    fields, changes = KINDS[kind][0](rng, town)
    # what appears, appears while UAS are near their starts still, far from it
    soon = kind in ("obstacle_added", "moving_obstacle_added")
    at_s = float(rng.integers(2, 5) if soon else rng.integers(3, 60))
    if "name" in fields:
        fields["name"] = kind
    return {"kind": kind, "at_s": at_s, **fields}, changes


def fly(kind: str, planner: str, seed: int) -> Result:
    """One mission with its event; a UAS that has nothing to cover may have landed before."""
    flight = rollout(
        mission(kind, seed), load_planner(planner), seed, return_mode=True, safety_filter=True
    )
    return {
        "kind": kind,
        "planner": planner,
        "happened": bool(flight.events),
        "as_defined": ENDS[kind][0](flight),
        "contacts": [[v.kind, v.partner, v.uas, v.time_s] for v in flight.violations],
        "breaches": flight.breaches,
        "steps": flight.steps,
    }


def trials(quick: bool) -> list[Trial]:
    """Every kind with every planner."""
    seeds = {"nearest-waypoint": (3, 100)}
    return [
        Trial(f"{kind} {planner} {seed}", fly, (kind, planner, seed))
        for planner in PLANNERS
        for kind in ENDS
        for seed in range(FIRST_SEED, FIRST_SEED + seeds.get(planner, (1, 25))[not quick])
    ]


def finding(results: Mapping[str, Result]) -> Finding:
    """Per kind and planner, in how many missions it ended as defined."""
    cells: dict[tuple[str, str], list[Result]] = defaultdict(list)
    for result in results.values():
        if "error" not in result:
            cells[result["kind"], result["planner"]].append(result)
    rows = []
    for kind, (_, words) in ENDS.items():
        mine = [one for planner in PLANNERS for one in cells[kind, planner]]
        if mine:
            shares = [
                f"{sum(one['as_defined'] for one in cells[kind, p])} of {len(cells[kind, p])}"
                for p in PLANNERS
            ]
            failed = sum(not one["as_defined"] for one in mine)
            name = kind if kind == SEVERAL else f"`{kind}`"
            rows.append([name, words, *shares, share(failed, len(mine))])
    headings = ["kind", "what must happen", *(f"`{planner}`" for planner in PLANNERS), "otherwise"]
    failed = sum(not one["as_defined"] for many in cells.values() for one in many)
    return Finding(len(results), failed + len(errors(results)), markdown(headings, rows))


ROW = Row(
    "R6",
    "Faults and changes of the mission",
    "missions",
    "the outcome that `docs/faults.md` defines for the kind, and no violation",
    trials,
    finding,
    lambda quick: (
        f"towns of two UAS and ten waypoints from {FIRST_SEED} on; the seed draws when, "
        "which UAS and how bad"
    ),
    "Single events in wind, strong wind, and losses of charge or thrust that no UAS could survive. "
    "Return mode and safety filter are on. Breaches are not counted here: a zone that is closed "
    "round a UAS is one until it is left. All missions have `relaunch = true`: a UAS that has "
    "landed takes off again for waypoints that another one, lost later, leaves open. A limit "
    "exceeded counts as a failure even where the fault is the cause.",
)
