"""Potentials that lead to the next waypoint, and home: terms that can be switched on.

Each pays in every step what its potential has grown by (A. Ng, D. Harada and S. Russell, ICML
1999). It is 0 once a UAS has landed or is lost, when time ends, and while a pack is swapped: so the
sum over an episode is minus the potential at the start, whatever is flown, and which flight is best
stays the same. A UAS heads for the nearest waypoint that charge and time allow; where there is
none, home.
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.entities.state import FLYING, LOST
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.env.ways import seconds_home_from, seconds_there, straight_m, way_to
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.coverage import can_cover

TO_WAYPOINT, TO_HOME = range(2)
"""Columns of `Learners.potentials`."""

N_POTENTIALS = TO_HOME + 1

_RESERVE_S = 30.0
"""What is left of charge and time once home, for a waypoint that they allow [s]."""

_FARTHEST_M = 400.0
_UNIT_M = 100.0
"""A way that is shorter by so much is worth 1 [m]."""

_NEAR_M, _SLOW_MPS, _LOW_M = 15.0, 4.0, 20.0
"""Within _NEAR_M of its start it is worth more to be slower and lower."""

_AT_START, _SLOW, _LOW = 1.6, 0.5, 0.4


@kernel
def _seconds_to_fly(arena, i, dod, step):
    """What charge and time allow, less the reserve [s]."""
    uas = arena.uas[i]
    rules = arena.rules[0]
    charge_s = (uas.dod_max - dod) / uas.dod_per_s
    return min(charge_s, (rules.max_steps - step) * rules.dt_s) - _RESERVE_S


@kernel
def _nearest_m(arena, uncovered, every, i, x, y, z, seconds, enough_m):
    """Way to the nearest waypoint that so many seconds allow to visit; infinite without one [m].

    Args:
        arena: The mission.
        uncovered: (W,) still to be covered.
        every: Take all of them as open.
        i: Index of the UAS.
        x: Where it is, north [m]; likewise y, east, and z, down.
        y: See x.
        z: See x.
        seconds: That it may fly.
        enough_m: The first that is nearer than this will do.
    """
    nearest_m = seconds * arena.uas[i].speed_mps
    found_m = math.inf
    for w in range(uncovered.shape[0]):
        if not (every or uncovered[w]) or not can_cover(arena, i, w):
            continue
        if straight_m(arena, w, x, y) >= nearest_m:
            continue
        way_m, there_s = seconds_there(arena, i, w, x, y, z)
        if way_m < nearest_m and there_s + seconds_home_from(arena, i, w) <= seconds:
            nearest_m = way_m
            found_m = way_m
            if way_m < enough_m:
                break
    return found_m


@inlined_kernel
def _worth_of_way(way_m):
    return -min(way_m, _FARTHEST_M) / _UNIT_M


@kernel
def _towards_waypoint(arena, uncovered, every, i, x, y, z, dod, step):
    seconds = _seconds_to_fly(arena, i, dod, step)
    way_m = _nearest_m(arena, uncovered, every, i, x, y, z, seconds, 0.0)
    return _worth_of_way(way_m) if way_m < math.inf else 0.0


@kernel
def _towards_home(arena, uncovered, every, i, x, y, z, speed_mps, dod, step):
    seconds = _seconds_to_fly(arena, i, dod, step)
    if _nearest_m(arena, uncovered, every, i, x, y, z, seconds, math.inf) < math.inf:
        return 0.0
    _, _, way_m, below_m = way_to(arena, i, HOME, x, y, z)
    far = min(way_m, _NEAR_M) / _NEAR_M
    slow = min(speed_mps, _SLOW_MPS) / _SLOW_MPS
    low = min(max(below_m, 0.0), _LOW_M) / _LOW_M
    return _worth_of_way(way_m) - _AT_START * far - (1.0 - far) * (_SLOW * slow + _LOW * low)


@inlined_kernel
def _begins(state):
    """Whether this is the first step, before which there was no potential yet."""
    return state.step[0] == 1


@inlined_kernel
def _goes_on(arena, state, i):
    return state.uas[i].status == FLYING and state.step[0] < arena.rules[0].max_steps


@inlined_kernel
def _growth(state, learners, i, column, before, now, parameters):
    """What a potential has grown by; it is kept for the next step."""
    learners.potentials[i, column] = now
    if state.uas[i].status == LOST and parameters[0] == 0.0:
        return 0.0
    return parameters[1] * now - before


@kernel
def _grown_to_waypoint(arena, state, tables, learners, scratch, i, parameters):
    """Growth of the potential of the nearest waypoint."""
    before = learners.potentials[i, TO_WAYPOINT]
    if _begins(state):
        start_m = arena.uas[i].start_m
        before = _towards_waypoint(
            arena, state.uncovered, True, i, start_m[0], start_m[1], start_m[2],
            tables.scales[i].start_dod, 0,
        )  # fmt: skip
    now = 0.0
    if _goes_on(arena, state, i):
        x = state.x[i]
        now = _towards_waypoint(
            arena, state.uncovered, False, i, x[S.X], x[S.Y], x[S.Z], x[S.DOD], state.step[0]
        )
    return _growth(state, learners, i, TO_WAYPOINT, before, now, parameters)


@kernel
def _grown_to_home(arena, state, tables, learners, scratch, i, parameters):
    """Growth of the potential of the way home."""
    before = learners.potentials[i, TO_HOME]
    if _begins(state):
        start_m = arena.uas[i].start_m
        before = _towards_home(
            arena, state.uncovered, True, i, start_m[0], start_m[1], start_m[2], 0.0,
            tables.scales[i].start_dod, 0,
        )  # fmt: skip
    now = 0.0
    if _goes_on(arena, state, i):
        x = state.x[i]
        now = _towards_home(
            arena, state.uncovered, False, i, x[S.X], x[S.Y], x[S.Z],
            math.hypot(x[S.VX], x[S.VY]), x[S.DOD], state.step[0],
        )  # fmt: skip
    return _growth(state, learners, i, TO_HOME, before, now, parameters)


def to_waypoint(
    weight: float = 0.0, *, refunds_losses: bool = True, discount: float = 1.0
) -> RewardTerm:
    """The potential of the nearest waypoint that charge and time allow: minus the way / 100 m.

    Args:
        weight: Of the term; 0: off, and not computed.
        refunds_losses: Whether a loss gives back what was gained by coming nearer, as it has to for
            the best flight to stay the same. Without it a loss costs that, too: a price on losses,
            higher far away.
        discount: The learner's: discounted by it, too, the sum is minus the potential at the start.

    Raises:
        ValueError: The discount is not above 0 and at most 1.
    """
    meaning = "growth of a potential: minus the way to the nearest waypoint that charge and time "
    return _term("to_waypoint", weight, meaning + "allow / 100 m; 0 at every end",
                 _grown_to_waypoint, refunds_losses, discount)  # fmt: skip


def to_home(
    weight: float = 0.0, *, refunds_losses: bool = True, discount: float = 1.0
) -> RewardTerm:
    """The potential of the way home, once charge and time allow no waypoint: minus it / 100 m.

    Near its start it grows with landing, too: as the UAS becomes slower and lower. Arguments as for
    `to_waypoint`.
    """
    meaning = "growth of a potential: once they allow none, minus the way home / 100 m, and near "
    return _term("to_home", weight, meaning + "its start minus speed and height; 0 at every end",
                 _grown_to_home, refunds_losses, discount)  # fmt: skip


def _term(
    name: str, weight: float, meaning: str, value: object, refunds: bool, discount: float
) -> RewardTerm:
    if not 0.0 < discount <= 1.0:
        raise ValueError(f"discount is {discount!r}; give a number above 0 and at most 1")
    return RewardTerm(name, weight, meaning, value, (float(refunds), float(discount)))
