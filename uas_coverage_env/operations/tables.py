"""Tables of the docs on what is read, written and done: each made from what decides it."""

from collections.abc import Sequence

Table = tuple[tuple[str, ...], Sequence[tuple[str, ...]]]
"""Head and rows."""
