"""True vehicles, drawn for each UAS and mission: planners and autopilots believe the files."""

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.random import uniform
from uas_coverage_env.disturbances.true_vehicles import perturb
from uas_coverage_env.scenario.uncertainty import Uncertainty
from uas_coverage_env.vehicle import CAPACITY, LIFT, MASS, N_PERTURBATIONS, THRUST
from uas_coverage_env.world.disturbance import Disturbance

_DRAWN = N_PERTURBATIONS  # place in the memory


@kernel
def perturb_as_drawn(arena, state, outcome, i, parameters, memory, random):
    """Fly a vehicle drawn at the beginning; parameters: bounds, in the order of `PERTURBATIONS`.

    Those of the battery go one way: it ages. A mission begins in a hover, so the thrust of the
    true hover is known, as autopilots learn it in flight: the lift asked for is counted from there.
    """
    if memory[_DRAWN] == 0.0:
        for k in range(N_PERTURBATIONS):
            share = uniform(random)
            memory[k] = parameters[k] * (share if k >= CAPACITY else 2.0 * share - 1.0)
        memory[CAPACITY] = -memory[CAPACITY]
        memory[_DRAWN] = 1.0
        perturb(arena, state, i, memory)
    to_hover = (1.0 + memory[MASS]) / (1.0 + memory[THRUST])
    outcome[i].u[LIFT] += (to_hover - 1.0) * arena.vehicles[i].weight_N


def uncertainty(bounds: Uncertainty) -> Disturbance:
    """The true vehicles of a scenario."""
    parameters = (
        *(bounds.mass, bounds.thrust, bounds.drag, bounds.power),
        *(bounds.capacity_lost, bounds.resistance_gained),
    )
    return Disturbance("uncertainty", perturb_as_drawn, parameters, perturbs=True)
