"""The vehicle's inner loop: commanded velocities and accelerations into wrenches, compiled.

Horizontally a linear feedback tracks a velocity reference, and a scalar reference governor moves
the reference towards the command only as far as every bound (angular acceleration, rate, tilt,
speed, each a norm over both axes) is predicted to hold. Keeping the reference is always
admissible, because the tail of the last prediction was (see `governor`): no bound is ever
exceeded, and no program has to be solved.

The reference (2,) [m/s] is memory of the loop, kept by the caller: zero at the start of a flight.
After wrenches that the loop did not make, `reseed_reference` lets it take over. If such wrenches
led far beyond the bounds of every reference, the UAS is levelled out first, with torques within
their limits.
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import BOUND, ON_RATE, ON_REFERENCE, ON_SPEED, ON_TILT
from uas_coverage_env.vehicle.record import GOVERNOR_BLOCK

COURSE_SPEED_MPS = 1.0
"""Ground speed below which a UAS that looks where it flies keeps its heading, that of ArduCopter
(`YAW_LOOK_AHEAD_MIN_SPEED`) [m/s]."""

_BLOCKS = -GOVERNOR_BLOCK  # as a mask: to whole blocks
_TINY = 1e-12
_ROUNDING = 1e-9  # relative
_FAR_OUTSIDE = 1.5  # times a bound: up to here, a flight of the nonlinear plant, say, goes on
_TOLERATED = 1.01  # times a bound: no violation yet
_SWEEPS = 8  # of cyclic projections
_INSIDE = 0.999  # of a bound: projections on the bound itself would end outside of the others
_CLEARLY = 0.999  # of a square: more than rounding can change
_HALVES = math.sqrt(0.5)  # of a norm for each of two axes


@inlined_kernel
def _predicted(rows, q, x, reference):
    """What governor row q predicts along north and east, the reference held."""
    # tilt and rate forward along north are negative pitch and pitch rate
    n = rows[ON_SPEED, q] * x[S.VX] - rows[ON_TILT, q] * x[S.THETA]
    n -= rows[ON_RATE, q] * x[S.WY]
    e = rows[ON_SPEED, q] * x[S.VY] + rows[ON_TILT, q] * x[S.PHI]
    e += rows[ON_RATE, q] * x[S.WX]
    n += rows[ON_REFERENCE, q] * reference[0]
    e += rows[ON_REFERENCE, q] * reference[1]
    return n, e


@kernel
def reseed_reference(vehicle, x, reference):
    """Let the loop take over in a state that something else led to.

    The reference is the velocity reached, moved to where all bounds are predicted to hold, or
    nearly so: each bound holds for a disc of references, and a state in mid-manoeuvre lies in the
    discs of others than its own velocity. Cyclic projections find a point of their intersection.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
        reference: (2,) [m/s] written.
    """
    reference[0] = x[S.VX]
    reference[1] = x[S.VY]
    rows = vehicle.governor_rows
    for _ in range(_SWEEPS):
        moved = False
        for q in range(vehicle.n_governor_rows):
            n, e = _predicted(rows, q, x, reference)
            length = math.sqrt(n * n + e * e)
            if length > rows[BOUND, q] and abs(rows[ON_REFERENCE, q]) > _TINY:
                back = (_INSIDE * rows[BOUND, q] / length - 1.0) / rows[ON_REFERENCE, q]
                reference[0] += back * n
                reference[1] += back * e
                moved = True
        if not moved:
            return


@kernel
def _within_limit(north, east, limit):
    """By what to scale a vector so that it is no longer than a limit."""
    square = north * north + east * east
    if square < _CLEARLY * limit * limit:
        # mostly: what follows would say the same, and others wait for root and quotient
        return 1.0
    return min(1.0, limit / max(math.sqrt(square), _TINY))


@kernel
def _govern(vehicle, x, reference, north_mps, east_mps):
    """Move the reference towards a velocity as far as all bounds are predicted to hold."""
    share = _within_limit(reference[0], reference[1], vehicle.reference_max_mps)
    reference[0] *= share
    reference[1] *= share
    share = _within_limit(north_mps, east_mps, vehicle.reference_max_mps)
    dn = share * north_mps - reference[0]
    de = share * east_mps - reference[1]
    if abs(dn) + abs(de) < _TINY:
        return
    share = 1.0
    rows = vehicle.governor_rows
    for q in range(vehicle.n_governor_rows):
        n0, e0 = _predicted(rows, q, x, reference)
        n1 = rows[ON_REFERENCE, q] * dn
        e1 = rows[ON_REFERENCE, q] * de
        bound = rows[BOUND, q] * rows[BOUND, q]
        n = n0 + share * n1
        e = e0 + share * e1
        if n * n + e * e > bound:
            a = n1 * n1 + e1 * e1
            b = n0 * n1 + e0 * e1
            # At an active bound c is zero but for rounding. The root has to be taken in any case:
            # to let c = +1e-16 pass as "no root" is how a bound breaks.
            c = n0 * n0 + e0 * e0 - bound
            if c <= _ROUNDING * bound:
                c = min(c, 0.0)
            if a < _TINY:
                return
            # Beyond a bound, where a commanded wrench led, the reference moves on as far
            # as that leads back: inside by the larger root, or to where the line is nearest.
            share = min(share, (-b + math.sqrt(max(b * b - a * c, 0.0))) / a)
            if share <= 0.0:
                return
    reference[0] += share * dn
    reference[1] += share * de


@rare_kernel
def _keep_tilt(vehicle, x, north, east, u):
    """More torque where limited angular accelerations would let the tilt beyond its bound.

    Wrenches may use the limit of angular acceleration on both axes at once, the loop keeps its norm
    within it. Where it takes over from a plan in mid-manoeuvre, that may not suffice to stop the
    tilt in time: then as much more as it takes, up to what each axis has.
    """
    dt = vehicle.dt_s
    per = 0.5 * dt * dt
    free_n, free_e = -x[S.THETA] - dt * x[S.WY], x[S.PHI] + dt * x[S.WX]
    n0, e0 = free_n + per * north, free_e + per * east
    tolerated = _TOLERATED * vehicle.tilt_max_rad
    if n0 * n0 + e0 * e0 <= tolerated * tolerated:
        return
    alpha, inertia = vehicle.alpha_xy_max_radps2, vehicle.inertia_kgm2
    most_n = min(alpha, vehicle.torque_max_Nm[1] / inertia[1])
    most_e = min(alpha, vehicle.torque_max_Nm[0] / inertia[0])
    dn = min(max(-free_n / per, -most_n), most_n) - north
    de = min(max(-free_e / per, -most_e), most_e) - east
    a = per * per * (dn * dn + de * de)
    if a < _TINY:
        return
    b = per * (n0 * dn + e0 * de)
    c = n0 * n0 + e0 * e0 - vehicle.tilt_max_rad * vehicle.tilt_max_rad
    share = 1.0
    if b * b >= a * c:
        share = min(max((-b - math.sqrt(b * b - a * c)) / a, 0.0), 1.0)
    u[S.TAU_X] = inertia[0] * (east + share * de)
    u[S.TAU_Y] = -inertia[1] * (north + share * dn)


@kernel
def _track(vehicle, x, reference, u):
    """Roll and pitch torques that track the reference."""
    k = vehicle.gain
    trim = vehicle.trim_rad_per_mps
    north = -k[ON_SPEED] * (x[S.VX] - reference[0])
    north -= k[ON_TILT] * (-x[S.THETA] - trim * reference[0])
    north += k[ON_RATE] * x[S.WY]
    east = -k[ON_SPEED] * (x[S.VY] - reference[1]) - k[ON_TILT] * (x[S.PHI] - trim * reference[1])
    east -= k[ON_RATE] * x[S.WX]
    # never active on a governed flight: it is for states that a commanded wrench led to
    share = _within_limit(north, east, vehicle.alpha_xy_max_radps2)
    u[S.TAU_X] = vehicle.inertia_kgm2[0] * share * east
    u[S.TAU_Y] = -vehicle.inertia_kgm2[1] * share * north
    if share < 1.0:
        _keep_tilt(vehicle, x, share * north, share * east, u)


@kernel
def _speed_towards(distance, speed, per_speed, per_next_speed, brake):
    """Fastest next speed towards a point from which a stop at the point is still possible.

    A step leads per_speed · v + per_next_speed · v⁺ ahead. Braking by `brake` per step from v⁺
    takes n steps, the last one a partial one. The way to stop is the largest of straight lines,
    one for each n, so the speed is the smallest of their solutions.

    Args:
        distance: to the point, not negative.
        speed: present speed towards it.
        per_speed: [s].
        per_next_speed: [s].
        brake: how much one step can reduce the speed.

    Returns:
        The next speed, negative where the point is overshot.
    """
    both = per_speed + per_next_speed
    left = (distance - per_speed * speed) / both
    n = 1.0
    # a UAS whose height is fixed has nothing to brake with
    if left > 0.0 and brake > 0.0:
        n = max(math.ceil(0.5 * (math.sqrt(1.0 + 8.0 * left / brake) - 1.0)), 1.0)
    return left / n + 0.5 * brake * (n - 1.0)


@kernel
def _far_outside(vehicle, x, reference):
    """Whether the state breaks a governor row by so much that the feedback would saturate."""
    rows = vehicle.governor_rows
    outside = False
    # whole blocks, so that the processor does all rows of a block at once; those beyond the last
    # are zero
    n_rows = (vehicle.n_governor_rows + GOVERNOR_BLOCK - 1) & _BLOCKS
    for q in range(n_rows):
        n, e = _predicted(rows, q, x, reference)
        bound = _FAR_OUTSIDE * rows[BOUND, q]
        outside |= n * n + e * e > bound * bound
    return outside


@kernel
def _turn_towards(vehicle, angle, rate, wanted, rate_max, alpha_max):
    """Angular acceleration that brings an angle to a wanted one, within its limits, and stops."""
    if angle == wanted and rate == 0.0:
        # what follows would say the same: nothing to do
        return 0.0
    dt = vehicle.dt_s
    sign = 1.0 if wanted >= angle else -1.0
    following = _speed_towards(
        sign * (wanted - angle), sign * rate, 0.5 * dt, 0.5 * dt, dt * alpha_max
    )
    following = sign * min(max(following, -rate_max), rate_max)
    return min(max((following - rate) / dt, -alpha_max), alpha_max)


@kernel
def _level_out(vehicle, x, u):
    """Torques to a level attitude; leaning against the velocity while that is beyond its limit."""
    speed = math.sqrt(x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY])
    lean = 0.0
    if speed > vehicle.reference_max_mps:
        lean = -0.5 * vehicle.tilt_max_rad / speed
    rate = _HALVES * vehicle.rate_max_radps
    alpha = _HALVES * vehicle.alpha_xy_max_radps2
    roll = _turn_towards(vehicle, x[S.PHI], x[S.WX], lean * x[S.VY], rate, alpha)
    pitch = _turn_towards(vehicle, x[S.THETA], x[S.WY], -lean * x[S.VX], rate, alpha)
    u[S.TAU_X] = vehicle.inertia_kgm2[0] * roll
    u[S.TAU_Y] = vehicle.inertia_kgm2[1] * pitch


@kernel
def _hold_heading(vehicle, x, u):
    """Yaw torque that brings the heading to 0, at which the model is linearised, and keeps it."""
    u[S.TAU_Z] = vehicle.inertia_kgm2[2] * _turn_towards(
        vehicle, x[S.PSI], x[S.WZ], 0.0, vehicle.yaw_rate_max_radps, vehicle.alpha_z_max_radps2
    )


@kernel
def within_half_turn(angle_rad):
    """The same angle within half a turn of 0, in [-pi, pi] [rad]."""
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


@rare_kernel
def face_course(vehicle, x, u):
    """Yaw torque that turns a UAS to its course over ground, the shorter way round.

    It turns within the limits of yaw rate and torque and stops there. Slower than
    COURSE_SPEED_MPS there is no course: it stops turning. No other input depends on the heading.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state, the velocity over ground.
        u: (5,) the yaw torque is written, whatever it was.
    """
    most = vehicle.alpha_z_max_radps2
    if x[S.VX] * x[S.VX] + x[S.VY] * x[S.VY] < COURSE_SPEED_MPS * COURSE_SPEED_MPS:
        alpha = min(max(-x[S.WZ] / vehicle.dt_s, -most), most)
    else:
        course = x[S.PSI] + within_half_turn(math.atan2(x[S.VY], x[S.VX]) - x[S.PSI])
        alpha = _turn_towards(vehicle, x[S.PSI], x[S.WZ], course, vehicle.yaw_rate_max_radps, most)
    u[S.TAU_Z] = vehicle.inertia_kgm2[2] * alpha


@kernel
def _lift_towards(vehicle, x, down_mps, u):
    """Lift that reaches a vertical speed in one step, or as nearly as its limits allow."""
    down = min(max(down_mps, -vehicle.v_up_max_mps), vehicle.v_down_max_mps)
    needed = (down - vehicle.vertical_A[S.SPEED, S.SPEED] * x[S.VZ]) / vehicle.vertical_B[S.SPEED]
    u[S.LIFT] = min(max(needed, vehicle.lift_min_N), vehicle.lift_max_N)


@kernel
def velocity_climb_wrench(vehicle, x, reference, north_mps, east_mps, down_mps, u):
    """Wrench for a horizontal velocity and a vertical speed; the heading is brought to 0.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state.
        reference: (2,) [m/s] governed velocity reference, updated; zero at the start of a flight.
        north_mps: [m/s]; a horizontal velocity beyond 0.999 of the limit is scaled to that.
        east_mps: [m/s].
        down_mps: [m/s] positive down, kept within its limits.
        u: (5,) lift and torques are written.
    """
    outside = _far_outside(vehicle, x, reference)
    if outside:
        reseed_reference(vehicle, x, reference)
    governed_north_mps, governed_east_mps = reference[0], reference[1]
    _govern(vehicle, x, reference, north_mps, east_mps)
    moved = (reference[0] != governed_north_mps) | (reference[1] != governed_east_mps)
    if (outside | moved) and _far_outside(vehicle, x, reference):
        _level_out(vehicle, x, u)
    else:
        _track(vehicle, x, reference, u)
    _hold_heading(vehicle, x, u)
    _lift_towards(vehicle, x, down_mps, u)


@kernel
def velocity_wrench(vehicle, x, reference, north_mps, east_mps, altitude_m, u):
    """Wrench for a horizontal velocity and an altitude to hold, positive up.

    The altitude is approached as fast as the limits allow and is not overshot where a stop at it
    is possible. Arguments as for `velocity_climb_wrench`.
    """
    A, B = vehicle.vertical_A, vehicle.vertical_B
    per_next_speed = B[S.POSITION] / B[S.SPEED]
    per_speed = A[S.POSITION, S.SPEED] - per_next_speed * A[S.SPEED, S.SPEED]
    way = -altitude_m - x[S.Z]
    if way > 0.0:
        brake = -vehicle.vertical_B[S.SPEED] * vehicle.lift_max_N
        down = _speed_towards(way, x[S.VZ], per_speed, per_next_speed, brake)
    else:
        brake = vehicle.vertical_B[S.SPEED] * vehicle.lift_min_N
        down = -_speed_towards(-way, -x[S.VZ], per_speed, per_next_speed, brake)
    velocity_climb_wrench(vehicle, x, reference, north_mps, east_mps, down, u)


@kernel
def acceleration_wrench(vehicle, x, reference, north_mps2, east_mps2, down_mps2, u):
    """Wrench for an acceleration held over the step, within the limits of speed.

    Horizontally the acceleration moves the governed reference, so that its bounds stay certified;
    vertically it is lift, -m times the acceleration. Arguments as for `velocity_climb_wrench`.
    """
    dt = vehicle.dt_s
    north = reference[0] + dt * north_mps2
    east = reference[1] + dt * east_mps2
    push = -vehicle.vertical_B[S.SPEED] * vehicle.mass_kg
    down = vehicle.vertical_A[S.SPEED, S.SPEED] * x[S.VZ] + push * down_mps2
    velocity_climb_wrench(vehicle, x, reference, north, east, down, u)
