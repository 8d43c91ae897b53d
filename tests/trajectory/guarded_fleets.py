"""A guarded fleet over a meadow, for the tests of what is flown when."""

from dataclasses import replace

from hand_made import NOTHING, states_along
from small_fleets import fleet_of
from small_worlds import meadow
from uas_coverage_baselines.trajectory.safeguard import Safeguard

from uas_coverage_env.mission import WorldView
from uas_coverage_env.planning.backup.course import braked
from uas_coverage_env.vehicle.layout import VX, VZ

PLACES = ((40.0, 60.0, -20.0), (40.0, 100.0, -20.0), (40.0, 140.0, -20.0))
MARGIN_M = 1.0


class Charge:
    """A way home that has charge to spare where it is asked for; it keeps what was asked."""

    def __init__(self, spare=lambda x: 1.0):
        self.spare, self.asked = spare, []

    def spare_dod(self, uas, x):
        self.asked.append((uas, x.copy()))
        return self.spare(x)


class Guarded:
    """A fleet over a meadow, its guard, and what it sees at a step."""

    def __init__(self, n_uas=1, charge=None, **world):
        self.fleet, self.swarm = fleet_of(meadow(PLACES[:n_uas], **world))
        brief = self.fleet.brief
        self.way_home = Charge() if charge is None else charge
        self.guard = Safeguard(self.fleet, WorldView(brief), self.way_home, MARGIN_M)

    def see(self, step, **states):
        """What is seen at a step: states of UAS by `x0=`, `x1=`."""
        x = self.swarm.x.copy()
        for name, state in states.items():
            x[int(name[1:])] = state
        return replace(self.swarm, step=step, x=x)

    def has(self, backups):
        """The guard has these backup trajectories and no others."""
        self.guard.backups.clear()
        self.guard.backups.update(backups)

    def chosen(self, wanted, moving=NOTHING, step=0, staying=(), **states):
        for u, course in wanted.items():
            states.setdefault(f"x{u}", course.x[0])
        return self.guard.chosen(self.see(step, **states), wanted, moving, staying)


def braked_for(fleet, course, followed):
    """A course of the first UAS, followed for some steps and braked then for 14 s."""
    return braked(fleet.arena.vehicles[0], course, followed, 14)


def moved(velocity_mps):
    """The state of the first UAS at its place, but moving."""
    x = states_along([PLACES[0]])[0]
    x[VX : VZ + 1] = velocity_mps
    return x
