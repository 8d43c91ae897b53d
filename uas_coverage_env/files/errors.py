"""The errors that the command line reports in one line."""


class InputError(ValueError):
    """A mistake in what a person gave us: one line that names file, field, value and fix."""


class PlannerError(ValueError):
    """A planner gave commands that cannot be flown; names planner, time, UAS and value."""
