"""Logs of an autopilot, written as it would: for tests of what reads them."""

import struct
from importlib import import_module

import numpy as np

# by its name: its 30 000 generated lines take type checkers seconds
ardupilotmega = import_module("pymavlink.dialects.v20.ardupilotmega")

_CODES = {"Q": "Q", "B": "B", "I": "I", "H": "H", "L": "i", "f": "f", "c": "h"}
_FORMATS = {
    "POS": (1, "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt"),
    "ATT": (2, "Qfff", "TimeUS,Roll,Pitch,Yaw"),
    "BAT": (3, "QBfff", "TimeUS,Inst,Volt,Curr,CurrTot"),
    "GPS": (4, "QBBIHBfLLf", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt"),
}
_FMT = 128


def bin_log(path, times_s, places, first_s=100.0):
    """A data flash log: places (N, 3) in degrees and metres, 0.01 A h every second."""
    out = [_format(_FMT, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89)]
    for name, (number, codes, labels) in _FORMATS.items():
        size = 3 + struct.calcsize("<" + "".join(_CODES[c] for c in codes))
        out.append(_format(number, name, codes, labels, size))
    for t, (latitude, longitude, height) in zip(times_s, places, strict=True):
        us, e7 = int(1e6 * (first_s + t)), (round(1e7 * latitude), round(1e7 * longitude))
        out += [
            _message("GPS", us, 0, 3, int(1e3 * (50_000 + t)), 2300, 12, 0.8, *e7, height),
            _message("POS", us, *e7, 30.0 + height, height),
            _message("ATT", us, 10.0, -5.0, (358.0 + 4.0 * t) % 360.0),
            _message("BAT", us, 0, 15.0, 360.0, 10.0 * t),
            _message("BAT", us, 1, 1.0, 1.0, 1.0),
        ]
    path.write_bytes(b"".join(out))


def _format(number, name, codes, labels, size):
    head = bytes([0xA3, 0x95, _FMT, number, size])
    return head + struct.pack("<4s16s64s", name.encode(), codes.encode(), labels.encode())


def _message(name, *values):
    number, codes, _ = _FORMATS[name]
    packed = struct.pack("<" + "".join(_CODES[c] for c in codes), *values)
    return bytes([0xA3, 0x95, number]) + packed


def tlog(path, times_s, places, systems=(1,)):
    """Telemetry of a vehicle, and of the ground station that kept it."""
    out = []
    for t, (latitude, longitude, height) in zip(times_s, places, strict=True):
        for system in systems:
            vehicle = ardupilotmega.MAVLink(None, srcSystem=system, srcComponent=1)
            ms = int(1e3 * t)
            roll, pitch, yaw = np.radians([10.0, -5.0, 4.0]).tolist()
            volts = [15_000] + 9 * [65_535]
            messages = [
                vehicle.global_position_int_encode(
                    ms, round(1e7 * latitude), round(1e7 * longitude), 0, round(1e3 * height),
                    0, 0, 0, 0,
                ),
                vehicle.attitude_encode(ms, roll, pitch, yaw, 0.0, 0.0, 0.0),
                vehicle.sys_status_encode(0, 0, 0, 0, 15_000, 3_600, 50, 0, 0, 0, 0, 0, 0),
                vehicle.battery_status_encode(0, 0, 0, 0, volts, 3_600, int(10 * t), 0, 50),
            ]  # fmt: skip
            out += [_stamped(t, message.pack(vehicle)) for message in messages]
        station = ardupilotmega.MAVLink(None, srcSystem=255, srcComponent=190)
        out.append(_stamped(t, station.heartbeat_encode(6, 8, 0, 0, 0).pack(station)))
    path.write_bytes(b"".join(out))


def _stamped(t, packed):
    return struct.pack(">Q", int(1e6 * (1.7e9 + t))) + packed
