"""A PX4 behind a loopback socket, which moves as the simulated ArduCopter does."""

import numpy as np
from simulated_vehicle import PARAMETERS, SimulatedVehicle, mav

PX4_PARAMETERS = {
    "COM_OBL_RC_ACT": 0,
    "COM_OF_LOSS_T": 1.0,
    "MPC_XY_VEL_MAX": 12.0,
    "MPC_Z_VEL_MAX_UP": 3.0,
    "MPC_Z_VEL_MAX_DN": 1.5,
    "MPC_ACC_HOR": 3.0,
    "RTL_RETURN_ALT": 30.0,
}


class SimulatedPX4(SimulatedVehicle):
    """A PX4 as its documentation has it: OFFBOARD lives on a stream of targets.

    It enters that mode only after more than a second of targets, no two of them half a second or
    more apart, and leaves it by itself where none comes for COM_OF_LOSS_T, to do what
    COM_OBL_RC_ACT says. It takes off by targets. In the stretch of time `deaf` it hears nothing.
    """

    autopilot = mav.MAV_AUTOPILOT_PX4
    manual, guided, land, hold = 3 << 16, 6 << 16, 4 << 16 | 6 << 24, 4 << 16 | 3 << 24
    home = 4 << 16 | 5 << 24
    whole = ("COM_OBL_RC_ACT",)

    def __init__(self, frame, home_m, deaf=(0.0, 0.0), **how):
        super().__init__(frame, home_m, **how)
        self._deaf, self._first_s, self._last_s = deaf, np.inf, -np.inf
        self.denied = 0

    def _defaults(self):
        return dict(PX4_PARAMETERS)

    def _of(self, name):
        here = {"WPNAV_SPEED": "MPC_XY_VEL_MAX", "WPNAV_ACCEL": "MPC_ACC_HOR"}.get(name)
        return PARAMETERS[name] if here is None else 100.0 * self.parameters[here]

    def step(self, dt_s):
        super().step(dt_s)
        lost_s = self.parameters["COM_OF_LOSS_T"]
        if self.mode == self.guided and self.time_s - self._last_s > lost_s + 0.05:
            act = int(self.parameters["COM_OBL_RC_ACT"])
            self._enter({3: self.home, 4: self.land}.get(act, self.hold))

    def _coded(self, name, value):
        if name not in self.whole:
            return value
        return float(np.array([int(value)], np.int32).view(np.float32)[0])

    def _enter(self, mode):
        super()._enter(mode)
        if mode == self.home and not self._way:
            home = complex(*self._home_m[:2])
            self._way = [(home, self._height), (self._place, self._height)]

    def _shape(self):
        if self.mode in (self.home, self.land):
            self._go_home(2.5)
        else:
            super()._shape()

    def _obey(self, message):
        if self._deaf[0] <= self.time_s < self._deaf[1]:
            return
        kind = message.get_type()
        if kind == "PARAM_SET" and message.param_id in self.whole:
            whole = np.array([message.param_value], np.float32).view(np.int32)[0]
            self.parameters[message.param_id] = int(whole)
            self._tell_parameter(message.param_id)
            return
        if kind == "SET_POSITION_TARGET_GLOBAL_INT":
            assert message.coordinate_frame in (5, 6, 11)
            if self.time_s - self._last_s >= 0.5:
                self._first_s = self.time_s
            self._last_s = self.time_s
        super()._obey(message)

    def _command(self, message):
        if message.command != mav.MAV_CMD_NAV_TAKEOFF:
            super()._command(message)

    def _may_enter(self, message):
        mode = int(message.param2) << 16 | int(message.param3) << 24
        is_streamed = self.time_s - self._last_s < 0.5 and self.time_s - self._first_s > 1.0
        if mode == self.guided and not is_streamed:
            self.denied += 1
            return False
        self._enter(mode)
        return True
