"""What a job is, and what a process does with it."""

import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from uas_coverage_env.files.errors import InputError


@dataclass(frozen=True)
class Job:
    """A call that any process can make.

    Attributes:
        key: By which it is known.
        call: A function of a module.
        arguments: What it takes; like the function and its result, they can be pickled.
    """

    key: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Lost:
    """A job whose process is gone.

    Attributes:
        reason: As far as it is known.
    """

    reason: str


class Crew(Protocol):
    """Processes that do jobs, here or on other machines."""

    def size(self) -> int:
        """How many jobs it takes now, those under way included."""
        ...

    def begin(self, job: Job, work: bytes) -> None:
        """Take a job; the work is for `done`."""
        ...

    def finished(self) -> list[tuple[Job, bytes | Lost]]:
        """Wait for news, or a moment; what `done` gave, or what was lost."""
        ...

    def abandon(self) -> None:
        """Stop what is under way."""
        ...

    def close(self) -> None:
        """End; stop what is under way."""
        ...


def done(work: bytes) -> bytes:
    """Do a job in a process of its own: its result and None, or None and what it raised."""
    try:
        call, arguments = pickle.loads(work)
        return pickle.dumps((call(*arguments), None))
    except Exception as error:  # it is the owner's, whatever it is
        try:
            pickled = pickle.dumps((None, error))
            pickle.loads(pickled)  # some cannot be made from their arguments
        except Exception:
            return pickle.dumps((None, InputError(f"{type(error).__name__}: {error}")))
        return pickled
