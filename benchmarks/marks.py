"""What is filled in on a page: between `<!-- NAME -->` and `<!-- end of NAME -->`.

Tables that follow from the code have marks of their own (`generated: NAME`, `docs/tables.py`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
_END = re.compile(r"^<!-- end of (.+) -->$", re.MULTILINE)


def pages(root: Path = ROOT) -> list[Path]:
    """The pages on which figures are published."""
    readmes = [root / "README.md", root / "RELIABILITY.md"]
    readmes += [root / part / "README.md" for part in ("baselines", "agents")]
    return [page for page in (*readmes, *sorted((root / "docs").glob("*.md"))) if page.exists()]


_ROW = re.compile(r"\s*[│┃](.*)[│┃]\s*")
_RULE = re.compile(r"\s*[┏┡├└][┳┓╇┩┼┤┴┘━─]*\s*")
_NUMBER = re.compile(r"[-+≤<>]?\s*\d")


def markdown(printed: str) -> str:
    """What a command has printed, with Markdown in place of the tables that Rich drew.

    Their titles stay above them as lines of their own.
    """
    lines: list[str] = []
    rows: list[list[str]] = []
    for line in printed.splitlines():
        if row := _ROW.fullmatch(line):
            rows.append([cell.strip() for cell in re.split("[│┃]", row[1])])
        elif not _RULE.fullmatch(line):
            lines.append(line.strip())
        elif line.lstrip().startswith("└"):
            lines += ["", *_table(rows), ""]
            rows = []
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip()


def _table(rows: list[list[str]]) -> list[str]:
    head, *rest = rows
    numbers = [
        all(_NUMBER.match(cell) for cell in column if cell) for column in zip(*rest, strict=True)
    ]
    rule = "|".join(" ---: " if number else " --- " for number in numbers)
    return [f"| {' | '.join(head)} |", f"|{rule}|", *(f"| {' | '.join(row)} |" for row in rest)]


def marks_of(mark: str) -> tuple[str, str]:
    """The lines before and after what is filled in."""
    return f"<!-- {mark} -->\n", f"<!-- end of {mark} -->"


def marks_on(text: str) -> list[str]:
    """The marks between which something measured stands."""
    return [mark for mark in _END.findall(text) if marks_of(mark)[0] in text]


def parts(text: str, mark: str) -> tuple[str, str, str]:
    """What stands before, between and after a mark.

    Raises:
        ValueError: There is no such mark.
    """
    first, last = marks_of(mark)
    before, begin, rest = text.partition(first)
    between, end, after = rest.partition(last)
    if not begin or not end:
        raise ValueError(f"has no {first.strip()} ... {last}")
    return before, between.strip(), after


def filled(text: str, content: str, mark: str) -> str:
    """The text with something new between its marks.

    Raises:
        ValueError: It has no marks.
    """
    first, last = marks_of(mark)
    before, _, after = parts(text, mark)
    return f"{before}{first}\n{content.strip()}\n\n{last}{after}"


def places(root: Path = ROOT) -> Iterator[tuple[Path, str, str]]:
    """Each page, mark and what stands there."""
    for page in pages(root):
        text = page.read_text(encoding="utf-8")
        for mark in marks_on(text):
            yield page, mark, parts(text, mark)[1]
