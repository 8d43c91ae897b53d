"""True vehicles, drawn for each UAS and mission: planners and autopilots believe the files."""

from collections.abc import Iterable
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted, uniform
from uas_coverage_env.compiled.views import record_view
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.features.true_vehicles import perturb
from uas_coverage_env.vehicle.layout import LIFT
from uas_coverage_env.vehicle.true_vehicle import CAPACITY, MASS, N_PERTURBATIONS, THRUST

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

    def features(self) -> Iterable[MissionFeature]:
        """The true vehicles; none where all bounds are zero."""
        return () if self == Uncertainty() else (uncertainty(self),)


MEMORY_DTYPE = record_dtype(
    [
        # what is drawn of each perturbation
        ("shares", "f8", (N_PERTURBATIONS,)),
        # lift of the true hover beyond that of the believed one, over its weight
        ("more_lift", "f8"),
        ("random", "u8", (1,)),
    ]
)

_bounds_of = record_view(np.dtype(np.float64))
_memory_of = record_view(MEMORY_DTYPE)


@rare_kernel
def _draw(arena, state, f, seed):
    """Draw the vehicles that fly; parameters of the battery go one way: it ages."""
    own = arena.features[f]
    bounds = _bounds_of(arena.feature_words, own.first, own.n)
    memory = _memory_of(state.memory, own.memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        drawn = memory[i]
        random, shares = drawn.random[:], drawn.shares[:]
        random[0] = counted(seed, i + 1)
        for k in range(N_PERTURBATIONS):
            share = uniform(random)
            shares[k] = bounds[k] * (share if k >= CAPACITY else 2.0 * share - 1.0)
        shares[CAPACITY] = -shares[CAPACITY]
        drawn.more_lift = (1.0 + shares[MASS]) / (1.0 + shares[THRUST]) - 1.0
        perturb(arena, state, i, shares)


@rare_kernel
def _hover(arena, state, outcome, f):
    """Count the lift from the true hover: a mission begins in it, so autopilots have learnt it."""
    memory = _memory_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            outcome[i].u[LIFT] += memory[i].more_lift * arena.vehicles[i].weight_N


def uncertainty(bounds: Uncertainty) -> MissionFeature:
    """The true vehicles of a scenario."""
    each = (
        *(bounds.mass, bounds.thrust, bounds.drag, bounds.power),
        *(bounds.capacity_lost, bounds.resistance_gained),
    )
    kernels = {Point.BEGIN: _draw, Point.ACT: _hover}
    return MissionFeature("uncertainty", kernels, np.array(each), MEMORY_DTYPE, perturbs=True)
