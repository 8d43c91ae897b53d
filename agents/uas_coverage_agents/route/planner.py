"""The shipped policy that plans routes, as a planner: `learned-route`."""

from pathlib import Path

from pydantic import Field

from uas_coverage_agents.policy.planner import PolicyPlanner
from uas_coverage_agents.route.fleet_routes import CHANGES
from uas_coverage_agents.route.policy_runner import SAMPLES, RouteRunner
from uas_coverage_agents.route.rehearsal import CANDIDATES
from uas_coverage_env.flight import AssistedOptions

SHIPPED = Path(__file__).parents[1] / "shipped" / "learned-route"


class LearnedRouteOptions(AssistedOptions):
    """Options of `LearnedRoute`."""

    return_mode: bool = Field(
        default=False,
        description="let the world fly UAS home; else the planner does, by the same rule",
    )
    samples: int = Field(
        default=SAMPLES,
        ge=1,
        le=100_000,
        description="sets of routes drawn, the best of which is taken; 1: the first choices only",
    )
    changes: int = Field(
        default=CHANGES,
        ge=0,
        le=10_000_000,
        description="changes tried on these routes to make them cheaper; 0: flown as drawn",
    )
    rehearsed: int = Field(
        default=CANDIDATES,
        ge=0,
        le=1000,
        description="sets of such routes whose flights are simulated before take-off, the cheapest "
        "of which is flown as it was simulated; 0: none",
    )


class LearnedRoute(PolicyPlanner):
    """Builds the routes of the whole fleet with trained networks, and flies along them fast."""

    Options = LearnedRouteOptions

    def __init__(self, options: LearnedRouteOptions | None = None) -> None:
        options = options or LearnedRouteOptions()
        self._samples, self._changes = options.samples, options.changes
        self._rehearsed = options.rehearsed
        super().__init__(options, SHIPPED)

    def _make_runner(self) -> RouteRunner:
        return RouteRunner(
            self.policy, self.assistants, self._samples, self._changes, self._rehearsed
        )
