"""How ArduCopter moves: targets shaped to a wish, and a body that follows the wish.

As it was seen to in its own simulator, and as its sources say (AC_PosControl, control.cpp).
"""

import math

STEP_S = 0.05
_JERK, _JERK_Z = 5.0, 5.0
BRAKES_MPS2 = 7.5
_TILT_MPS2 = 9.81 * math.tan(math.radians(30.0))
DRAG = {"+": (0.222, 0.0344), "s500": (0.254, 0.0)}
"""Of the simulator's frames: drag, per m/s [m/s²] and per (m/s)²; "+" was seen to make 10.0 m/s."""
_CORNER = 0.7


def towards(error, gain, most):
    """A speed that closes a gap within an acceleration: `sqrt_controller`."""
    size = abs(error)
    if size < 1e-9:
        return 0.0 * error
    linear = most / gain**2
    if size > linear:
        speed = math.sqrt(2.0 * most * (size - 0.5 * linear))
    else:
        speed = gain * size
    return error * (min(speed, size / STEP_S) / size)


def _limited(vector, most):
    size = abs(vector)
    return vector if size <= most else vector * (most / size)


def _in_corner(velocity, accel, most):
    """Cross-track acceleration goes first: `limit_accel_corner_xy`."""
    if not abs(velocity):
        return _limited(accel, most)
    along = velocity / abs(velocity)
    turned = accel * along.conjugate()
    if abs(turned.real) <= abs(turned.imag):
        return _limited(accel, most)
    cross = max(-_CORNER * most, min(_CORNER * most, turned.imag))
    rest = math.sqrt(most**2 - cross**2)
    return complex(max(-rest, min(rest, turned.real)), cross) * along


class ShapedMotion:
    """Place, velocity and wish of a vehicle; parameters are those of its `_of`.

    Attributes:
        mode: The one that it flies in.
        armed: Whether its motors run.
    """

    mode: int
    armed: bool

    def __init__(self, place, drag, slow):
        self._drag, self._slow = DRAG[drag], slow
        self._place, self._height, self._velocity, self._climb = place, 0.0, 0j, 0.0
        self._thrust, self._is_limited = 0j, False
        self._stand()

    def _stand(self):
        self._flies = "stand"
        self._target, self._target_height = self._place, self._height
        self._ahead, self._ahead_up, self._climbs_to = 0j, 0.0, 0.0
        self._wish, self._wish_mps, self._wish_mps2 = self._place, self._velocity, 0j
        self._wish_up, self._wish_climb, self._wish_climb2 = self._height, self._climb, 0.0

    def _follow(self):
        """The body, one step on."""
        drag, quadratic = self._drag
        error = self._wish - self._place
        wanted = self._wish_mps2 + 2.0 * (self._wish_mps - self._velocity + error)
        against = self._velocity * (drag + quadratic * abs(self._velocity))
        tilted = _limited(wanted + against, _TILT_MPS2)
        self._is_limited = abs(wanted + against) > _TILT_MPS2
        self._thrust += (tilted - self._thrust) * min(1.0, STEP_S / 0.15)
        self._velocity += (self._thrust - against) * STEP_S
        if self._slow[0] <= self.time_s < self._slow[1]:
            slower = max(1.0, abs(self._velocity) - 4.0 * STEP_S)
            self._velocity = _limited(self._velocity, slower)
        self._place += self._velocity * STEP_S
        climb = self._wish_climb + 2.0 * (self._wish_up - self._height)
        self._climb += (climb - self._climb) * min(1.0, STEP_S / 0.2)
        self._height += self._climb * STEP_S
        if self._height <= 0.0:
            self._height, self._climb, self._velocity = 0.0, 0.0, 0j
            if self._flies == "land":
                self.armed = False

    def _to_target(self):
        """`shape_pos_vel_accel_xy` and the same for the height."""
        accel = 0.01 * self._of("WPNAV_ACCEL")
        gain = 0.5 * _JERK / accel
        speed = _limited(
            towards(self._target - self._wish, gain, 0.5 * accel), 0.01 * self._of("WPNAV_SPEED")
        )
        self._speed_up(speed + self._ahead, accel)
        self._climb_up(self._target_height, self._ahead_up)

    def _wish_to(self, velocity, accel, height):
        self._speed_up(velocity, accel)
        self._climb_up(height, 0.0)

    def _speed_up(self, speed, accel):
        gap = speed - self._wish_mps
        wanted = _in_corner(speed, towards(gap, _JERK / accel, _JERK), accel)
        self._wish_mps2 += _limited(wanted - self._wish_mps2, _JERK * STEP_S)
        step, faster = self._wish_mps * STEP_S, self._wish_mps2 * STEP_S
        if self._is_limited and abs(self._thrust):
            # no wish runs away from a vehicle that cannot follow
            along = self._thrust / abs(self._thrust)
            behind = ((self._wish - self._place) * along.conjugate()).real
            slower = ((self._wish_mps - self._velocity) * along.conjugate()).real
            ahead = (step * along.conjugate()).real
            if behind > 0.0 and ahead > 0.0:
                step -= along * ahead
            gain = (faster * along.conjugate()).real
            if slower > 0.0 and gain > 0.0:
                faster -= along * gain
        self._wish += step
        self._wish_mps += faster

    def _climb_up(self, height, ahead):
        accel = 0.01 * self._of("WPNAV_ACCEL_Z")
        up, down = 0.01 * self._of("WPNAV_SPEED_UP"), 0.01 * self._of("WPNAV_SPEED_DN")
        speed = towards(height - self._wish_up, 0.5 * _JERK_Z / accel, 0.5 * accel)
        speed = max(-down, min(up, speed)) + ahead
        gap = speed - self._wish_climb
        wanted = max(-accel, min(accel, towards(gap, _JERK_Z / accel, _JERK_Z)))
        change = _JERK_Z * STEP_S
        self._wish_climb2 += max(-change, min(change, wanted - self._wish_climb2))
        self._wish_up += self._wish_climb * STEP_S
        self._wish_climb += self._wish_climb2 * STEP_S
