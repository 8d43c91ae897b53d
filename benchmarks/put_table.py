"""Put the tables of a comparison where they are published.

    python benchmarks/put_table.py sweep

Fills what stands between the marks `<!-- leaderboard -->` of `baselines/README.md` (all of
`table.md`) and of `README.md` (a short table), and copies the picture to `docs/pictures`.
Exits 2 where a file or a mark is missing.
"""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
BEGIN, END = "<!-- leaderboard -->\n", "<!-- end of leaderboard -->\n"
PICTURE = ROOT / "docs" / "pictures" / "leaderboard.png"


def filled(text: str, content: str) -> str:
    """The text with something new between its marks.

    Raises:
        ValueError: It has no marks.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"has no {BEGIN.strip()} ... {END.strip()}")
    return f"{before}{begin}\n{content.strip()}\n\n{end}{after}"


def short_table(data: dict[str, Any]) -> str:
    """Who, how often it worked, what it took, against whom."""
    reference = data["reference"]
    headings = ["player", "accomplished", "violations", "decision p50, ms"]
    headings += [f"Δ energy to {reference}, %", "Δ steps, %"]
    lines = ["| " + " | ".join(headings) + " |", "|---|" + "---:|" * (len(headings) - 1)]
    for one in data["scores"]:
        is_reference = one["player"] == reference
        cells = [
            f"`{one['player']}`",
            f"{one['accomplished']}/{one['flights']}",
            str(one["violations"]),
            "–" if one["decision_p50_ms"] is None else f"{one['decision_p50_ms']:.3g}",
            *(
                "" if is_reference else _estimate(one[f"{name}_difference_percent"])
                for name in ("energy", "steps")
            ),
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([f"`{data['command']}`", "", *lines])


def _estimate(found: dict[str, float | None]) -> str:
    if found["value"] is None:
        return "–"
    if found["low"] is None:
        return f"{found['value']:+.1f}"
    return f"{found['value']:+.1f} [{found['low']:+.1f}, {found['high']:+.1f}]"


def main(folder: str) -> int:
    """Fill both files; the exit code."""
    sweep = Path(folder)
    try:
        contents = {
            ROOT / "baselines" / "README.md": (sweep / "table.md").read_text(encoding="utf-8"),
            ROOT / "README.md": short_table(
                json.loads((sweep / "table.json").read_text(encoding="utf-8"))
            ),
        }
        for path, content in contents.items():
            text = path.read_text(encoding="utf-8")
            try:
                path.write_text(filled(text, content), encoding="utf-8", newline="")
            except ValueError as error:
                raise OSError(f"{path} {error}") from error
        shutil.copyfile(sweep / "coverage-energy.png", PICTURE)
    except OSError as error:
        sys.stderr.write(f"error: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(f"usage: {sys.argv[0]} FOLDER_OF_A_COMPARISON")
    sys.exit(main(sys.argv[1]))
