"""Autopilots behind loopback sockets, and a clock that drives them.

`SimulatedVehicle` flies as ArduCopter was seen to in its own simulator and as its sources say
(mode_guided.cpp, AC_PosControl, control.cpp: shaping of targets; events.cpp: failsafes): its wish
follows the target within 2.5 m/s² and a jerk, so that it needs 29 m to stop at 12 m/s and passes a
target that stands still; it follows its wish within its tilt and against its drag.
"""

import cmath
import math
import os
import socket
from importlib import import_module
from itertools import pairwise

os.environ.setdefault("MAVLINK20", "1")

import numpy as np
from simulated_motion import BRAKES_MPS2, STEP_S, ShapedMotion, towards

# by its name, as in `autopilot_logs.py`: its 30 000 generated lines take type checkers seconds
mav = import_module("pymavlink.dialects.v20.ardupilotmega")

STABILIZE, AUTO, GUIDED, LOITER, RTL, LAND, BRAKE, SMART_RTL = 0, 3, 4, 5, 6, 9, 17, 21
PREARM = mav.MAV_SYS_STATUS_PREARM_CHECK

PARAMETERS = {
    "WPNAV_SPEED": 1000.0,
    "WPNAV_SPEED_UP": 250.0,
    "WPNAV_SPEED_DN": 150.0,
    "WPNAV_ACCEL": 250.0,
    "WPNAV_ACCEL_Z": 100.0,
    "RTL_ALT": 1500.0,
    "GUID_TIMEOUT": 3.0,
    "FS_GCS_ENABLE": 0.0,
    "FS_GCS_TIMEOUT": 5.0,
    "FS_OPTIONS": 16.0,
    "SYSID_MYGCS": 255.0,
    "BATT_FS_LOW_ACT": 2.0,
    "DISARM_DELAY": 10.0,
}
"""Of ArduCopter 4.6 as it comes."""
RENAMED = {
    "WPNAV_SPEED": ("WP_SPD", 0.01),
    "WPNAV_SPEED_UP": ("WP_SPD_UP", 0.01),
    "WPNAV_SPEED_DN": ("WP_SPD_DN", 0.01),
    "WPNAV_ACCEL": ("WP_ACC", 0.01),
    "WPNAV_ACCEL_Z": ("WP_ACC_Z", 0.01),
    "RTL_ALT": ("RTL_ALT_M", 0.01),
    "SYSID_MYGCS": ("MAV_GCS_SYSID", 1.0),
}
"""By 4.7: name and factor."""
PILOTED = (STABILIZE, LOITER, BRAKE)
"""Modes in which FS_OPTIONS 16 lets nothing happen where the ground station is lost."""


class SimulatedVehicle(ShapedMotion):
    """An ArduCopter.

    Args:
        frame: The local frame of the plan.
        home_m: (3,) where it stands.
        drag: Of frame "+", which cannot hold 12 m/s, or "s500".
        slow: A stretch of time (from, to) [s] in which it makes only 1 m/s, as in a gale.
        cut: A stretch of time in which its link is cut, both ways.
        taken: A stretch of time in which a pilot flies it in LOITER, by `pilot_mps` (north, east).
        low_s: When its battery is low.
        refuses: Why it does not arm, known before (a check fails) and said when asked.
        balks: Why it does not arm, said only when asked.
        new_names: Whether parameters are called as in 4.7.
        parameters: What it has instead of the defaults; None: it knows no such.
    """

    autopilot = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    manual, guided, land, hold, home = STABILIZE, GUIDED, LAND, BRAKE, SMART_RTL
    forgets: tuple[str, ...] = ()
    whole: tuple[str, ...] = ()

    def __init__(
        self,
        frame,
        home_m,
        *,
        drag="+",
        slow=(0.0, 0.0),
        cut=(np.inf, np.inf),
        taken=(np.inf, np.inf),
        pilot_mps=(0.0, 0.0),
        low_s=np.inf,
        refuses=None,
        balks=None,
        new_names=False,
        parameters=None,
    ):
        self._frame, self._home_m = frame, np.array([*home_m[:2], 0.0])
        self._cut, self._taken = cut, taken
        self._pilot_mps, self._low_s = complex(*pilot_mps), low_s
        self._refuses, self._balks, self._new_names = refuses, balks, new_names
        self.parameters = self._defaults() | (parameters or {})
        self.parameters = {n: v for n, v in self.parameters.items() if v is not None}
        self.mode, self.armed, self.time_s, self._told_s = self.manual, False, 0.0, -np.inf
        self.armings, self.modes, self.path, self.heard = 0, [self.manual], [], []
        self.set_to = []
        self._armed_s, self._station_s, self._updated_s = 0.0, np.inf, -np.inf
        self._is_lost, self._was_low, self._was_taken = False, False, False
        super().__init__(complex(*home_m[:2]), drag, slow)
        self._crumbs, self._way = [(self._place, 0.0)], []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._peer = None
        self._link = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self._parser = mav.MAVLink(None)
        self._parser.robust_parsing = True

    def _defaults(self):
        if not self._new_names:
            return dict(PARAMETERS)
        names = {old: RENAMED.get(old, (old, 1.0)) for old in PARAMETERS}
        return {names[old][0]: value * names[old][1] for old, value in PARAMETERS.items()}

    def _of(self, name):
        """A parameter by its old name, in the unit of that."""
        new, factor = RENAMED.get(name, (name, 1.0))
        return self.parameters.get(name, self.parameters.get(new, 0.0) / factor)

    @property
    def place_m(self):
        return np.array([self._place.real, self._place.imag, -self._height])

    @place_m.setter
    def place_m(self, place_m):
        self._place, self._height = complex(*place_m[:2]), -float(place_m[2])

    @property
    def speed_mps(self):
        return abs(self._velocity)

    @property
    def port(self):
        return self._socket.getsockname()[1]

    @property
    def address(self):
        return f"udpout:127.0.0.1:{self.port}"

    @property
    def is_cut(self):
        return self._cut[0] <= self.time_s < self._cut[1]

    def step(self, dt_s):
        self._hear()
        for _ in range(max(1, round(dt_s / STEP_S))):
            self.time_s += STEP_S
            self._fail()
            if self.armed:
                self._move()
        self.path.append((self.time_s, *self.place_m))
        if self._peer is not None and not self.is_cut:
            self._report()

    def close(self):
        self._socket.close()

    # What it is told

    def _hear(self):
        while True:
            try:
                data, self._peer = self._socket.recvfrom(65_536)
            except BlockingIOError:
                return
            if not self.is_cut:
                for message in self._parser.parse_buffer(data) or ():
                    self._obey(message)

    def _obey(self, message):
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.get_srcSystem() == self._of("SYSID_MYGCS"):
            self._station_s = self.time_s
            self._is_lost = False
        elif kind == "PARAM_REQUEST_READ":
            self._tell_parameter(message.param_id)
        elif kind == "PARAM_SET":
            if message.param_id in self.parameters and message.param_id not in self.forgets:
                self.parameters[message.param_id] = message.param_value
                self.set_to.append((message.param_id, message.param_value))
            self._tell_parameter(message.param_id)
        elif kind == "COMMAND_LONG":
            self._command(message)
        elif kind == "SET_POSITION_TARGET_GLOBAL_INT" and self.mode == self.guided:
            place = 1e-7 * message.lat_int, 1e-7 * message.lon_int
            north, east, down = self._frame.to_ned(*place, message.alt)
            self._target, self._target_height = complex(north, east), -down
            self._ahead, self._ahead_up = complex(message.vx, message.vy), -message.vz
            self._flies, self._updated_s = "targets", self.time_s
            self.heard.append((self.time_s, (north, east, down), (message.vx, message.vy)))

    def _command(self, message):
        number, accepted = message.command, True
        if number == mav.MAV_CMD_DO_SET_MODE:
            accepted = self._may_enter(message)
        elif number == mav.MAV_CMD_COMPONENT_ARM_DISARM:
            accepted = self._arm_or_disarm(message.param1 > 0.5)
        elif number == mav.MAV_CMD_RUN_PREARM_CHECKS:
            if self._refuses:
                self._text(f"PreArm: {self._refuses}")
        elif number == mav.MAV_CMD_NAV_TAKEOFF:
            accepted = self.armed and self.mode == self.guided
            if accepted:
                self._flies, self._climbs_to = "take-off", message.param7
        self._say(self._link.command_ack_encode(number, 0 if accepted else 4))

    def _may_enter(self, message):
        mode = int(message.param2)
        if mode in (AUTO,) or (mode == SMART_RTL and len(self._crumbs) < 2):
            return False  # no mission; no way back is known
        self._enter(mode)
        return True

    def _arm_or_disarm(self, arms):
        if not arms:
            self.armed = self.armed and self._height > 0.2
            return not self.armed
        why = self._refuses or self._balks
        if why:
            self._text(f"Arm: {why}")
        elif not self.armed:
            self.armed, self._armed_s, self.armings = True, self.time_s, self.armings + 1
            self._crumbs = [(self._place, self._height)]
        return self.armed

    def _enter(self, mode):
        if mode != self.mode:
            self.mode = mode
            self.modes.append(mode)
            self._stand()
            if mode == SMART_RTL:
                self._way = [*self._crumbs]
            elif mode == RTL:
                height = max(self._height, 0.01 * self._of("RTL_ALT"))
                home = complex(*self._home_m[:2])
                self._way = [(home, height), (self._place, height)]

    # What it does by itself

    def _fail(self):
        if self._taken[0] <= self.time_s < self._taken[1] and not self._was_taken:
            self._was_taken = True
            self._enter(LOITER)
        elif self.time_s >= self._taken[1] and self.mode == LOITER:
            self._enter(self.guided)
        if not self.armed:
            return
        on_ground = self._height < 0.1 and self._flies == "stand"
        if on_ground and self.time_s > self._armed_s + self._of("DISARM_DELAY"):
            self.armed = False
        if self.time_s >= self._low_s and not self._was_low:
            self._was_low = True
            self._text("Battery 1 is low")
            self._enter({1: LAND, 2: RTL, 3: SMART_RTL}[int(self._of("BATT_FS_LOW_ACT"))])
        enabled = int(self._of("FS_GCS_ENABLE"))
        silent_s = self.time_s - self._station_s
        if enabled and not self._is_lost and silent_s > self._of("FS_GCS_TIMEOUT"):
            self._is_lost = True
            self._lose_station(enabled)

    def _lose_station(self, enabled):
        if self.mode in PILOTED and int(self._of("FS_OPTIONS")) & 16:
            return
        if enabled in (3, 4) and len(self._crumbs) > 1:
            self._enter(SMART_RTL)
        else:
            self._enter({1: RTL, 2: RTL, 3: RTL, 4: LAND, 5: LAND, 7: BRAKE}[enabled])

    # How it flies

    def _move(self):
        self._shape()
        self._follow()
        near, height = self._crumbs[-1]
        is_new = abs(near - self._place) > 2.0 or abs(height - self._height) > 2.0
        if is_new and self.mode != SMART_RTL:
            self._crumbs.append((self._place, self._height))

    def _shape(self):
        """Its wish, one step on."""
        most_mps2 = 0.01 * self._of("WPNAV_ACCEL")
        if self.mode == self.guided and self._flies == "targets":
            if self.time_s - self._updated_s > max(self._of("GUID_TIMEOUT"), 0.1):
                self._ahead, self._ahead_up = 0j, 0.0
            self._to_target()
            self._target += self._ahead * STEP_S
            self._target_height += self._ahead_up * STEP_S
        elif self.mode == self.guided and self._flies == "take-off":
            self._wish_to(0j, most_mps2, self._climbs_to)
        elif self.mode in (RTL, SMART_RTL, LAND):
            self._go_home(most_mps2)
        elif self.mode == LOITER:
            self._wish_to(self._pilot_mps, most_mps2, self._target_height)
        else:
            stops = BRAKES_MPS2 if self.mode == BRAKE else most_mps2
            self._wish_to(0j, stops, self._target_height)

    def _go_home(self, accel):
        while self._way:
            place, height = self._way[-1]
            gap = place - self._wish
            if abs(gap) < 2.0 and abs(height - self._height) < 3.0:
                self._way.pop()
                continue
            most = math.sqrt(accel * abs(self._left_m()))
            speed = min(0.01 * self._of("WPNAV_SPEED"), most)
            toward = gap / abs(gap) if abs(gap) > 1e-6 else 0j
            self._wish_to(toward * speed, accel, height)
            return
        self._flies = "land"
        self._speed_up(towards(0j, 1.0, accel), accel)
        rate = -0.5 if self._height < 10.0 else -1.5
        self._climb_up(self._wish_up, rate)

    def _left_m(self):
        """How far it may fly on until it has to turn or stand; at least some metres."""
        places = [self._wish, *(place for place, _ in reversed(self._way[-20:]))]
        left, first = 0.0, None
        for one, other in pairwise(places):
            leg = other - one
            if abs(leg) > 0.5:
                turn = 0.0 if first is None else abs(cmath.phase(leg / first))
                if turn > 0.5:
                    break
                first = leg if first is None else first
            left += abs(leg)
        return max(left, 2.0)

    # What it says

    def _report(self):
        state = 128 * self.armed + 1
        if self.time_s >= self._told_s + 1.0:
            self._told_s = self.time_s
            self._say(self._link.heartbeat_encode(2, self.autopilot, state, self.mode, 4))
            healthy = 0 if self._refuses else PREARM
            self._say(
                self._link.sys_status_encode(PREARM, PREARM, healthy, 0, 0, 0, 80, 0, 0, 0, 0, 0, 0)
            )
        latitude, longitude, height = self._frame.to_geodetic(self.place_m).tolist()
        whole = round(1e7 * latitude), round(1e7 * longitude), round(1e3 * height)
        velocity = self._velocity.real, self._velocity.imag, -self._climb
        rest = (round(1e3 * height), *(round(100 * v) for v in velocity), 0)
        clock = round(1e3 * self.time_s)
        self._say(self._link.global_position_int_encode(clock, *whole, *rest))

    def _tell_parameter(self, name):
        if name in self.parameters:
            kind = 6 if name in self.whole else 9
            value = self._coded(name, self.parameters[name])
            self._say(self._link.param_value_encode(name.encode(), value, kind, 1, 0))

    def _coded(self, name, value):
        return value

    def _text(self, text):
        self._say(self._link.statustext_encode(2, text.encode()))

    def _say(self, message):
        if self._peer is not None and not self.is_cut:
            self._socket.sendto(message.pack(self._link), self._peer)


class DrivenClock:
    """Time that passes only where it is waited for, for the vehicles too; `stop_s` interrupts.

    From `killed_s` on the companion is dead: its clock ends it, and vehicles fly on alone.
    """

    def __init__(self, vehicles, stop_s=np.inf):
        self._vehicles, self._stop_s, self._now_s = vehicles, stop_s, 0.0

    def now_s(self):
        return self._now_s

    def wait(self, seconds):
        self._now_s += seconds
        for vehicle in self._vehicles:
            vehicle.step(seconds)
        if self._now_s >= self._stop_s:
            self._stop_s = np.inf
            raise KeyboardInterrupt
