"""A ground station that is not ours and a vehicle, connected by bytes in memory.

MAVSDK (C++, with its own parser of QGroundControl plans) uploads mission, fence and rally points by
the mission protocol; a vehicle made of pymavlink's messages keeps them as an autopilot would: whole
1e-7 degrees and 32-bit floats.
"""

import os
import threading
import time
from importlib import import_module
from typing import Any

os.environ.setdefault("MAVLINK20", "1")

from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mission_raw import MissionRaw

# by its name: its 30 000 generated lines take type checkers seconds
mav = import_module("pymavlink.dialects.v20.ardupilotmega")

MISSION, FENCE, RALLY = 0, 1, 2
_BEAT_S, _PAUSE_S, _PATIENCE_S = 0.5, 0.001, 10.0


class Vehicle:
    """Takes part in the mission protocol; `held[kind]` is what it was given."""

    def __init__(self, send: Any) -> None:
        self.held: dict[int, list[Any]] = {MISSION: [], FENCE: [], RALLY: []}
        self._send = send
        self._link: Any = mav.MAVLink(None, srcSystem=1, srcComponent=1)
        self._parser: Any = mav.MAVLink(None)
        self._parser.robust_parsing = True
        self._counts: dict[int, int] = {}
        self._coming: dict[int, list[Any]] = {}

    def beat(self) -> None:
        """Say that it is there."""
        self._say(
            self._link.heartbeat_encode(
                mav.MAV_TYPE_QUADROTOR, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 0, 0, 4
            )
        )

    def hear(self, data: bytes) -> None:
        """Answer what arrives."""
        for message in self._parser.parse_buffer(data) or ():
            kind = message.get_type()
            if kind == "MISSION_COUNT":
                self._counts[message.mission_type] = message.count
                self._coming[message.mission_type] = []
                self._next(message)
            elif kind == "MISSION_ITEM_INT":
                coming = self._coming.get(message.mission_type)
                if coming is not None and message.seq == len(coming):
                    coming.append(message)
                    self._next(message)
            elif kind == "MISSION_CLEAR_ALL":
                self.held[message.mission_type] = []
                self._acknowledge(message)
            elif kind == "COMMAND_LONG":  # questions about versions: a refusal is an answer
                refused = mav.MAV_RESULT_UNSUPPORTED
                self._say(self._link.command_ack_encode(message.command, refused))

    def _next(self, message: Any) -> None:
        """Ask for the next item, or keep them all."""
        kind = message.mission_type
        if len(self._coming[kind]) < self._counts[kind]:
            to = message.get_srcSystem(), message.get_srcComponent()
            number = len(self._coming[kind])
            self._say(self._link.mission_request_int_encode(*to, number, kind))
        else:
            self.held[kind] = self._coming.pop(kind)
            self._acknowledge(message)

    def _acknowledge(self, message: Any) -> None:
        to = message.get_srcSystem(), message.get_srcComponent()
        accepted = mav.MAV_MISSION_ACCEPTED
        self._say(self._link.mission_ack_encode(*to, accepted, message.mission_type))

    def _say(self, message: Any) -> None:
        self._send(bytes(message.pack(self._link)))


class Bench:
    """MAVSDK and the vehicle; to be closed."""

    def __init__(self) -> None:
        ground = ComponentType.GROUND_STATION
        self._station = Mavsdk(Configuration.create_with_component_type(ground))
        self._station.add_any_connection("raw://")
        self.vehicle = Vehicle(self._station.pass_received_raw_bytes)
        self._queue: list[bytes] = []
        self._lock = threading.Lock()
        self._station.subscribe_raw_bytes_to_be_sent(self._keep)
        self._on = True
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        self._missions = MissionRaw(self._system())

    def read_plan(self, text: str) -> Any:
        """What MAVSDK understands of a .plan: mission, fence and rally items."""
        return self._missions.import_qgroundcontrol_mission_from_string(text)

    def read_waypoints(self, text: str) -> Any:
        """What MAVSDK understands of a .waypoints file."""
        return self._missions.import_mission_planner_mission_from_string(text)

    def upload(self, items: Any) -> dict[int, list[Any]]:
        """Send all that was read; returns what the vehicle holds then."""
        self._missions.upload_mission(items.mission_items)
        self._missions.upload_geofence(items.geofence_items)
        self._missions.upload_rally_points(items.rally_items)
        return self.vehicle.held

    def close(self) -> None:
        """End it."""
        self._on = False
        self._thread.join()
        self._station.destroy()

    def _system(self) -> Any:
        until = time.monotonic() + _PATIENCE_S
        while time.monotonic() < until:
            for system in self._station.get_systems():
                if system.has_autopilot():
                    return system
            time.sleep(0.05)
        raise RuntimeError("MAVSDK sees no vehicle")

    def _keep(self, data: Any, *_: Any) -> None:
        with self._lock:
            self._queue.append(bytes(data))

    def _serve(self) -> None:
        last = -_BEAT_S
        while self._on:
            if time.monotonic() - last > _BEAT_S:
                self.vehicle.beat()
                last = time.monotonic()
            with self._lock:
                waiting, self._queue = self._queue, []
            for data in waiting:
                self.vehicle.hear(data)
            time.sleep(_PAUSE_S)
