"""Where nothing verified can be flown, guidance and safety filter of the world are asked."""

from dataclasses import replace

import numpy as np
from guarded_fleets import PLACES, Guarded, braked_for, moved
from hand_made import hover, states_along
from small_worlds import mover

from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle import lpv_step


def after(guarded, u, inputs, x):
    out = np.empty_like(x)
    lpv_step(guarded.fleet.arena.vehicles[u], x, inputs, out)
    return out


def seen_by(guarded, swarm):
    guarded.guard._world.update(swarm)
    return guarded.guard


def test_a_uas_without_anything_brakes_or_flies_home():
    guarded = Guarded(2)
    away = states_along([(90.0, 60.0, -20.0)])[0]
    moves = moved((5.0, 0.0, 0.0))
    moves[1] = 140.0
    guard = seen_by(guarded, guarded.see(3, x0=away, x1=moves))
    both = guard.evade([0, 1], {}, [0])
    assert both.keys() == {0, 1}
    assert guard.evade([1], {}, []).keys() == {1}
    for u, x in ((0, away), (1, moves)):
        for _ in range(2):
            guard = seen_by(guarded, guarded.see(3, x0=x if u == 0 else away, x1=x if u else moves))
            x = after(guarded, u, guard.evade([u], {}, [0])[u], x)
        (away, moves) = (x, moves) if u == 0 else (away, x)
    assert away[S.VX] < -0.5, "home is in the south"
    assert abs(moves[S.VX]) < 3.0, "it brakes"


def test_a_uas_on_its_last_charge_brakes_too_unless_it_is_sent_home():
    guarded = Guarded(1)
    x = states_along([(180.0, 180.0, -20.0)], dod=0.74)[0]
    x[S.VX] = 4.0
    guard = seen_by(guarded, guarded.see(9, x0=x))
    here = replace(hover(PLACES[0], 0), x=x[None])
    brakes = braked_for(guarded.fleet, here, 0).u[0, : S.DELTA_THRUST]
    stays, goes = (guard.evade([0], {}, home)[0][: S.DELTA_THRUST] for home in ([], [0]))
    np.testing.assert_allclose(stays, brakes, atol=1e-9)
    assert np.abs(goes - brakes).max() > 1e-4


def test_a_hovering_uas_gets_out_of_the_way_of_what_comes_at_it_late_in_the_mission():
    coming = mover((40.0, 90.0, -20.0), (0.0, (0.0, -7.0, 0.0)))
    guarded = Guarded(1, moving_obstacles=(coming,))
    x = states_along([PLACES[0]])[0]
    far, near = (
        replace(
            guarded.see(50, x0=x),
            moving_position_m=np.array([[40.0, 60.0 + away_m, -20.0]]),
            moving_velocity_mps=np.array([[0.0, -7.0, 0.0]]),
        )
        for away_m in (130.0, 24.0)
    )
    stays, goes = (seen_by(guarded, swarm).evade([0], {}, [])[0] for swarm in (far, near))
    assert np.abs(stays - goes).max() > 1e-3
    assert np.abs(stays[S.TAU_X : S.TAU_Z + 1]).max() < 1e-6


def test_a_uas_gets_out_of_the_way_of_what_the_others_fly():
    guarded = Guarded(2)
    x0, x1 = moved((0.0, 8.0, 0.0)), moved((0.0, -4.0, 0.0))
    x1[:2] = 44.0, 78.0
    guard = seen_by(guarded, guarded.see(5, x0=x0, x1=x1))
    braking = braked_for(guarded.fleet, replace(hover(PLACES[0], 0), x=x0[None]), 0).u[0]
    onwards = braking.copy()
    onwards[S.TAU_X : S.TAU_Z + 1] = 0.0
    beside, instead = (guard.evade([1], flown, [1])[1] for flown in ({0: onwards}, {}))
    assert np.abs(beside - instead).max() > 1e-4
