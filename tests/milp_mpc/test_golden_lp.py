"""Each block alone, frozen as text: a change of the mathematics is a change of tests/golden/."""

import numpy as np
import pytest
from golden_lp import GOLDEN, compare, readable
from toy_problems import box, moving, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks import (
    Capabilities,
    Collision,
    CornerCutting,
    Coverage,
    Dynamics,
    InsideGeofence,
    MovingObstacles,
    Obstacles,
    Slack,
    TargetDistance,
)
from uas_coverage_baselines.milp_mpc.model.problem import Target

CALM = state((50.0, 50.0, -10.0))
NORTHBOUND = state((50.0, 50.0, -10.0), (6.0, 0.0, 0.0))
SOUTHBOUND = state((74.0, 50.0, -10.0), (-6.0, 0.0, 0.0))
TARGET_M = np.array([80.0, 50.0, -5.0])
TOWER = box((60.0, 48.0, -12.0), (70.0, 58.0, 0.0))


def test_dynamics(request):
    milp, _ = written(toy(NORTHBOUND), Dynamics())
    heading = """
        System dynamics, eq. (OCP_1): x(n+1) = A x(n) + B u(n) + E, x(0) = x_0.
        x(uas, n, state): 0-2 position, 3-5 velocity, 6-8 roll pitch yaw, 9-11 rates,
        12 depth of discharge, 13 polarisation. u(uas, n, input): lift, three torques, Delta T.
    """
    compare(request, "dynamics", readable(milp, heading))


@pytest.mark.parametrize(
    ("name", "families", "heading"),
    [
        (
            "capabilities_limits",
            "capabilities",
            """
            Vehicle physical constraints, eq. (OCP_3): x(n) in X for n = 1..N, u(n) in U.
            Norms of horizontal velocity, tilt and tilt rate by eq. (const_Vec_ub) with H_P = 4
            and c_in = cos(pi/4); the rest are intervals. Voltage and current are outputs
            C x + D u + F.
            """,
        ),
        (
            "capabilities_thrust",
            "thrust",
            """
            Vehicle physical constraints, eq. (OCP_3): Delta T = f_T(L, Psi, v) from below.
            Delta T >= L + k_v |v| + k_q |tilt beyond trim| - k_c v_z for climb and for descent
            (v_z points down), norms by H_P = 4 faces, trim tilt theta = -k v_x, phi = k v_y.
            """,
        ),
    ],
)
def test_capabilities(request, name, families, heading):
    milp, _ = written(toy(NORTHBOUND, horizon=1, physical_sides=4, limit_sides=4), Capabilities())
    compare(request, name, readable(milp, heading, families))


def test_slack(request):
    milp, _ = written(toy(CALM, horizon=1), Slack())
    heading = """
        Slack variables, eq. (OCP_4): -a_s <= a <= a_s for lift, torques, rates and yaw.
        Part I of the objective: W_u u_s(n) + W_x x_s(n), each divided by its largest value,
        the depth of discharge by what one step of hovering takes.
    """
    compare(request, "slack", readable(milp, heading))


def test_collision(request):
    problem = toy(NORTHBOUND, SOUTHBOUND, obstacle_sides=4, separation_m=6.0)
    milp, _ = written(problem, Collision())
    heading = """
        Collision avoidance, eq. (OCP_3) by eq. (const_Vec_lb): |p_a(n) - p_b(n)| >= 6 as a
        closed cylinder with H_O = 4: faces east, south, west, north, down, up.
        relaxed(pair, n, face) is the paper's b. a flies north towards b, 24 m north of it: up to
        n = 1 the face south separates whatever is flown, so it has no column there.
    """
    compare(request, "collision", readable(milp, heading))


def test_geofence(request):
    milp, _ = written(toy(CALM), InsideGeofence())
    heading = """
        Geofence, eq. (OCP_5) by eq. (const_CS_in): d_h(p(n)) <= delta_G = -0.5 for each face of
        the box 0..200, 0..200, -50..0.
    """
    compare(request, "geofence", readable(milp, heading))


@pytest.mark.parametrize(
    ("name", "prune", "remark"),
    [
        ("obstacles", True, "Rows, columns and big M that the reachable positions need."),
        ("obstacles_unpruned", False, "Every row, big M from the fence alone."),
    ],
)
def test_obstacles(request, name, prune, remark):
    milp, _ = written(toy(NORTHBOUND, obstacles=[TOWER], prune=prune), Obstacles())
    heading = f"""
        Obstacle avoidance, eq. (OCP_6) by eq. (const_CS_out): d_h(p(n)) >= 1 - M_h(n) b_h(n),
        sum of b_h(n) <= N_f - 1, for the box 60..70, 48..58, -12..0. relaxed(uas, n, face) is b;
        faces south, west, up, down, east, north. At n = 0 the position (50, 50, -10) is known.
        {remark}
    """
    compare(request, name, readable(milp, heading))


def test_moving_obstacles(request):
    mover = moving([(70.0, 50.0, -10.0), (69.0, 50.0, -10.0), (68.0, 50.0, -10.0)])
    milp, _ = written(
        toy(NORTHBOUND, moving_obstacles=[mover], obstacle_sides=4), MovingObstacles()
    )
    heading = """
        Moving obstacle, eq. (OCP_6) by eq. (const_Vec_lb): outside a closed cylinder of radius 4
        and half height 3, by 1, around p_o(n) = (70 - n, 50, -10); H_O = 4: faces east, south,
        west, north, down, up.
    """
    compare(request, "moving_obstacles", readable(milp, heading))


def test_corner_cutting(request):
    milp, _ = written(toy(NORTHBOUND, obstacles=[TOWER]), Obstacles(), CornerCutting())
    heading = """
        Corner cutting, Sec. III-C.4: b(n) + b(n+1) <= 2 c(n), written b(n) <= c(n) and
        b(n+1) <= c(n); sum of c(n) <= N_f - 1. relaxed is b, crossed(uas, interval, face) is c;
        b need not be whole, because c is. Bounds of 1: faces beyond which the UAS cannot be.
    """
    families = r"tower_0\.(corner|one_face_stays)"
    compare(request, "corner_cutting", readable(milp, heading, families))


def test_coverage(request):
    waypoints = [((61.0, 50.0, -10.0), 6.0), ((68.0, 50.0, -12.0), 3.0, 2.0)]
    milp, _ = written(toy(NORTHBOUND, SOUTHBOUND, horizon=3, waypoints=waypoints), Coverage())
    heading = """
        Waypoint coverage, eq. (OCP_8) by eq. (const_Vec_ub) with H_WP = 4 and
        c_in = cos(pi/4)^2 = 1/2: spheres of 6 m about (61, 50, -10) and 3 m about (68, 50, -12)
        are boxes of +-3 m and +-1.5 m. covers(uas, n, waypoint) is b_W, uncovered(n, waypoint)
        Phi. Faces: east, south, west, north, down, up; none that every reachable position keeps.
        Part III of the objective: W_Phi Phi(n), weights 1 and 2. sum of b_W <= Phi is
        Phi(n+1) >= 0; Phi is whole because b_W is.
    """
    compare(request, "coverage", readable(milp, heading))


@pytest.mark.parametrize(
    ("name", "target", "remark"),
    [
        (
            "target_distance_return",
            Target(TARGET_M, 0.02),
            "Return mode: c_target = 0, the target is the initial position.",
        ),
        (
            "target_distance_transit",
            Target(TARGET_M, 0.02, waypoint=0),
            "Transit mode: c_target = M (1 - Phi_w(n)); uncovered(n, 0) is Phi_w.",
        ),
    ],
)
def test_target_distance(request, name, target, remark):
    waypoints = [((80.0, 50.0, -5.0), 6.0)]
    problem = toy(CALM, waypoints=waypoints, targets=[target], physical_sides=4)
    milp, _ = written(problem, TargetDistance())
    heading = f"""
        Target distance, eq. (OCP_7) by eq. (const_Vec_ub) with a closed cylinder, H_P = 4:
        |p(n) - (80, 50, -5)| <= D_target(n) + c_target(n); part II of the objective: W_D D_target.
        {remark}
    """
    compare(request, name, readable(milp, heading))


def test_every_golden_file_names_its_equation_and_fits_on_a_page():
    files = sorted(GOLDEN.glob("*.lp"))
    assert len(files) >= 10
    for path in files:
        lines = path.read_text(encoding="utf-8").splitlines()
        assert lines[0].startswith("\\ "), path.name
        assert "eq. (" in lines[0] or "Sec. III" in lines[0], path.name
        assert len(lines) <= 65, path.name
