"""The decision before anything counts, which compiles: once in each process is enough."""

from collections.abc import Callable, Hashable

_DONE: set[Hashable] = set()


def rehearse_once(what: Hashable, rehearse: Callable[[], object]) -> None:
    """Rehearse, unless that has been done in this process.

    Args:
        what: Names all that decides what is compiled: kinds of planners and scenarios, no sizes.
        rehearse: Compiles it.
    """
    if what not in _DONE:
        rehearse()
        _DONE.add(what)
