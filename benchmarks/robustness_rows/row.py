"""What a row of the reliability page is: trials that can be made apart, and a finding."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from return_mode import upper_bound

Result = dict[str, Any]
"""Of a trial: what JSON can hold. A trial that ends in an exception has `error` and nothing else.
"""


@dataclass(frozen=True)
class Trial:
    """One thing to try.

    Attributes:
        key: Unique within its row; says all that the trial depends on.
        run: A function of a module, so that another process finds it.
        arguments: For it.
    """

    key: str
    run: Callable[..., Result]
    arguments: tuple[Any, ...] = ()


@dataclass(frozen=True)
class Finding:
    """What a row has found.

    Attributes:
        trials: How many of its unit were tried.
        failures: How many of them failed the claim.
        table: Markdown; more than the two numbers say.
    """

    trials: int
    failures: int
    table: str = ""

    @property
    def at_most(self) -> float:
        """95 % upper bound of the share that fails (Clopper and Pearson's, one-sided)."""
        return upper_bound(self.failures, self.trials)


@dataclass(frozen=True)
class Row:
    """A row of the page.

    Attributes:
        name: R1 to R13.
        title: What is tried.
        unit: What is counted, in the plural.
        claim: What a trial has to do, else it has failed.
        trials: (quick) -> all trials, the same each time.
        finding: Results by key -> finding.
        seeds: (quick) -> the seeds in words.
        not_covered: What the row does not show.
    """

    name: str
    title: str
    unit: str
    claim: str
    trials: Callable[[bool], Sequence[Trial]]
    finding: Callable[[Mapping[str, Result]], Finding]
    seeds: Callable[[bool], str]
    not_covered: str


def markdown(headings: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table, its first column to the left and the others to the right."""
    lines = [f"| {' | '.join(headings)} |", "|---|" + "---:|" * (len(headings) - 1)]
    lines += [f"| {' | '.join(str(cell) for cell in row)} |" for row in rows]
    return "\n".join(lines)


def share(hits: int, trials: int) -> str:
    """Of how many, and the upper bound in per cent."""
    return f"{hits} of {trials}, ≤ {upper_bound(hits, trials):.2%}" if trials else "–"


def errors(results: Mapping[str, Result]) -> dict[str, str]:
    """The trials that ended in an exception."""
    return {key: result["error"] for key, result in results.items() if "error" in result}
