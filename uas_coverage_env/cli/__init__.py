"""The command line `uas-coverage`."""

from uas_coverage_env.cli.app import main

__all__ = ["main"]
