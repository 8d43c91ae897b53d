"""The page `RELIABILITY.md`, made of what the rows have found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from importlib.metadata import version

from robustness_rows import ROWS
from robustness_rows.row import Finding, Row, errors, markdown
from robustness_rows.store import Store

_HEAD = """# Reliability

What was tried to make the software fail, and how often it did. This page is generated:

```
python benchmarks/robustness.py --quick
```

Without `--quick` far more is tried. Each row names the command that it is from, and the source \
code: its hash, and how many trials were made with it.

Each bound is the exact one-sided 95 % bound (Clopper and Pearson) of the share that fails, of the \
trials as they are drawn here: missions of other kinds may fail more often. Version {version}.
"""


def page(stores: Mapping[str, Store], quick: bool, before: str = "") -> tuple[str, bool]:
    """The text of the page, and whether anything failed its claim.

    Args:
        stores: Results of every row, by its name.
        quick: Whether the quick sizes were asked for.
        before: The page as it is: rows of which there are no results keep what it says.
    """
    parts, summary, failed, known = [], [], False, _made_before(before)
    for name, row in ROWS.items():
        store = stores[name]
        results = {key: entry["result"] for key, entry in store.entries.items()}
        if not results and name in known:
            line, part = known[name]
            summary.append(line)
            parts.append(part)
            continue
        if not results:
            summary.append((name, row.title, "not made", "–", "–"))
            parts.append(f"## {name}: {row.title}\n\nNot made in this run.\n")
            continue
        finding = row.finding(results)
        failed |= finding.failures > 0
        bound = f"{finding.at_most:.2%}"
        counted = f"{finding.trials:,} {row.unit}"
        summary.append((name, row.title, counted, f"{finding.failures:,}", bound))
        parts.append(_section(row, store, finding, quick))
    summary.sort(key=lambda line: int(line[0][1:]))
    parts.sort(key=lambda part: int(part.removeprefix("## R").partition(":")[0]))
    headings = ("row", "what", "tried", "failed", "share at most")
    head = _HEAD.format(version=version("uas-coverage-env"))
    return "\n".join([head, _left(markdown(headings, summary)), "", *parts]), failed


def _made_before(text: str) -> dict[str, tuple[tuple[str, ...], str]]:
    """Row -> its line in the table at the top, and its section, of those that were made."""
    sections = {part.split(":", 1)[0]: f"## {part}" for part in text.split("\n## ")[1:]}
    lines = [
        tuple(cell.strip() for cell in line.strip("| \n").split("|"))
        for line in text.split("\n## ")[0].splitlines()
        if line.startswith("| R")
    ]
    return {
        line[0]: (line, sections[line[0]].rstrip("\n") + "\n")
        for line in lines
        if line[0] in sections and "\nClaim: " in sections[line[0]]
    }


def _section(row: Row, store: Store, finding: Finding, quick: bool) -> str:
    entries = store.entries.values()
    dates = sorted({entry["date"] for entry in entries})
    sources = Counter(entry["source"] for entry in entries)
    made_by = ", ".join(f"{source} ({n:,})" for source, n in sorted(sources.items()))
    when = dates[0] if len(dates) == 1 else f"{dates[0]} to {dates[-1]}"
    planned = len(row.trials(quick))
    made = f"{len(entries)} of {planned} trials" if len(entries) < planned else "all trials"
    lines = [
        f"## {row.name}: {row.title}",
        "",
        f"Claim: {row.claim}. {finding.failures:,} of {finding.trials:,} {row.unit} failed, a "
        f"share of at most {finding.at_most:.2%}.",
        "",
        f"Seeds: {row.seeds(quick)}. Made: {made}, {when}, source {made_by}. Command: "
        f"`python benchmarks/robustness.py{' --quick' if quick else ''} --rows {row.name}`.",
        "",
    ]
    if finding.table:
        lines += [finding.table, ""]
    broken = errors({key: entry["result"] for key, entry in store.entries.items()})
    if broken:
        lines += ["Trials that ended in an exception:", ""]
        lines += [f"- `{key}`: {text}" for key, text in broken.items()] + [""]
    return "\n".join([*lines, f"Not covered: {row.not_covered}", ""])


def _left(table: str) -> str:
    lines = table.split("\n")
    lines[1] = "|---|---|---:|---:|---:|"
    return "\n".join(lines)
