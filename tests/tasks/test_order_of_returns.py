"""Returns of v1 are in the order of what is flown, on every level: so they can be learnt from."""

import pytest

from uas_coverage_env import GoTo, Velocity
from uas_coverage_env.tasks import LEVELS, score
from uas_coverage_env.vehicle.layout import Z

_MISSIONS = {"easy": 4, "medium": 3, "hard": 4, "extreme": 2, "air-taxi": 2, "indoor": 2}


class Hover:
    """Every UAS stays where it is."""

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        height = dict(zip(swarm.names, -swarm.x[:, Z], strict=True))
        return {name: Velocity(0.0, 0.0, height[name]) for name in swarm.active}


class LandAtOnce:
    goes_to = True

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return dict.fromkeys(swarm.active, GoTo(None, mode="return"))


def returned(planner, level):
    flown = score(planner, f"{level}-v1", missions=_MISSIONS[level])
    return flown.mean("episode_return"), flown.mean("value")


@pytest.mark.parametrize("level", LEVELS)
def test_to_hover_is_worse_than_to_land_at_once_and_that_worse_than_to_cover(level):
    hovering, nothing = returned(Hover(), level)
    landing, _ = returned(LandAtOnce(), level)
    covering, value = returned("nearest-waypoint", level)
    drawn, of_random = returned("random", level)
    assert hovering < landing < covering
    # UAS that are brought to another place cover what lies on their way
    assert nothing < value
    assert nothing == 0.0 or level == "air-taxi"
    # where assistants bring home what random actions have covered, that is worth something
    assert (drawn < hovering) == (of_random == 0.0)
    assert drawn < covering


@pytest.mark.slow
@pytest.mark.parametrize("level", LEVELS)
def test_the_best_planner_is_paid_more_than_simple_ones(level):
    simple = max(returned(planner, level) for planner in ("nearest-waypoint", "lawnmower"))
    best = max(returned(planner, level) for planner in ("tour", "trajectory"))
    assert simple < best
