"""Sensors with errors, and UAS without satellite navigation: what is known of the state."""

import math
from collections.abc import Iterable
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted, normal, uniform
from uas_coverage_env.compiled.views import record_view
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.features.event import OfUas, Seconds, concerns, lasts
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.features.table import FeatureTable
from uas_coverage_env.vehicle.layout import DOD, N_STATES, U_TH, VX, VY, X, Y

LONGEST_DELAY = 7
"""Steps by which what is sensed may lag behind."""

N_DELAYED = LONGEST_DELAY + 1
"""Samples that are kept of what is measured."""

MEMORY_DTYPE = record_dtype(
    [
        # the latest of what was measured; that of sample k at k modulo their number
        ("delayed", "f8", (N_DELAYED, N_STATES)),
        # errors that a mission draws: position [m], velocity [m/s], depth of discharge [-]
        ("position_m", "f8", (3,)),
        ("velocity_mps", "f8", (3,)),
        ("charge", "f8"),
        # direction in which dead reckoning drifts [rad]
        ("drift_rad", "f8"),
        ("random", "u8", (1,)),
    ]
)

_memory_of = record_view(MEMORY_DTYPE)


@rare_kernel
def _begin(arena, state, f, seed):
    """Draw the errors of the mission. Where and how UAS start is known."""
    memory = _memory_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        own, sensing = memory[i], arena.sensing[i]
        random = own.random[:]
        random[0] = counted(seed, i)
        for axis in range(3):
            own.position_m[axis] = sensing.position_bias_m * normal(random)
            own.velocity_mps[axis] = sensing.velocity_bias_mps * normal(random)
        own.charge = sensing.charge_bias * normal(random)
        own.drift_rad = 2.0 * math.pi * uniform(random)
        for k in range(N_STATES):
            own.delayed[0, k] = state.x[i, k]


@rare_kernel
def _sense(arena, state, outcome, f):
    """Write what is known at the new sample.

    A UAS without satellite navigation adds up its velocity instead, with a drift.
    """
    step = state.step[0]
    memory = _memory_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        own, sensing = memory[i], arena.sensing[i]
        random = own.random[:]
        estimated = state.estimated[i]
        measured = state.measured[i]
        north_m, north_mps = estimated[X], estimated[VX]
        east_m, east_mps = estimated[Y], estimated[VY]
        for k in range(N_STATES):
            estimated[k] = state.x[i, k]
        drift_mps = -1.0
        for e in range(arena.events.shape[0]):
            if concerns(arena, state, e, f, i) and lasts(arena, state, e):
                drift_mps = max(drift_mps, arena.events[e].values[0])
        for axis in range(3):
            estimated[X + axis] += own.position_m[axis]
            estimated[VX + axis] += own.velocity_mps[axis]
        estimated[DOD] = min(max(estimated[DOD] + own.charge, 0.0), 1.0)
        if drift_mps >= 0.0:
            dt_s = arena.rules[0].dt_s
            estimated[VX] += drift_mps * math.cos(own.drift_rad)
            estimated[VY] += drift_mps * math.sin(own.drift_rad)
            estimated[X] = north_m + 0.5 * dt_s * (north_mps + estimated[VX])
            estimated[Y] = east_m + 0.5 * dt_s * (east_mps + estimated[VY])
        for k in range(N_STATES):
            measured[k] = estimated[k]
        for axis in range(3):
            measured[X + axis] += sensing.position_noise_m * normal(random)
            measured[VX + axis] += sensing.velocity_noise_mps * normal(random)
        if state.uas[i].status == FLYING and not outcome[i].flew:
            # which pack is in is known at once
            for k in range(N_DELAYED):
                own.delayed[k, DOD] = state.x[i, DOD]
                own.delayed[k, U_TH] = state.x[i, U_TH]
        late = max(step - sensing.delay_steps, 0) % N_DELAYED
        for k in range(N_STATES):
            own.delayed[step % N_DELAYED, k] = measured[k]
            state.observed[i, k] = own.delayed[late, k]


SENSING = MissionFeature(
    "sensing",
    {Point.BEGIN: _begin, Point.SENSED: _sense},
    memory=MEMORY_DTYPE,
    key=0x73656E73696E6701,
)


class Sensing(FeatureTable):
    """Errors with which a UAS knows its position, velocity and charge. The rest is known exactly.

    Noise is normal and new at every sample. A bias is normal, too, and drawn once for each UAS and
    mission. The inner loop uses the state with biases; return mode, guidance and safety filter use
    it with biases and noise; planners and learners get the latter `delay_steps` later. Rules judge
    the true state.

    Attributes:
        position_noise_m: Standard deviation on each axis [m].
        position_bias_m: Likewise of a constant error [m].
        velocity_noise_mps: Standard deviation on each axis [m/s].
        velocity_bias_mps: Likewise of a constant error [m/s].
        charge_bias: Standard deviation of a constant error of the depth of discharge [-].
        delay_steps: How many steps later planners and learners get it.
    """

    table: ClassVar[str] = "sensing"

    position_noise_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    position_bias_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    velocity_noise_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    velocity_bias_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    charge_bias: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    delay_steps: Annotated[int, Field(ge=0, le=LONGEST_DELAY)] = 0

    def features(self) -> Iterable[MissionFeature]:
        """Sensors of all UAS."""
        return (SENSING,)


class GnssLost(OfUas):
    """A UAS is without satellite navigation for a while and goes by dead reckoning.

    It adds up its velocity, which is wrong by a horizontal drift of random direction. Its height
    comes from a barometer and stays right.

    Attributes:
        kind: `"gnss_lost"`.
        for_s: How long [s].
        drift_mps: How wrong its velocity is meanwhile [m/s].
    """

    feature: ClassVar = SENSING
    senses: ClassVar[bool] = True

    kind: Literal["gnss_lost"]
    for_s: Seconds
    drift_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.2

    @property
    def lasts_s(self) -> float:
        """For as long as it says [s]."""
        return self.for_s

    @property
    def values(self) -> tuple[float, ...]:
        """The drift."""
        return (self.drift_mps,)
