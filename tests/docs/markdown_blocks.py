"""The code blocks and command lines of Markdown pages."""

import re
import shlex
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = sorted(
    [
        *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
        *(ROOT / room / "README.md" for room in ("agents", "baselines", "benchmarks")),
        *(ROOT / "docs").glob("*.md"),
    ]
)
LONG = "<!-- long -->"

_FENCE = re.compile(r"^( *)(`{3,})(.*)$")


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        line: Number of its first line in the page.
        language: What stands behind the fence.
        text: Its content.
        long: Whether it is marked as too long to be run by a test.
    """

    line: int
    language: str
    text: str
    long: bool


def blocks(page: Path) -> Iterator[Block]:
    """The fenced blocks of a page, in their order."""
    lines = page.read_text(encoding="utf-8").splitlines()
    start = None
    for number, line in enumerate(lines):
        match = _FENCE.match(line)
        if match is None:
            continue
        if start is None:
            start, language = number, match[3].strip()
            above = [text.strip() for text in lines[:number] if text.strip()]
            long = bool(above) and above[-1] == LONG
        elif not match[3].strip():
            text = textwrap.dedent("\n".join(lines[start + 1 : number])) + "\n"
            yield Block(start + 2, language, text, long)
            start = None
    assert start is None, f"{page.name}: the block of line {start} has no end"


def save_files(page: Path, folder: Path) -> None:
    """Write the files that a page says to save: Python and TOML that begin with `# NAME`."""
    for block in blocks(page):
        named = re.match(r"# (\w+\.(?:py|toml))\n", block.text)
        if block.language in ("python", "toml") and named:
            (folder / named[1]).write_text(block.text, encoding="utf-8")


def command_lines(page: Path, *, inline: bool = True) -> Iterator[list[str]]:
    """Every command of ours in the blocks, and the inline code, of a page, as its words."""
    shells = [b.text for b in blocks(page) if b.language in ("bash", "console", "", "sh")]
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(encoding="utf-8"), flags=re.S | re.M)
    prose = prose if inline else ""
    commands = re.findall(r"`((?:uas-coverage|python) [^`\[\]|…]*)`", prose)
    for text in [*shells, *commands]:
        for line in text.replace("\\\n", " ").splitlines():
            words = shlex.split(line.removeprefix("$ "), comments=True)
            while words:
                end = words.index("&&") if "&&" in words else len(words)
                if words[:end]:
                    yield words[:end]
                words = words[end + 1 :]
