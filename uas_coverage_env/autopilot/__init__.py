"""What flies a UAS: control, guidance past obstacles, return mode and safety filter."""

from uas_coverage_env.autopilot.control import write_command

__all__ = ["write_command"]
