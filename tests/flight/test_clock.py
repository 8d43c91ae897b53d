"""What a flight and its decisions are said to take."""

import time

import pytest
from numba.core import event
from small_worlds import meadow

from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.autopilot.guidance import steer
from uas_coverage_env.flight import rollout
from uas_coverage_env.world import GoTo


class Compiles:
    """Flies to a waypoint, and compiles for a fifth of a second in each decision."""

    goes_to = True

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        with event.trigger_event("numba:compile", {"dispatcher": steer}):
            time.sleep(0.2)
        return {name: GoTo(0) for name in swarm.active}


def test_neither_a_decision_nor_the_flight_pays_for_what_is_compiled_on_the_way():
    flight = rollout(meadow(), Compiles(), max_steps=2)
    assert max(decision.duration_s for decision in flight.decisions) < 0.1
    assert flight.wall_time_s < 0.2


@pytest.mark.parametrize("goes_to", [True, False])
def test_guidance_is_there_before_the_first_decision_of_a_planner_that_says_it_needs_it(
    goes_to, monkeypatch
):
    order = []

    class Notes(Compiles):
        def act(self, swarm):
            order.append("decides")
            return {name: GoTo(0) for name in swarm.active}

    def noted(*given, goes_to):
        order.append("guidance" if goes_to else "none")
        return assistants(*given, goes_to=goes_to)

    monkeypatch.setattr("uas_coverage_env.simulation.world.assistants", noted)
    planner = Notes()
    planner.goes_to = goes_to
    rollout(meadow(), planner, max_steps=2)
    before = ["guidance", "decides"] if goes_to else ["decides", "guidance"]
    assert order == ["none", *before, "decides"]
