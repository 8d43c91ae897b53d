"""The shipped policy that chooses waypoints, as a planner: `learned-waypoint`."""

from pathlib import Path

from pydantic import Field

from uas_coverage_agents.policy.planner import PolicyPlanner
from uas_coverage_agents.waypoint.policy_runner import WaypointRunner
from uas_coverage_env.flight import AssistedOptions

SHIPPED = Path(__file__).parents[1] / "shipped" / "learned-waypoint"


class LearnedWaypointOptions(AssistedOptions):
    """Options of `LearnedWaypoint`."""

    simulations: int = Field(
        default=32,
        ge=0,
        le=100_000,
        description="missions simulated before a decision; 0: the network decides alone",
    )


class LearnedWaypoint(PolicyPlanner):
    """Flies each UAS to the waypoints that a trained network chooses, tried out in simulation."""

    Options = LearnedWaypointOptions

    def __init__(self, options: LearnedWaypointOptions | None = None) -> None:
        options = options or LearnedWaypointOptions()
        self._simulations = options.simulations
        super().__init__(options, SHIPPED)

    def _make_runner(self) -> WaypointRunner:
        return WaypointRunner(self.policy, self.assistants, self._simulations)
