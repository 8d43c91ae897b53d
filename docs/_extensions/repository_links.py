"""Pages that read well on a code host as well as on the site: links out of docs/ are bent.

READMEs of other folders become pages of the site. A link to one of them leads to that page; a link
to a notebook downloads it, one to any other file of the repository becomes plain text. `index.md`
gets the pages that none of its tables of contents names, so that a new page needs no other edit.
"""

import os
import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
READMES = DOCS / "_generated" / "readmes"
PAGES = {
    ROOT / "README.md": DOCS / "index.md",
    **{
        ROOT / source: READMES / f"{name}.md"
        for source, name in {
            "baselines/README.md": "baselines",
            "agents/README.md": "agents",
            "benchmarks/README.md": "benchmarks",
            "CONTRIBUTING.md": "contributing",
            "CHANGELOG.md": "changelog",
        }.items()
    },
}
_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)#\s]+)(#[^)\s]*)?\)")


def site_text(text: str, source: Path, page: Path) -> str:
    """The text of a Markdown file with its links bent for the site.

    Args:
        text: What the file holds.
        source: Where links of the text start from.
        page: The page of the site that the text becomes.
    """

    def bent(match: re.Match[str]) -> str:
        picture, label, target, anchor = match.groups(default="")
        file = (source.parent / target).resolve()
        if "://" in target:
            return match[0]
        if picture and source.parent != DOCS and not file.exists():
            return label  # READMEs show pictures that a benchmark has yet to make
        file = PAGES.get(file, file)
        if file.exists() and not file.is_relative_to(DOCS) and file.suffix != ".ipynb":
            return label
        return f"{picture}[{label}]({os.path.relpath(file, page.parent)}{anchor})"

    return _LINK.sub(bent, text)


def _write_readmes(app: Sphinx) -> None:
    READMES.mkdir(parents=True, exist_ok=True)
    for source, page in PAGES.items():
        if page.parent == READMES:
            page.write_text(
                site_text(source.read_text(encoding="utf-8"), source, page), encoding="utf-8"
            )


def _on_read(app: Sphinx, docname: str, source: list[str]) -> None:
    path = app.srcdir / f"{docname}.md"
    if READMES not in path.parents:
        source[0] = site_text(source[0], path, path)
    if docname == "index":
        source[0] += _rest(app.env, source[0])


def _rest(env: BuildEnvironment, index: str) -> str:
    named = {line.strip() for line in index.splitlines()}
    rest = sorted(name for name in env.found_docs if name != "index" and name not in named)
    if not rest:
        return ""
    return "\n".join(["", "```{toctree}", ":hidden:", ":caption: More", "", *rest, "```", ""])


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("builder-inited", _write_readmes)
    app.connect("source-read", _on_read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
