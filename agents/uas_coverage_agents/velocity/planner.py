"""The shipped policy that commands velocities, as a planner: `learned-velocity`."""

from pathlib import Path

from uas_coverage_agents.policy.planner import PolicyPlanner
from uas_coverage_env.flight import AssistedOptions

SHIPPED = Path(__file__).parents[1] / "shipped" / "learned-velocity"


class LearnedVelocity(PolicyPlanner):
    """Plans the routes of the fleet; one trained network commands the velocity of each UAS."""

    Options = AssistedOptions

    def __init__(self, options: AssistedOptions | None = None) -> None:
        super().__init__(options, SHIPPED)
