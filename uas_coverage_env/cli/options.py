"""Options as they are typed: of planners, and seeds."""

from collections.abc import Sequence

from uas_coverage_env.files.strict_toml import InputError

LAST_SEED = 2**64 - 1
"""The largest seed of a flight."""


def options_of(pairs: Sequence[str]) -> dict[str, str]:
    """Name -> value, as text.

    Args:
        pairs: KEY=VALUE each.

    Raises:
        InputError: One is no such pair, or a key is given twice.
    """
    options: dict[str, str] = {}
    for pair in pairs:
        key, separator, value = (part.strip() for part in pair.partition("="))
        if not key or not separator:
            raise InputError(f"--option {pair!r}: should be KEY=VALUE, as in horizon=12")
        if key in options:
            raise InputError(f"--option {key} is given twice; give it once")
        options[key] = value
    return options
