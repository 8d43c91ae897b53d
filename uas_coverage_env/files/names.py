"""What things may be called in files."""

from typing import Annotated

from pydantic import AfterValidator

_NAME_LETTERS = frozenset("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-")
_LONGEST_NAME = 64


def _checked_name(name: str) -> str:
    # names are columns of CSV files, keys of dictionaries and parts of file names
    if not 0 < len(name) <= _LONGEST_NAME or not _NAME_LETTERS.issuperset(name):
        raise ValueError(
            f"{name[:80]!r} is no valid name; use 1 to {_LONGEST_NAME} letters A to Z or a to z, "
            "digits, _ or -"
        )
    return name


Name = Annotated[str, AfterValidator(_checked_name)]
