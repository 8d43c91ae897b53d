"""A motor that is damaged in flight: an event that acts on what the vehicle can do."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from uas_coverage_env.compiled.kernels import rare_kernel, stack_array
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.features.event import OfUas, concerns
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.features.true_vehicles import perturb
from uas_coverage_env.vehicle.layout import LIFT
from uas_coverage_env.vehicle.true_vehicle import N_PERTURBATIONS, POWER


@rare_kernel
def _degrade(arena, state, outcome, f):
    """Fly with what is left: the autopilot makes up for it with power, as far as thrust goes."""
    for i in range(state.uas.shape[0]):
        if state.uas[i].status != FLYING:
            continue
        vehicle, u = arena.vehicles[i], outcome[i].u
        for e in range(arena.events.shape[0]):
            if concerns(arena, state, e, f, i) and state.step[0] >= state.events[e].step:
                values = arena.events[e].values
                if state.step[0] == state.events[e].step:
                    change = stack_array(N_PERTURBATIONS)
                    for k in range(N_PERTURBATIONS):
                        change[k] = 0.0
                    change[POWER] = values[1] - 1.0
                    perturb(arena, state, i, change)
                thrust_N = values[0] * (vehicle.weight_N + vehicle.lift_max_N)
                u[LIFT] = min(u[LIFT], thrust_N - vehicle.weight_N)


class MotorDegraded(OfUas):
    """A motor of a UAS is damaged from now on: it has less thrust and draws more power.

    Attributes:
        kind: `"motor_degraded"`.
        thrust_share: Share of the greatest thrust that is left; below what hovering takes, the UAS
            sinks [-].
        power_factor: How many times as much power it draws for the same thrust [-].
    """

    feature: ClassVar = MissionFeature("motor_degraded", {Point.ACT: _degrade}, perturbs=True)

    kind: Literal["motor_degraded"]
    thrust_share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    power_factor: Annotated[float, Field(ge=1.0, le=5.0)] = 1.0

    @property
    def values(self) -> tuple[float, ...]:
        """Share of the thrust, and power factor."""
        return (self.thrust_share, self.power_factor)
