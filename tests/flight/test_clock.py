"""What a flight and its decisions are said to take."""

import time

from small_worlds import meadow

from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.flight import rollout
from uas_coverage_env.world import GoTo


class Compiles:
    """Flies home, and compiles for a fifth of a second in each decision."""

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        with COMPILATIONS.one(lambda: 1):
            COMPILATIONS.begun()
            time.sleep(0.2)
        return {name: GoTo(None) for name in swarm.active}


def test_neither_a_decision_nor_the_flight_pays_for_what_is_compiled_on_the_way():
    flight = rollout(meadow(), Compiles(), max_steps=2)
    assert max(decision.duration_s for decision in flight.decisions) < 0.1
    assert flight.wall_time_s < 0.2
