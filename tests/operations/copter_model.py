"""A small ArduCopter for the tests: it flies a .waypoints with its .param, and fails as it is told.

In our own words after ArduCopter 4.7's mode_auto.cpp, mode_rtl.cpp, mode_smart_rtl.cpp, events.cpp
and AP_BattMonitor_Backend.cpp. On straight legs it flies as
`planning.execution.leg_model` has it, which is held against recorded flights elsewhere.
"""

import warnings
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from pymavlink import mavwp

from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, Followed, follow
from uas_coverage_env.vehicle.battery import steady_current_A
from uas_coverage_env.vehicle.range import level_power_W

WAYPOINT, LAND, TAKE_OFF, DELAY, YAW, SPEED = 16, 21, 22, 93, 115, 178
RTL, SMART_RTL, LANDS = "RTL", "SMART_RTL", "LAND"
_BATTERY_ACTIONS = {1: LANDS, 2: RTL, 3: SMART_RTL, 4: SMART_RTL}
_RADIO_ACTIONS = {1: RTL, 3: LANDS, 4: SMART_RTL, 5: SMART_RTL}
_CONTINUE_IN_AUTO = 1
_SLOWER, _TIDIES_S = 1.4, 10.0
"""SmartRTL, as flown in its simulator in November 2026."""


@dataclass
class Flight:
    """What it did: places every `DT_S` from arming on, (time, mode), charge left, heading."""

    places_m: np.ndarray
    modes: list = field(default_factory=list)
    soc: float = 1.0
    crashed: bool = False


def items_of(path):
    """Items of a waypoint file, home first, as MAVProxy reads them."""
    loader = mavwp.MAVWPLoader()
    with warnings.catch_warnings():  # it leaves the file open
        warnings.simplefilter("ignore", ResourceWarning)
        loader.load(str(path))
    return [loader.wp(n) for n in range(loader.count())]


def values_of(text):
    """Lines of `NAME,VALUE`."""
    return {name: float(value) for name, value in (line.split(",") for line in text.split())}


class Copter:
    """One vehicle with a mission and its parameters."""

    def __init__(self, waypoints, param, frame, vehicle):
        self.values, self._vehicle = values_of(param), vehicle
        self._corners: list = []
        self._speeds: list = []
        self._holds: list = []
        self._delay_s = 0.0
        speed = self._value("WP_SPD", "WPNAV_SPEED")
        for item in items_of(waypoints)[1:]:
            if item.command == DELAY and not self._corners:
                self._delay_s = item.param1
            elif item.command == SPEED:
                speed = item.param2
            elif item.command in (TAKE_OFF, WAYPOINT):
                self._corners.append(np.append(frame.to_ned(item.x, item.y, 0.0)[:2], -item.z))
                if item.command == WAYPOINT:
                    self._speeds.append(speed)
                    self._holds.append(float(item.param1))
        self._by = Autopilot(
            speed_mps=self._value("WP_SPD", "WPNAV_SPEED"),
            up_mps=self._value("WP_SPD_UP", "WPNAV_SPEED_UP"),
            down_mps=self._value("WP_SPD_DN", "WPNAV_SPEED_DN"),
            corner_m=self._value("WP_RADIUS_M", "WPNAV_RADIUS"),
        )

    def _value(self, new, old):
        return self.values[new] if new in self.values else self.values[old] / 100.0

    def planned(self, arm_wait_s=0.0):
        """The mission from arming on; a NAV_DELAY on the ground counts from AUTO on."""
        wait_s = max(self._delay_s - arm_wait_s, 0.0)
        flown = follow(self._corners, self._speeds, self._holds, self._by, wait_s)
        return Followed(flown.times_s, flown.places_m, flown.corner_s)

    def fly(self, *, radio_lost_s=None, pack_share=1.0):
        """Arm, fly, and come home; a pack may hold less than the vehicle file says."""
        planned = self.planned()
        places, lands_s = list(planned.places_m), planned.corner_s[-1]
        done = Flight(np.array(places))
        volts_low_s, drawn_mAh, k = 0.0, 0.0, 0
        returning = False
        while k < len(places):
            current_A, volts = self._electrics(done.soc)
            drawn_mAh += current_A * DT_S / 3.6
            done.soc -= current_A * DT_S / 3600.0 / (pack_share * self._capacity_Ah)
            if done.soc <= 0.0 and -places[k][2] > 0.3:
                done.crashed = True
                break
            left_mAh = self.values["BATT_CAPACITY"] - drawn_mAh
            volts_low_s = volts_low_s + DT_S if volts < self.values["BATT_LOW_VOLT"] else 0.0
            action = None
            landing = k * DT_S >= lands_s and self.values["FS_OPTIONS"] // 8 % 2
            if not returning and not landing and -places[k][2] > 0.3:
                if left_mAh < self.values["BATT_LOW_MAH"] or volts_low_s > 10.0:
                    action = _BATTERY_ACTIONS[self.values["BATT_FS_LOW_ACT"]]
                elif radio_lost_s is not None and k * DT_S >= radio_lost_s:
                    action = self._radio_action()
                    radio_lost_s = None
            if action is not None:
                returning = True
                done.modes.append((k * DT_S, action))
                places[k + 1 :] = self.way_home(action, places[: k + 1])
            k += 1
        done.places_m = np.array(places[:k])
        return done

    def _radio_action(self):
        if int(self.values.get("FS_OPTIONS", 16)) & _CONTINUE_IN_AUTO:
            return None
        return _RADIO_ACTIONS[self.values.get("FS_THR_ENABLE", 1.0)]

    @property
    def _capacity_Ah(self):
        return self._vehicle.battery.capacity_Ah

    def _electrics(self, soc):
        battery = self._vehicle.battery
        current_A = steady_current_A(battery, 1.0 - soc, level_power_W(self._vehicle))
        rest_V = np.interp(1.0 - soc, battery.ocv_dod, battery.ocv_V)
        return current_A, rest_V - current_A * (
            battery.resistance_0_ohm + battery.resistance_th_ohm
        )

    def way_home(self, action, places):
        """Where it flies from the last of these places on."""
        here = places[-1]
        level_mps = (here - places[-min(3, len(places))])[:2] / (DT_S * min(2, len(places) - 1))
        speed, a = np.linalg.norm(level_mps), self._by.acceleration_mps2
        brakes_m = 0.5 * a + speed**2 / (2.0 * a) if speed > a else speed
        stop = here + np.append(level_mps * (brakes_m / max(speed, 1e-9)), 0.0)
        steps = max(round(speed / a / DT_S), 1)
        way = [here + (stop - here) * n / steps for n in range(1, steps + 1)]
        if action == SMART_RTL:
            back = [p for p in places if -p[2] >= -self._corners[0][2] - 0.1][::-1]
            moving = [p for p, q in pairwise(back) if np.any(p != q)]
            slow = [moving[int(n / _SLOWER)] for n in range(int(_SLOWER * len(moving)))]
            return way + [stop] * round(_TIDIES_S / DT_S) + slow + self._lands(self._corners[0])
        if action == RTL:
            most_m = self.values["FENCE_ALT_MAX"] - self.values["FENCE_MARGIN"]
            height_m = min(max(self._value("RTL_ALT_M", "RTL_ALT"), -stop[2]), most_m)
            up = np.array([*stop[:2], min(stop[2], -height_m)])
            home = np.array([*self._corners[0][:2], up[2]])
            speeds = [self._by.speed_mps] * 2
            flown = follow([stop, up, home], speeds, [0.1, 0.0], self._by, takes_off=False)
            return way + list(flown.places_m)
        return way + self._lands(stop)

    def _lands(self, above):
        return list(follow([above, above], [1.0], [0.0], self._by, takes_off=False).places_m)
