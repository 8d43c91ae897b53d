"""What a person probably meant by a name that there is not."""

import difflib
from collections.abc import Iterable

# of three letters, two in common are chance
_SHORT = 3
_CLOSE, _CLOSE_IF_SHORT = 0.6, 0.75


def meant(name: str, known: Iterable[str]) -> str:
    """The known name that is closest to a misspelt one; empty where none is close."""
    by_lower = {each.lower(): each for each in known}
    cutoff = _CLOSE if len(name) > _SHORT else _CLOSE_IF_SHORT
    close = difflib.get_close_matches(name[:80].lower(), by_lower, n=1, cutoff=cutoff)
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
