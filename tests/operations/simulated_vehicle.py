"""Autopilots of a few lines behind loopback sockets, and a clock that drives them."""

import os
import socket
from importlib import import_module

os.environ.setdefault("MAVLINK20", "1")

import numpy as np

# by its name, as in `autopilot_logs.py`: its 30 000 generated lines take type checkers seconds
mav = import_module("pymavlink.dialects.v20.ardupilotmega")

STABILIZE, GUIDED, LAND = 0, 4, 9


class SimulatedVehicle:
    """An ArduCopter: goes where its targets are, no faster than it can.

    `slow` is a stretch of time (from, to) [s] in which it makes only 1 m/s; from `silent_s` on it
    says nothing; at `taken_s` its pilot takes it over.
    """

    autopilot = mav.MAV_AUTOPILOT_ARDUPILOTMEGA
    manual, guided, land = STABILIZE, GUIDED, LAND

    def __init__(self, frame, home_m, slow=(0.0, 0.0), silent_s=np.inf, taken_s=np.inf):
        self._frame = frame
        self.place_m = np.array([*home_m[:2], 0.0])
        self._slow, self._silent_s, self._taken_s = slow, silent_s, taken_s
        self.mode, self.armed, self.time_s, self._told_s = self.manual, False, 0.0, -np.inf
        self._target_m, self._ahead_mps, self._climbs_to_m = None, np.zeros(3), None
        self.modes, self.path = [self.manual], []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._peer = None
        self._link = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self._parser = mav.MAVLink(None)
        self._parser.robust_parsing = True

    @property
    def port(self):
        return self._socket.getsockname()[1]

    @property
    def address(self):
        return f"udpout:127.0.0.1:{self.port}"

    def step(self, dt_s):
        self._hear()
        self.time_s += dt_s
        if self.time_s >= self._taken_s and self.mode == self.guided:
            self._enter(self.manual)
        self._move(dt_s)
        self.path.append((self.time_s, *self.place_m))
        if self._peer is not None and self.time_s < self._silent_s:
            self._report()

    def close(self):
        self._socket.close()

    def _enter(self, mode):
        if mode != self.mode:
            self.mode = mode
            self.modes.append(mode)
            self._target_m = None

    def _hear(self):
        while True:
            try:
                data, self._peer = self._socket.recvfrom(65_536)
            except BlockingIOError:
                return
            for message in self._parser.parse_buffer(data) or ():
                self._obey(message)

    def _obey(self, message):
        kind = message.get_type()
        if kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_DO_SET_MODE:
            self._enter(int(message.param2))
        elif kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = True
        elif kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_NAV_TAKEOFF:
            if self.armed and self.mode == self.guided:
                self._climbs_to_m = message.param7
        elif kind == "SET_POSITION_TARGET_GLOBAL_INT" and self.mode == self.guided:
            place = 1e-7 * message.lat_int, 1e-7 * message.lon_int
            self._target_m = self._frame.to_ned(*place, message.alt)
            self._ahead_mps = np.array([message.vx, message.vy, message.vz])

    def _move(self, dt_s):
        if not self.armed:
            return
        wanted_mps = np.zeros(3)
        if self.mode == self.land:
            wanted_mps[2] = 1.5
        elif self._target_m is not None:
            wanted_mps = self._ahead_mps + (self._target_m - self.place_m)
        elif self._climbs_to_m is not None:
            wanted_mps[2] = np.clip(-self._climbs_to_m - self.place_m[2], -2.5, 1.5)
        most_mps = 1.0 if self._slow[0] <= self.time_s < self._slow[1] else 15.0
        share = min(1.0, most_mps / max(np.linalg.norm(wanted_mps), 1e-9))
        self.place_m = self.place_m + dt_s * share * wanted_mps
        if self.place_m[2] >= 0.0 and self.mode == self.land:
            self.place_m[2], self.armed = 0.0, False

    def _report(self):
        state = 128 * self.armed + 1
        if self.time_s >= self._told_s + 1.0:
            self._told_s = self.time_s
            self._say(self._link.heartbeat_encode(2, self.autopilot, state, self.mode, 4))
        latitude, longitude, height = self._frame.to_geodetic(self.place_m).tolist()
        whole = round(1e7 * latitude), round(1e7 * longitude), round(1e3 * height)
        rest = (round(1e3 * height), 0, 0, 0, 0)
        clock = round(1e3 * self.time_s)
        self._say(self._link.global_position_int_encode(clock, *whole, *rest))

    def _say(self, message):
        self._socket.sendto(message.pack(self._link), self._peer)


class SimulatedPX4(SimulatedVehicle):
    """A PX4 as its documentation has it: OFFBOARD lives on a stream of targets.

    It enters that mode only after more than a second of targets, no two of them half a second or
    more apart, and leaves it by itself where none comes for a second (COM_OF_LOSS_T), to hold its
    position (COM_OBL_RC_ACT = 5). It takes off by targets. In the stretch of time `deaf` it hears
    nothing.
    """

    autopilot = mav.MAV_AUTOPILOT_PX4
    manual, guided, land, hold = 3 << 16, 6 << 16, 4 << 16 | 6 << 24, 4 << 16 | 3 << 24

    def __init__(self, frame, home_m, deaf=(0.0, 0.0), **how):
        super().__init__(frame, home_m, **how)
        self._deaf, self._first_s, self._last_s = deaf, np.inf, -np.inf
        self.denied = 0

    def step(self, dt_s):
        super().step(dt_s)
        if self.mode == self.guided and self.time_s - self._last_s > 1.0:
            self._enter(self.hold)

    def _obey(self, message):
        if self._deaf[0] <= self.time_s < self._deaf[1]:
            return
        kind = message.get_type()
        if kind == "SET_POSITION_TARGET_GLOBAL_INT":
            assert message.coordinate_frame in (5, 6, 11)
            if self.time_s - self._last_s >= 0.5:
                self._first_s = self.time_s
            self._last_s = self.time_s
        if kind == "COMMAND_LONG" and message.command == mav.MAV_CMD_DO_SET_MODE:
            mode = int(message.param2) << 16 | int(message.param3) << 24
            is_streamed = self.time_s - self._last_s < 0.5 and self.time_s - self._first_s > 1.0
            if mode == self.guided and not is_streamed:
                self.denied += 1
            else:
                self._enter(mode)
        elif kind != "COMMAND_LONG" or message.command != mav.MAV_CMD_NAV_TAKEOFF:
            super()._obey(message)


class DrivenClock:
    """Time that passes only where it is waited for, for the vehicles too; `at` may interrupt."""

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
