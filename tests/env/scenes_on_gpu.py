"""Scenes that change on numba's simulated GPU, and the same as episodes: see `simulated_gpu`."""

import numpy as np
from beside_episodes import N_LANES, SEED, compare
from changing_missions import AGAIN, EVENTS, STEPS, mission

from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import GeneratedScenarios

# guidance, which brings UAS home, does not run there
EVERY_KIND = tuple(
    {**event, "then": "hover"} if event.get("then") == "return" else event for event in EVENTS
)
EVERYTHING = mission(*EVERY_KIND, relaunch=True, **AGAIN)


ASKED = np.full((2, 3), 0.2)


def go_on_elsewhere():
    """Copy missions in which scenes have changed, and go on beside them in other ones."""
    missions, other = (CudaMissions(N_LANES, EVERYTHING, seed=seed) for seed in (SEED, SEED + 9))
    for _ in range(9):
        missions.step(np.array([ASKED] * N_LANES))
    kept = missions.state_dict()
    wrong = {**kept, "changes": kept["changes"] + 1}
    try:
        other.load_state_dict(wrong)
    except ValueError as error:
        refused = str(error)
    other.load_state_dict(kept)
    briefs = [
        [MissionBrief.of(each.scenario_of(lane)) for lane in range(N_LANES)]
        for each in (missions, other)
    ]
    different = int(briefs[0] != briefs[1])
    for _ in range(STEPS):
        for each in (missions, other):
            each.step(np.array([ASKED] * N_LANES))
        arrays = [each.state_dict() for each in (missions, other)]
        different += sum(int((arrays[0][name] != arrays[1][name]).sum()) for name in kept)
    n_changes = (kept["changes"] >= 0).sum(axis=1).tolist()
    return {"different": different, "changes": n_changes, "refused": refused}


def refusal_of(scenario):
    """What is said of a scenario that does not run there."""
    try:
        CudaMissions(1, scenario)
    except ValueError as error:
        return str(error)
    return ""


def refusals():
    """Of events that send UAS home, and of what draws missions."""
    sent_home = ("radio_lost", "planner_lost")
    events = [e | {"then": "return"} for e in EVENTS if e["kind"] in sent_home]
    given = {event["kind"]: mission(event) for event in events}
    given |= {"family": "generated-light", "drawn": GeneratedScenarios()}
    return {name: refusal_of(scenario) for name, scenario in given.items()}


def compare_all():
    """All kinds of events at once, and waypoints that are asked for again."""
    again = mission(relaunch=True, **AGAIN)
    return {
        "all": compare(EVERYTHING, ASKED, STEPS + 8),
        "again": compare(again, np.zeros((2, 4)), STEPS + 8, action="wrench"),
        "checkpoint": go_on_elsewhere(),
        "refusals": refusals(),
    }
