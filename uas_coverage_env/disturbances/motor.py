"""A motor that is damaged in flight: an event that acts on what the vehicle can do."""

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.disturbances.true_vehicles import perturb
from uas_coverage_env.scenario.events import MotorDegraded
from uas_coverage_env.vehicle import LIFT, POWER
from uas_coverage_env.world.disturbance import Disturbance
from uas_coverage_env.world.events import concerns

_EVENT, _THRUST_SHARE, _POWER_FACTOR = range(3)  # parameters


@kernel
def degrade(arena, state, outcome, i, parameters, memory, random):
    """Fly with what is left; parameters: number of the event, share of the thrust, power factor.

    The autopilot makes up for the motor as far as the thrust goes, and pays with power.
    """
    e = int(parameters[_EVENT])
    if concerns(state, e, i) and state.step[0] >= state.event_step[e]:
        event, vehicle = outcome[i], arena.vehicles[i]
        if memory[POWER] == 0.0:
            memory[POWER] = parameters[_POWER_FACTOR] - 1.0
            perturb(arena, state, i, memory)
        thrust_N = parameters[_THRUST_SHARE] * (vehicle.weight_N + vehicle.lift_max_N)
        event.u[LIFT] = min(event.u[LIFT], thrust_N - vehicle.weight_N)


def motor_degraded(e: int, event: MotorDegraded) -> Disturbance:
    """What event number e of a scenario does."""
    name = f"events[{e}] motor_degraded"
    parameters = (float(e), event.thrust_share, event.power_factor)
    return Disturbance(name, degrade, parameters, of_event=True, perturbs=True)
