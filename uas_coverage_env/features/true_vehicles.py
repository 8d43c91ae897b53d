"""What disturbances do to the vehicle that flies: its parameters become others than believed."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.vehicle.true_vehicle import N_PERTURBATIONS, write_true_vehicle


@inlined_kernel
def true_vehicle(state, i):
    """The record of the vehicle that UAS i flies; the nominal one until a disturbance changes it.

    Raises:
        ValueError: No disturbance of the mission says that it perturbs vehicles.
    """
    if state.true_vehicles.shape[0] == 0:
        raise ValueError(
            "a disturbance changes vehicles and does not say so; make it with perturbs=True"
        )
    return state.true_vehicles[i]


@kernel
def perturb(arena, state, i, change):
    """Change the parameters of the vehicle that UAS i flies, from now on.

    Args:
        arena: The arena.
        state: The state; `true_vehicles` is written.
        i: Which UAS.
        change: What is added to each perturbation, in the order of `vehicle.PERTURBATIONS`; there
            may be more behind.

    Raises:
        ValueError: A parameter is to be 0, negative or not finite; or see `true_vehicle`.
    """
    true = true_vehicle(state, i)
    changes = False
    for k in range(N_PERTURBATIONS):
        true.perturbation[k] += change[k]
        changes = changes or change[k] != 0.0
    if changes:
        write_true_vehicle(arena.vehicles[i], true)
