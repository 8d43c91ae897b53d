"""What goes to places, and missions that are drawn, on numba's simulated GPU: `simulated_gpu`."""

import numpy as np
from beside_batches import N_LANES, compare
from changing_missions import mission
from practice_grounds import practice_ground

from uas_coverage_env.env.versions import V1
from uas_coverage_env.scenario import Wind

GROUND = practice_ground(n_uas=2, tower=True, n_moving=1, max_steps=5)
N_STEPS = 13


def choices(kind_of_choices):
    """Others in every step, lane and UAS: the waypoints that there are, home, and what v1 adds."""
    rng = np.random.default_rng(3)
    return lambda k: rng.choice(kind_of_choices, (N_LANES, 2))


def compare_all():
    """The waypoint action, return mode, and an event that sends UAS home."""
    places = choices((0, 1, 2, 12))
    windy = GROUND.model_copy(update={"wind": Wind(mean_mps=4.0, from_deg=30.0)})
    sent_home = mission({"kind": "planner_lost", "at_s": 3.0, "then": "return"})
    away = np.full((2, 3), 0.3)
    return {
        "places": compare(GROUND, places, N_STEPS, action="waypoint"),
        "in wind": compare(windy, places, N_STEPS, action="waypoint"),
        "in the 6-DOF plant": compare(
            GROUND, places, N_STEPS, action="waypoint", dynamics="nonlinear"
        ),
        "with v1": compare(
            GROUND, choices((0, 1, 12, 13, 14)), N_STEPS, action="waypoint", version=V1
        ),
        "called home": compare(GROUND, away, N_STEPS, return_mode=True),
        "sent home": compare(sent_home, away, 34),
    }


def compare_orders():
    """Threads in the other order: what UAS do at the same time must not depend on it."""
    rng = np.random.default_rng(4)
    crowd = GROUND.model_copy(update={"uas": practice_ground(n_uas=4).uas})
    climbs = rng.choice((0, 1, 12, 13, 14), (N_STEPS, N_LANES, 4))
    numbers = rng.uniform(-1.0, 1.0, (N_STEPS, N_LANES, 4, 3))
    v1 = {"action": "waypoint", "version": V1}
    return {
        "numbers": compare(crowd, lambda k: numbers[k], N_STEPS, last_first=True),
        "v1": compare(crowd, lambda k: climbs[k], N_STEPS, last_first=True, **v1),
    }


def compare_drawn():
    """Lanes draw from scenarios with fleets, obstacles and time limits of their own."""
    one = practice_ground(n_uas=1, max_steps=3)
    drawn = [GROUND, one, one.model_copy(update={"max_steps": 4, "uas": GROUND.uas[::-1]})]
    return compare(drawn, choices((0, 1, 12)), 30, action="waypoint")
