"""Multi-UAS area coverage with a physical battery: one world for every planner.

Importing the package registers the environments with Gymnasium and PettingZoo, nothing else: its
names are imported when they are first asked for, from where `__init__.pyi` says.
"""

import sys

if sys.argv[:1] == ["-m"] and __name__ in sys.orig_argv:  # `python -m uas_coverage_env` begins here
    from uas_coverage_command import end_at_ctrl_c

    end_at_ctrl_c()

import lazy_loader

from uas_coverage_env.registration import register_environments

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

register_environments()
