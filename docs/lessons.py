"""The lessons as pages with what they print and draw, for readers who do not run them.

    python docs/lessons.py            run all notebooks (minutes) and write `docs/lessons/`
    python docs/lessons.py 1 3        only those
    python docs/lessons.py --check    name the pages whose code or words are not those of their
                                      notebook any more, without running it; 1 where there are any

Needs the extra `test` (or `notebooks` and nbclient).
"""

import base64
import io
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import nbformat
import numpy as np
from nbclient import NotebookClient
from PIL import Image

DOCS = Path(__file__).resolve().parent
PAGES = DOCS / "lessons"
PICTURES = DOCS / "pictures" / "lessons"
NOTEBOOKS = sorted((DOCS.parent / "notebooks").glob("*.ipynb"))

_COLOURS = 128
_SECONDS_FOR_A_CELL = 3600


def source_of(cell: Any) -> str:
    """A cell as the page shows it."""
    if cell.cell_type == "code":
        code = re.sub(r"^%.*\n", "", cell.source, flags=re.MULTILINE).strip()
        return f"```python\n{code}\n```"
    text = re.sub(r"\]\((\d\w+)\.ipynb\)", r"](\1.md)", cell.source)
    text = text.replace("](../docs/", "](../")
    return re.sub(r"\]\(\.\./(agents|baselines|benchmarks)/", r"](../../\1/", text)


def stale() -> list[Path]:
    """Pages that do not hold every cell of their notebook, in its order."""
    return [page_of(path) for path in NOTEBOOKS if not _holds_all_cells(path)]


def page_of(notebook: Path) -> Path:
    """Where the page of a notebook lies."""
    return PAGES / f"{notebook.stem}.md"


def _holds_all_cells(notebook: Path) -> bool:
    page = page_of(notebook)
    rest = page.read_text(encoding="utf-8") if page.exists() else ""
    for cell in _read(notebook).cells:
        _, found, rest = rest.partition(source_of(cell))
        if not found:
            return False
    return True


def _read(notebook: Path) -> Any:
    return nbformat.read(notebook, as_version=4)


def write(notebook: Path) -> None:
    """Run a notebook, and write its page and pictures."""
    cells = _read(notebook)
    with tempfile.TemporaryDirectory() as folder:
        resources = {"metadata": {"path": folder}}
        NotebookClient(
            cells,
            timeout=_SECONDS_FOR_A_CELL,
            resources=resources,
            coalesce_streams=True,  # else what a cell prints is cut wherever a buffer was flushed
        ).execute()
    for old in PICTURES.glob(f"{notebook.stem}-*.png"):
        old.unlink()
    link = f"[notebook](../../notebooks/{notebook.name})"
    first = source_of(cells.cells[0])
    parts = [first, f"*This is the {link} as it ran: `python docs/lessons.py`.*"]
    n_pictures = 0
    for cell in cells.cells[1:]:
        parts.append(source_of(cell))
        for output in cell.get("outputs", ()):
            if output.get("name") == "stderr":  # that kernels are compiled, on this machine
                continue
            if "image/png" in output.get("data", {}):
                n_pictures += 1
                name = f"{notebook.stem}-{n_pictures}.png"
                _save(base64.b64decode(output.data["image/png"]), PICTURES / name)
                parts.append(f"![What the cell above draws](../pictures/lessons/{name})")
                continue
            text = output.get("text") or output.get("data", {}).get("text/plain", "")
            if text and not text.startswith("<"):  # else an object that only a notebook shows
                parts.append(f"```text\n{text.rstrip()}\n```")
    PAGES.mkdir(exist_ok=True)
    page_of(notebook).write_text("\n\n".join(parts) + "\n", encoding="utf-8", newline="\n")


def _save(png: bytes, path: Path) -> None:
    """A picture of its most frequent colours: a fraction of the size, without a visible difference.

    Those of Pillow's own palettes are means, so that areas change and thin lines take the colours
    of others.
    """
    path.parent.mkdir(exist_ok=True)
    picture = Image.open(io.BytesIO(png)).convert("RGB")
    colours, counts = np.unique(np.asarray(picture).reshape(-1, 3), axis=0, return_counts=True)
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours[np.argsort(-counts)[:_COLOURS]].ravel().tolist())
    few = picture.quantize(palette=palette, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def main(*arguments: str) -> int:
    """Write or check; the exit code."""
    if arguments == ("--check",):
        found = stale()
        sys.stdout.writelines(f"{page.relative_to(DOCS.parent)}\n" for page in found)
        return 1 if found else 0
    chosen = [path for path in NOTEBOOKS if not arguments or path.name[0] in arguments]
    if len(chosen) < len(arguments):
        sys.stderr.write("usage: python docs/lessons.py [--check | NUMBER ...]\n")
        return 2
    for notebook in chosen:
        write(notebook)
        sys.stdout.write(f"{page_of(notebook).relative_to(DOCS.parent)}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
