"""Logs of autopilots, written as they would: for tests of what reads them."""

import struct
from importlib import import_module

import numpy as np

# by its name: its 30 000 generated lines take type checkers seconds
ardupilotmega = import_module("pymavlink.dialects.v20.ardupilotmega")

_CODES = {
    "Q": "Q",
    "B": "B",
    "I": "I",
    "H": "H",
    "L": "i",
    "f": "f",
    "c": "h",
    "h": "h",
    "Z": "64s",
}
_FORMATS = {
    "POS": (1, "QLLff", "TimeUS,Lat,Lng,Alt,RelHomeAlt"),
    "ATT": (2, "Qfff", "TimeUS,Roll,Pitch,Yaw"),
    "BAT": (3, "QBfff", "TimeUS,Inst,Volt,Curr,CurrTot"),
    "GPS": (4, "QBBIHBfLLf", "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt"),
    "EV": (5, "QB", "TimeUS,Id"),
    "ARM": (6, "QBI", "TimeUS,ArmState,ArmChecks"),
    "ERR": (7, "QBB", "TimeUS,Subsys,ECode"),
    "MSG": (8, "QZ", "TimeUS,Message"),
    "CURR": (9, "Qhhhf", "TimeUS,Throttle,Volt,Curr,CurrTot"),
}
"""Number, types and columns of each message, as ArduPilot 4.1 to 4.7 has them; `CURR` as 3.3."""

_FMT = 128
INSTANCE_4_0 = {"BAT": (3, "QBfff", "TimeUS,Instance,Volt,Curr,CurrTot")}
BAT2_3_6 = {
    "BAT": (3, "Qfff", "TimeUS,Volt,Curr,CurrTot"),
    "BAT2": (10, "Qfff", "TimeUS,Volt,Curr,CurrTot"),
}


def two_batteries(t, names):
    """What the monitors of a vehicle say at a time: 15 V and 36 A, and 1 V and 1 A."""
    first, second = (15.0, 36.0, 10.0 * t), (1.0, 1.0, 1.0)
    if "CURR" in names:
        return [("CURR", 0, 1500, 3600, 10.0 * t)]
    if "BAT2" in names:
        return [("BAT", *first), ("BAT2", *second)]
    return [("BAT", 0, *first), ("BAT", 1, *second)]


def bin_log(
    path, times_s, places, first_s=100.0, formats=None, said=(), armed=None, batteries=two_batteries
):
    """A data flash log: places (N, 3) in degrees and metres, 0.01 A h every second.

    Args:
        path: The file.
        times_s: (N,).
        places: (N, 3).
        first_s: The clock of the autopilot at t = 0.
        formats: Of messages that are not as usual; a name alone stands for the usual one.
        said: (t, name, values) of other messages.
        armed: (from, to); None: nothing is said of it.
        batteries: What the monitors say at t.
    """
    formats = {"BAT": _FORMATS["BAT"]} if formats is None else formats
    known = {k: v for k, v in _FORMATS.items() if k not in ("BAT", "CURR")} | formats
    out = [_format(_FMT, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89)]
    for name, (number, codes, labels) in known.items():
        size = 3 + struct.calcsize("<" + "".join(_CODES[c] for c in codes))
        out.append(_format(number, name, codes, labels, size))
    rows = []
    for t, (latitude, longitude, height) in zip(times_s, places, strict=True):
        e7 = (round(1e7 * latitude), round(1e7 * longitude))
        rows += [
            (t, "GPS", 0, 3, int(1e3 * (50_000 + t)), 2300, 12, 0.8, *e7, height),
            (t, "POS", *e7, 30.0 + height, height),
            (t, "ATT", 10.0, -5.0, (358.0 + 4.0 * t) % 360.0),
            *((t, *row) for row in batteries(t, known)),
        ]
    changes = [(armed[0], "EV", 10), (armed[1], "EV", 11)] if armed else []
    for t, name, *values in sorted([*rows, *changes, *said], key=lambda row: row[0]):
        out.append(_message(known, name, int(1e6 * (first_s + t)), *values))
    path.write_bytes(b"".join(out))


OLD_CURR = {"CURR": _FORMATS["CURR"]}


def _format(number, name, codes, labels, size):
    head = bytes([0xA3, 0x95, _FMT, number, size])
    return head + struct.pack("<4s16s64s", name.encode(), codes.encode(), labels.encode())


def _message(known, name, *values):
    number, codes, _ = known[name]
    values = [value.encode() if isinstance(value, str) else value for value in values]
    packed = struct.pack("<" + "".join(_CODES[c] for c in codes), *values)
    return bytes([0xA3, 0x95, number]) + packed


def tlog(
    path, times_s, places, systems=(1,), armed=None, said=(), battery_status=True, sys_status=None
):
    """Telemetry of vehicles, and of the ground station that kept it.

    Args:
        path: The file.
        times_s: (N,).
        places: (N, 3) degrees and metres; system -> such, where vehicles are at several.
        systems: Of the vehicles.
        armed: (from, to); None: no heartbeat says anything.
        said: (t, text).
        battery_status: Whether there are messages of the monitor.
        sys_status: t -> mV, cA and percent; as usual 15 V, 36 A, 50 percent.
    """
    out, said = [], list(said)
    for n, t in enumerate(times_s):
        for system in systems:
            latitude, longitude, height = (places[system] if isinstance(places, dict) else places)[
                n
            ]
            vehicle = ardupilotmega.MAVLink(None, srcSystem=system, srcComponent=1)
            roll, pitch, yaw = np.radians([10.0, -5.0, 4.0]).tolist()
            volts = [15_000] + 9 * [65_535]
            mV, cA, percent = sys_status(t) if sys_status else (15_000, 3_600, 50)
            messages = [
                vehicle.global_position_int_encode(
                    int(1e3 * t), round(1e7 * latitude), round(1e7 * longitude), 0,
                    round(1e3 * height), 0, 0, 0, 0,
                ),
                vehicle.attitude_encode(int(1e3 * t), roll, pitch, yaw, 0.0, 0.0, 0.0),
                vehicle.sys_status_encode(0, 0, 0, 0, mV, cA, percent, 0, 0, 0, 0, 0, 0),
            ]  # fmt: skip
            if battery_status:
                status = (volts, 3_600, int(10 * t), 0, 50)
                messages.append(vehicle.battery_status_encode(0, 0, 0, 0, *status))
            if armed:
                mode = 128 if armed[0] <= t < armed[1] else 0
                messages.append(vehicle.heartbeat_encode(2, 3, mode, 3, 4))
            while said and said[0][0] <= t:
                messages.append(vehicle.statustext_encode(2, said.pop(0)[1].encode()))
            out += [_stamped(t, message.pack(vehicle)) for message in messages]
        station = ardupilotmega.MAVLink(None, srcSystem=255, srcComponent=190)
        out.append(_stamped(t, station.heartbeat_encode(6, 8, 0, 0, 0).pack(station)))
    path.write_bytes(b"".join(out))


def _stamped(t, packed):
    return struct.pack(">Q", int(1e6 * (1.7e9 + t))) + packed


_TOPICS = {
    "vehicle_global_position": "uint64_t timestamp;double lat;double lon;float alt",
    "vehicle_local_position": (
        "uint64_t timestamp;float x;float y;float z;double ref_lat;double ref_lon;float ref_alt"
    ),
    "vehicle_attitude": "uint64_t timestamp;float[4] q",
    "vehicle_status": "uint64_t timestamp;uint8_t arming_state",
    "vehicle_land_detected": "uint64_t timestamp;bool landed",
    "home_position": "uint64_t timestamp;double lat;double lon;float alt",
    "vehicle_gps_position": "uint64_t timestamp;uint64_t time_utc_usec",
    "battery_status": (
        "uint64_t timestamp;float voltage_v;float current_a;float discharged_mah;float remaining"
    ),
}
_ULOG_CODES = {
    "uint64_t": "Q", "double": "d", "float": "f", "float[4]": "4f", "uint8_t": "B", "bool": "?"
}  # fmt: skip
HOME_ALT_M = 123.0


def ulog(path, times_s, places, armed, said=(), first_s=20.0, without=(), local_m=None):
    """A log of PX4 (docs.px4.io, ULog File Format), with a second battery that is of no use.

    Args:
        path: The file.
        times_s: (N,).
        places: (N, 3) degrees and metres.
        armed: (from, to).
        said: (t, text).
        first_s: The clock of the autopilot at t = 0.
        without: Topics that are not logged.
        local_m: (N, 3) north, east, height of its own map, whose origin is the first of `places`.
    """
    numbers = {name: n for n, name in enumerate([*_TOPICS, "battery_status 1"])}
    out = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", int(1e6 * first_s))]
    out.append(_ulog_message("B", bytes(40)))
    out += [_ulog_message("F", f"{name}:{fields};".encode()) for name, fields in _TOPICS.items()]
    for name, number in numbers.items():
        topic, _, instance = name.partition(" ")
        head = struct.pack("<BH", int(instance or 0), number)
        out.append(_ulog_message("A", head + topic.encode()))

    def data(t, name, *values):
        if name in without:
            return b""
        fields = [field.split() for field in _TOPICS[name.partition(" ")[0]].split(";")]
        codes = "".join(_ULOG_CODES[kind] for kind, _ in fields)
        packed = struct.pack("<" + codes, int(1e6 * (first_s + t)), *values)
        return _ulog_message("D", struct.pack("<H", numbers[name]) + packed)

    said = list(said)
    out.append(data(times_s[0], "home_position", 0.0, 0.0, HOME_ALT_M))
    for n, (t, (latitude, longitude, height)) in enumerate(zip(times_s, places, strict=True)):
        flies = armed[0] <= t < armed[1]
        turned = np.radians(0.5 * 40.0)
        out += [
            data(t, "vehicle_gps_position", int(1e6 * (1.7e9 + t))),
            data(t, "vehicle_global_position", latitude, longitude, HOME_ALT_M + height),
            *(
                data(
                    t,
                    "vehicle_local_position",
                    *(local_m[n] * (1.0, 1.0, -1.0)),
                    *places[0][:2],
                    HOME_ALT_M,
                )
                for _ in range(local_m is not None)
            ),
            data(t, "vehicle_attitude", np.cos(turned), 0.0, 0.0, np.sin(turned)),
            data(t, "vehicle_status", 2 if flies else 1),
            data(t, "vehicle_land_detected", not flies),
            data(t, "battery_status", 15.0, 36.0, 10.0 * t, 0.9),
            data(t, "battery_status 1", 1.0, 1.0, 1.0, 0.1),
        ]
        while said and said[0][0] <= t:
            at, text = said.pop(0)
            head = struct.pack("<BQ", ord("4"), int(1e6 * (first_s + at)))
            out.append(_ulog_message("L", head + text.encode()))
    path.write_bytes(b"".join(out))


def _ulog_message(kind, content):
    return struct.pack("<HB", len(content), ord(kind)) + content
