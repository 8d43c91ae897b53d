"""Small missions for the planner, and ways to fly them."""

from itertools import product

import numpy as np
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.search.decision import Effort

from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import LIFT, TAU_X, TAU_Y, TAU_Z
from uas_coverage_env.world import Wrench

LITTLE = Effort(teams=4)


def corners(low, high):
    """The eight corners of a box."""
    return list(product(*zip(low, high, strict=True)))


def mission(waypoints, starts, **fields):
    """A field of 200 m with a ceiling at 50 m; waypoints are (position, radius)."""
    uas = [
        {
            "name": f"uas_{row + 1}",
            "vehicle": "s500_v2",
            "start_m": start,
            "soc_0": 1.0,
            "radius_m": 0.36,
            "dod_max": 0.75,
        }
        for row, start in enumerate(starts)
    ]
    data = {
        "schema": 1,
        "name": "practice",
        "dt_s": 1.0,
        "max_steps": 300,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
        "geofence": {
            "margin_m": 0.5,
            "vertices_m": corners((0.0, 0.0, -50.0), (200.0, 200.0, 0.0)),
        },
        "waypoints": [
            {"position_m": position, "radius_m": radius, "weight": 1.0}
            for position, radius in waypoints
        ],
        "uas": uas,
    }
    return parse(data | fields, Scenario, "practice")


def obstacle(low, high, name="shed"):
    """A box-shaped obstacle."""
    return {"name": name, "safe_distance_m": 2.0, "vertices_m": corners(low, high)}


def with_uas(scenario, row, **fields):
    """The scenario with one UAS changed."""
    data = scenario.model_dump(by_alias=True)
    uas = [dict(entry) for entry in data["uas"]]
    uas[row] |= fields
    return parse(data | {"uas": uas}, Scenario, "practice")


def planner(scenario, **options):
    """A planner that works by nodes, on a short horizon, ready for the mission."""
    made = MilpMpc(MilpMpcOptions(**({"horizon": 8, "teams": 1} | options)))
    made.reset(MissionBrief.of(scenario), 0)
    return made


def wrenches(plan, step):
    """The plan's inputs of a step as commands."""
    return {
        name: Wrench(*(float(plan.u[row, step, k]) for k in (LIFT, TAU_X, TAU_Y, TAU_Z)))
        for row, name in enumerate(plan.names)
    }


def fly(world, made, steps):
    """Outcomes (T, U) of flying the planner, until no UAS flies."""
    outcomes = []
    for _ in range(steps):
        if world.done:
            break
        outcomes.append(world.step(made.act(world.swarm_state())))
    return np.array(outcomes, OUTCOME_DTYPE)
