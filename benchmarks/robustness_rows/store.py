"""Results of trials, kept line by line: what is in the folder is not tried again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from robustness_rows.row import Result
from uas_coverage_env.files.strict_toml import InputError


class Store:
    """The results of one row, in a file of JSON lines.

    A line that a kill cut off is dropped, and its trial made again.

    Args:
        folder: Made where there is none.
        row: Name of the row.

    Raises:
        InputError: The folder cannot be made or the file not read.
    """

    def __init__(self, folder: Path, row: str) -> None:
        self._path = folder / f"{row}.jsonl"
        self.entries: dict[str, dict[str, Any]] = {}
        try:
            folder.mkdir(parents=True, exist_ok=True)
            lines = self._path.read_text("utf-8").split("\n") if self._path.exists() else [""]
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self._path}: cannot be used: {error}; give another --out") from None
        for number, line in enumerate(lines[:-1], start=1):
            try:
                entry = json.loads(line)
                self.entries[entry["key"]] = {
                    name: entry[name] for name in ("result", "source", "date")
                }
            except (ValueError, KeyError, TypeError):
                raise InputError(
                    f"{self._path}:{number}: is no result; remove the line, or give another --out"
                ) from None
        if lines[-1]:
            self._path.write_text("".join(f"{line}\n" for line in lines[:-1]), "utf-8")

    def add(self, key: str, result: Result, source: str, date: str) -> None:
        """Keep a result.

        Args:
            key: Of the trial.
            result: What came out.
            source: Hash of the source code that it came from.
            date: Of the day.
        """
        self.entries[key] = {"result": result, "source": source, "date": date}
        line = json.dumps({"key": key, **self.entries[key]}, allow_nan=False, ensure_ascii=False)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line + "\n")
