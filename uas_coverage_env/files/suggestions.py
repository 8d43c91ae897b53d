"""What a person probably meant by a name that there is not."""

import difflib
from collections.abc import Collection, Iterable

from uas_coverage_env.files.errors import InputError

_SHORT = 3
"""Of so few letters, two in common are chance."""

_AS_MANY = 3


def meant(name: str, known: Iterable[str]) -> str:
    """The known name that is closest to a misspelt one; empty where none is close.

    Short names need to be the beginning of the known one, or its letters in another order.
    """
    by_lower = {each.lower(): each for each in known}
    given = name[:80].lower()
    close = difflib.get_close_matches(given, by_lower, n=_AS_MANY)
    if len(given) <= _SHORT:
        close = [each for each in close if each.startswith(given) or sorted(each) == sorted(given)]
    return by_lower[close[0]] if close else ""


def did_you_mean(name: str, known: Iterable[str], otherwise: str) -> str:
    """How a message about an unknown name ends.

    Args:
        name: As it was given.
        known: The names that there are.
        otherwise: What to say where none of them is close.
    """
    closest = meant(name, known)
    return f"did you mean {closest}?" if closest else otherwise


def check_choice(option: str, value: str, known: Collection[str]) -> None:
    """Refuse a value that is none of those which an option takes.

    Raises:
        InputError: It is none; the message says which one was meant, or names them all.
    """
    if value not in known:
        end = did_you_mean(value, known, f"take {', '.join(known)}")
        raise InputError(f"{option} {value[:80]!r}: {end}")
