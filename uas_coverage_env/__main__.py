"""`python -m uas_coverage_env`: the command `uas-coverage`."""

import sys

from uas_coverage_env.program import main

sys.exit(main())
