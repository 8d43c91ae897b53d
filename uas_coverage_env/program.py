"""The program `uas-coverage`."""

from uas_coverage_env.interruptions import STOPPED, ctrl_c_ends_the_program


def main() -> int:
    """Import the command line and run it; returns the exit code."""
    try:
        with ctrl_c_ends_the_program():
            from uas_coverage_env.cli import main as run
        return run()
    except KeyboardInterrupt:  # just before a command is ready for it
        return STOPPED
