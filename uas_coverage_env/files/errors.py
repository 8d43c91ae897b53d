"""The error of everything that is handed to us."""


class InputError(ValueError):
    """A mistake in what a person gave us: one line that names file, field, value and fix."""
