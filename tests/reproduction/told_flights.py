"""Flights of the paper's map that go as a test wants, without being flown."""

import dataclasses
from functools import cache

import numpy as np

from uas_coverage_env.flight import MODES, Flight, rollout
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.vehicle.layout import DOD

COVERING, RETURN, LANDED = (MODES.index(name) for name in ("covering", "return", "landed"))
SCENARIO = load_scenario("gasche2025")
HELIPAD = 27
"""The waypoint behind the helicopter."""
FORESTS = [w for w, one in enumerate(SCENARIO.waypoints) if one.kind == "forest"]
OTHERS = [w for w in range(49) if w not in FORESTS and w != HELIPAD]


@cache
def started() -> Flight:
    """One step of a real flight."""
    return rollout(SCENARIO, "hover", max_steps=1)


def flight(
    visits,
    steps=(220, 147),
    returns=64,
    dod=(0.0, 0.567),
    dod_per_step=0.0008,
    power=(200.0, 180.0),
    voltage=(16.0, 14.0),
    scenario=SCENARIO,
    **changed,
) -> Flight:
    """A flight of which everything is said.

    Args:
        visits: (UAS, sample) -> the waypoint at which it is then; at home in between.
        steps: In which each lands.
        returns: From which on the second is in return mode.
        dod: Of each at the start.
        dod_per_step: What a step takes.
        power: [W] of each.
        voltage: [V] of each.
        scenario: On which map.
        changed: Other fields of the flight.
    """
    T = max(steps) + 1
    x = np.tile(started().x[:1], (T, 1, 1))
    for (uas, sample), waypoint in visits.items():
        x[sample, uas, :3] = SCENARIO.waypoints[waypoint].position_m
    mode = np.full((T, 2), COVERING, np.int8)
    mode[returns:, 1] = RETURN
    current = np.zeros((T, 2))
    for uas, last in enumerate(steps):
        mode[last:, uas] = LANDED
        x[:, uas, DOD] = dod[uas] + dod_per_step * np.minimum(np.arange(T), last)
        current[:last, uas] = power[uas] / voltage[uas]
    first = {}
    for (_, sample), waypoint in visits.items():
        first[waypoint] = min(sample, first.get(waypoint, T))
    covered = np.array([sum(s <= k for s in first.values()) for k in range(T)], np.int64)
    return dataclasses.replace(
        started(),
        scenario=scenario,
        x=x,
        u=np.zeros((T, 2, 5)),
        voltage_V=np.tile(voltage, (T, 1)),
        current_A=current,
        mode=mode,
        covered=covered,
        moving_position_m=np.array([SCENARIO.moving_positions(k) for k in range(T)]),
        plan=started().plan[:0],
        ended="complete",
        **changed,
    )


def as_told() -> Flight:
    """Everything happens as the paper's text tells it."""
    visits = {(k % 2, 10 + k): w for k, w in enumerate(FORESTS)}
    # UAS 1 covers the rest, UAS 2 some of it on its way home
    visits |= {(0, 75 + k): w for k, w in enumerate(OTHERS[:-3])}
    visits |= {(1, 70 + 5 * k): w for k, w in enumerate([33, *OTHERS[-2:]])}
    visits |= {(0, 140): OTHERS[-3], (0, 190): HELIPAD}
    return flight(visits)
