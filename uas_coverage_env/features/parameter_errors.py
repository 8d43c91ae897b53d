"""True vehicles, drawn for each UAS and mission: planners and autopilots believe the files."""

from collections.abc import Iterable
from typing import Annotated, ClassVar

from pydantic import Field

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.random import uniform
from uas_coverage_env.features.feature import Disturbance, Feature
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.vehicle import CAPACITY, LIFT, MASS, N_DEVIATIONS, THRUST

Share = Annotated[float, Field(ge=0.0, le=0.5)]


class Uncertainty(FeatureTable):
    """Bounds within which the true vehicle of each UAS is drawn in each mission, uniformly.

    Attributes:
        mass: Largest relative error of mass, either way [-].
        thrust: Likewise, of the motors' thrust at the same speed [-].
        drag: Likewise, of the drag [-].
        power: Likewise, of the electrical power at the same speed of the motors [-].
        capacity_lost: Largest share of the battery's capacity that is lost with age [-].
        resistance_gained: Largest share by which its resistances have grown with age [-].
    """

    table: ClassVar[str] = "uncertainty"

    mass: Share = 0.0
    thrust: Share = 0.0
    drag: Share = 0.0
    power: Share = 0.0
    capacity_lost: Share = 0.0
    resistance_gained: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0

    def features(self) -> Iterable[Feature]:
        """The true vehicles; none where all bounds are zero."""
        return () if self == Uncertainty() else (uncertainty(self),)


_DRAWN = N_DEVIATIONS  # place in the memory


@kernel
def deviate(arena, state, outcome, i, parameters, memory, random):
    """Fly a vehicle drawn at the beginning; parameters: the bounds, in the order of `DEVIATIONS`.

    Those of the battery go one way: it ages. A mission begins in a hover, so the thrust of the
    true hover is known, as autopilots learn it in flight: the lift asked for is counted from there.
    """
    if memory[_DRAWN] == 0.0:
        for k in range(N_DEVIATIONS):
            share = uniform(random)
            memory[k] = parameters[k] * (share if k >= CAPACITY else 2.0 * share - 1.0)
        memory[CAPACITY] = -memory[CAPACITY]
        memory[_DRAWN] = 1.0
    event = outcome[i]
    for k in range(N_DEVIATIONS):
        event.deviation[k] += memory[k]
    to_hover = (1.0 + memory[MASS]) / (1.0 + memory[THRUST])
    event.u[LIFT] += (to_hover - 1.0) * arena.vehicles[i].weight_N


def uncertainty(bounds: Uncertainty) -> Disturbance:
    """The true vehicles of a scenario."""
    parameters = (
        *(bounds.mass, bounds.thrust, bounds.drag, bounds.power),
        *(bounds.capacity_lost, bounds.resistance_gained),
    )
    return Disturbance("uncertainty", deviate, parameters)
