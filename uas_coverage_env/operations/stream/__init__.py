"""A plan flown in time: position targets that a companion computer sends to autopilots."""

from uas_coverage_env.operations.stream.clock import Clock, RealClock
from uas_coverage_env.operations.stream.companion import Ended, StreamOptions
from uas_coverage_env.operations.stream.run_stream import stream_flight

__all__ = ["Clock", "Ended", "RealClock", "StreamOptions", "stream_flight"]
