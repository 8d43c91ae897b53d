"""Programs as text that a person can check against the paper, and the comparison with it."""

import difflib
import re
import textwrap
from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden"
_COLUMN = re.compile(r"[a-z_][\w.]*\([\d,]*\)")
_TITLES = ("minimize", "subject to", "bounds", "binary", "general", "end")


def readable(milp, heading, only=""):
    """The LP text of a program without what nobody needs to read.

    Args:
        milp: the program.
        heading: what it says, and where in the paper; becomes comment lines.
        only: pattern of the row families to show; all where empty.
    """
    parts = _sections(milp.lp_text())
    rows = [row for row in parts["subject to"] if re.match(only, row)]
    cost = [] if only else parts["minimize"][:1]  # the constant is a line of its own
    shown = set(_COLUMN.findall(" ".join(cost + rows)))
    bounds = [b for b in parts["bounds"] if _column(b) in shown]
    free = [b for b in bounds if b.startswith("-inf") and b.endswith("<= inf")]
    lines = [f"\\ {line}" for line in textwrap.dedent(heading).strip().splitlines()]
    if free:
        lines.append("\\ Columns that are neither bounded below nor binary are free.")
    lines += ["minimize", *_wrapped(" ".join(cost) or "cost: 0")]
    if not only and milp.build().constant:
        lines.append(f"\\ plus the constant {milp.build().constant:.6g}")
    lines += ["subject to", *(line for row in rows for line in _wrapped(row))]
    if len(free) < len(bounds):
        lines += ["bounds", *(f" {_as_equation(b)}" for b in bounds if b not in free)]
    for title in ("binary", "general"):
        listed = [name for name in parts[title] if name in shown]
        if listed:
            lines += [title, *_wrapped(" ".join(listed))]
    return "\n".join([*lines, "end", ""])


def compare(request, name, text):
    """Fail with a readable difference, or write the file anew with --update-golden."""
    path = GOLDEN / f"{name}.lp"
    if request.config.getoption("--update-golden"):
        GOLDEN.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    if not path.exists():
        pytest.fail(f"no golden file {path.name}; look at what --update-golden writes")
    frozen = path.read_text(encoding="utf-8")
    difference = difflib.unified_diff(
        frozen.splitlines(), text.splitlines(), f"{name}.lp, frozen", f"{name}.lp, now", lineterm=""
    )
    message = "\n".join(difference)
    if message:
        pytest.fail(f"the program differs from its golden file:\n{message}", pytrace=False)


def _sections(text):
    parts = {title: [] for title in _TITLES}
    for line in text.splitlines():
        if line in _TITLES:
            current = parts[line]
        else:
            current.append(line.strip())
    return parts


def _column(bound):
    return _COLUMN.search(bound).group()


def _as_equation(bound):
    low, name, high = bound.split(" <= ")
    if low == high:
        return f"{name} = {low}"
    return f"{low} <= {name}" if high == "inf" else bound


def _wrapped(text):
    return textwrap.wrap(text, 98, initial_indent=" ", subsequent_indent="   ") or [" "]
