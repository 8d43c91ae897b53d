"""Each reduction's block alone, frozen as text beside the families that it replaces."""

import numpy as np
from golden_lp import compare, readable
from toy_problems import S500, box, state, toy
from uas_coverage_baselines.milp_mpc.model.blocks import Obstacles, TargetDistance
from uas_coverage_baselines.milp_mpc.model.milp import Milp
from uas_coverage_baselines.milp_mpc.model.ocp import shared_variables
from uas_coverage_baselines.milp_mpc.model.problem import Target
from uas_coverage_baselines.milp_mpc.model.reductions.aggregated import AggregatedBoxes
from uas_coverage_baselines.milp_mpc.model.reductions.cliques import VisitCliques
from uas_coverage_baselines.milp_mpc.model.reductions.elimination import (
    BatteryFromThrust,
    MotionDynamics,
    motion_variables,
)
from uas_coverage_baselines.milp_mpc.model.reductions.first_visit import (
    FirstVisit,
    without_coverage_state,
)
from uas_coverage_baselines.milp_mpc.model.reductions.lifted import LiftedBoxes
from uas_coverage_baselines.milp_mpc.model.reductions.one_face import OneFacePerInterval
from uas_coverage_baselines.milp_mpc.model.reductions.paper import PaperCornerCutting, PaperCoverage

CALM = state((50.0, 50.0, -10.0))
NORTHBOUND = state((50.0, 50.0, -10.0), (6.0, 0.0, 0.0))
SOUTHBOUND = state((74.0, 50.0, -10.0), (-6.0, 0.0, 0.0))
TOWER = box((60.0, 48.0, -12.0), (70.0, 58.0, 0.0))
AHEAD = [((61.0, 50.0, -10.0), 6.0), ((72.0, 50.0, -12.0), 3.0, 2.0)]


def written(problem, *blocks, variables=without_coverage_state):
    milp = Milp()
    v = variables(milp, problem)
    for block in blocks:
        block.add_to(milp, v, problem)
    return milp


def test_paper_coverage(request):
    problem = toy(NORTHBOUND, SOUTHBOUND, horizon=2, waypoints=AHEAD[:1], prune=False)
    milp = written(problem, PaperCoverage(), variables=shared_variables)
    heading = """
        Waypoint coverage as the paper has it, eq. (OCP_8): a row per UAS, step and face with M
        from the fence alone, sum of b_W <= Phi, b_W and Phi whole.
    """
    compare(request, "paper_coverage", readable(milp, heading))


def test_paper_corner_cutting(request):
    problem = toy(NORTHBOUND, obstacles=[TOWER])
    milp = written(problem, Obstacles(), PaperCornerCutting(), variables=shared_variables)
    heading = """
        Corner cutting as the paper has it, Sec. III-C.4: b(n) + b(n+1) <= 2 c(n), sum of c(n) <=
        N_f - 1, b and c whole. relaxed is b, crossed(uas, interval, face) is c.
    """
    families = r"tower_0\.(corner|one_face_stays)"
    compare(request, "paper_corner_cutting", readable(milp, heading, families))


def test_first_visit(request):
    problem = toy(NORTHBOUND, SOUTHBOUND, horizon=3, waypoints=AHEAD)
    heading = """
        Waypoint coverage without Phi, eq. (OCP_8): one visit counts, at n = 2 for one step of
        N = 3, at n = 1 for two. Weights 1 and 2.
    """
    compare(request, "first_visit", readable(written(problem, FirstVisit()), heading))


def test_target_distance_without_coverage_state(request):
    target = Target(np.array([61.0, 50.0, -10.0]), 0.02, waypoint=0)
    problem = toy(NORTHBOUND, horizon=3, waypoints=AHEAD, targets=[target], physical_sides=4)
    heading = """
        Target distance in transit without Phi, eq. (OCP_7): c_target = M (visits before n), since
        Phi_w(n) = 1 - sum of the visits before n. covers(0,2,0) is the one visit that is possible.
    """
    milp = written(problem, TargetDistance())
    compare(request, "first_visit_target_distance", readable(milp, heading))


def test_one_face(request):
    problem = toy(NORTHBOUND, obstacles=[TOWER])
    heading = """
        Obstacle avoidance and corner cutting in one, eq. (OCP_6) and Sec. III-C.4, with c alone:
        d_h >= 1 - M c_h(n) at both ends of interval n, sum of c_h(n) <= N_f - 1.
        crossed(uas, interval, face) is c; bounds of 1: faces beyond which the UAS cannot be.
    """
    compare(request, "one_face", readable(written(problem, OneFacePerInterval()), heading))


def test_aggregated_boxes(request):
    problem = toy(NORTHBOUND, horizon=4, waypoints=AHEAD)
    heading = """
        Waypoint coverage, eq. (OCP_8), in aggregated rows f p(n) <= S - sum of (S - t_w) b_w(n):
        one per step and face for both waypoints, which lie apart. (group, n, face).
    """
    compare(request, "aggregated_boxes", readable(written(problem, AggregatedBoxes()), heading))


def test_lifted_boxes(request):
    far = [AHEAD[0], ((92.0, 50.0, -12.0), 3.0, 2.0)]
    problem = toy(NORTHBOUND, horizon=3, waypoints=far)
    heading = """
        Waypoint coverage, eq. (OCP_8), in rows lifted over the samples around: a visit at n - 1 or
        n + 1 keeps the UAS within one step's way of the box at n. (group, n, direction), faces and
        diagonals.
    """
    compare(request, "lifted_boxes", readable(written(problem, LiftedBoxes()), heading))


def test_visit_cliques(request):
    places = [((61.0, 50.0 + east, -10.0), 6.0) for east in (-35.0, 0.0, 35.0)]
    problem = toy(NORTHBOUND, horizon=7, waypoints=places)
    heading = """
        Waypoint coverage, eq. (OCP_8): at most one visit per window of samples and waypoints that
        are so far apart. Three waypoints 35 m from each other in a row. (clique, first n).
    """
    compare(request, "visit_cliques", readable(written(problem, VisitCliques()), heading))


def test_motion_dynamics(request):
    milp = written(toy(NORTHBOUND), MotionDynamics(), variables=motion_variables)
    heading = """
        System dynamics without yaw at rest and without the battery, eq. (OCP_1).
    """
    compare(request, "motion_dynamics", readable(milp, heading))


def test_battery_from_thrust(request):
    start = state((50.0, 50.0, -10.0), dod=S500.battery.dod_cutoff - 0.0015)
    milp = written(toy(start), BatteryFromThrust(), variables=motion_variables)
    heading = """
        Battery as a function of thrust, eq. (OCP_3) and part I of the objective: depth of discharge
        and polarisation put in, rows that no thrust can break left out. u(uas, n, 4) is Delta T.
    """
    compare(request, "battery_from_thrust", readable(milp, heading))
