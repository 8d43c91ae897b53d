"""A UAS takes off again where charge and time suffice for a waypoint and home, with margin."""

import dataclasses

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.mission import MissionBrief, Range, Ways, first_sight
from uas_coverage_env.planning.around.relaunch import Relaunch
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.vehicle.range import dod_per_s

START_M, PLACE_M = (20.0, 20.0, -1.0), (120.0, 150.0, -20.0)


def landed(dod=0.0, step=0):
    """A UAS on the ground that has used so much charge, and the mission."""
    scenario = meadow((START_M,), waypoints=(waypoint(PLACE_M, 5.0),), max_steps=600)
    brief = MissionBrief.of(scenario.model_copy(update={"relaunch": True}))
    swarm = first_sight(brief)
    x = swarm.x.copy()
    x[0, DOD] = dod
    return brief, dataclasses.replace(swarm, x=x, step=step, status=np.full(1, LANDED))


def goes(**known):
    brief, swarm = landed(**known)
    return bool(Relaunch(brief).due(swarm)[0])


def needed_s():
    """Out and home, with the margin of the way home for either way."""
    brief, swarm = landed()
    there = swarm.x[0].copy()
    there[:3] = PLACE_M
    home = Range(brief).home(0, there)
    out_s = Ways(brief).seconds(0, 0, swarm.x[0, :3])
    assert home.time_margin_s > 2.0
    return out_s + home.time_s + 2.0 * home.time_margin_s


@pytest.mark.parametrize(("spare_s", "may"), [(0.5, True), (-0.5, False)])
def test_it_goes_where_its_charge_suffices_for_the_way_out_and_home(spare_s, may):
    brief, _ = landed()
    dod = 0.5
    for _ in range(4):  # what a second takes depends a little on the charge
        dod = 0.75 - (needed_s() + spare_s) * dod_per_s(brief.vehicles[0], dod)
    assert goes(dod=dod) == may


@pytest.mark.parametrize(("spare_s", "may"), [(1.0, True), (-1.0, False)])
def test_it_goes_where_the_mission_lasts_long_enough_for_the_way_out_and_home(spare_s, may):
    assert goes(step=int(600 - needed_s() - spare_s)) == may
