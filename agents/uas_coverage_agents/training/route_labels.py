"""Labels for a route policy: towns, and the routes that a planner would fly there."""

import json
from pathlib import Path
from typing import Any, NamedTuple

from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.flight import load_planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario, sample_scenario

FIRST_SEED, VALIDATION_SEED = 1_000_000, 900_000
N_UAS, VALIDATION_N_UAS = (1, 6), (1, 4)
N_WAYPOINTS, N_OBSTACLES = (20, 60), (5, 20)

_SAVE_EVERY = 10


class Label(NamedTuple):
    """A town and the routes of its UAS.

    Attributes:
        seed: Of the town.
        routes: Waypoints of each UAS, in order.
        steps: Steps that each planned flight takes; 0 where it stays at home.
    """

    seed: int
    routes: list[list[int]]
    steps: list[int]


def town_of(seed: int) -> Scenario:
    """The town of a seed: of training or of validation."""
    n_uas = N_UAS if seed >= FIRST_SEED else VALIDATION_N_UAS
    return sample_scenario(seed, n_uas, N_WAYPOINTS, N_OBSTACLES)


def labelled(path: Path, first_seed: int, count: int) -> list[Label]:
    """The labels of `count` towns, read from a file as far as it holds them, else planned.

    `trajectory` plans a mission before take-off; nothing is flown. The file is saved now and then,
    so that an interrupted call goes on where it was.
    """
    found = [Label(**row) for row in json.loads(path.read_text())] if path.exists() else []
    planner: Any = load_planner("trajectory")
    while len(found) < count:
        seed = first_seed + len(found)
        planner.reset(MissionBrief.of(town_of(seed)), 0)
        plan = planner.mission_plan
        planned, routes = plan.planned, [route.tolist() for route in plan.order.routes]
        steps = [planned[u].flight.steps if u in planned else 0 for u in range(len(routes))]
        found.append(Label(seed, routes, steps))
        if len(found) % _SAVE_EVERY == 0 or len(found) == count:
            text = json.dumps([label._asdict() for label in found])
            write_atomically(path, text.encode())
            print(f"{len(found)} of {count} towns labelled", flush=True)
    return found[:count]
