"""A plan flown in time: position targets that a companion computer sends to autopilots."""

from uas_coverage_env.operations.stream.clock import Clock, RealClock
from uas_coverage_env.operations.stream.companion import Companion, Ended, StreamOptions
from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.stream_flight import stream_flight
from uas_coverage_env.operations.stream.timeline import Timeline, timeline_of

__all__ = [
    "Clock",
    "Companion",
    "Ended",
    "RealClock",
    "StreamOptions",
    "Timeline",
    "VehicleLink",
    "stream_flight",
    "timeline_of",
]
