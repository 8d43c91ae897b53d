"""Scored missions on disk: a line of JSON each, added when it was flown; a kill loses none."""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.tasks.levels import LEVELS
from uas_coverage_env.tasks.scoring import MissionScore

FILE = "scores.jsonl"

_HEAD = ("level", "planner", "scenario_sha256")


class ScoreStore:
    """The missions of a folder.

    Args:
        folder: Made where there is none.

    Raises:
        InputError: The folder cannot be made, or a line of its file is none of ours; names it.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            text = self.path.read_text("utf-8") if self.path.exists() else ""
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self.path}: cannot be used ({error})") from error
        whole, newline, rest = text.rpartition("\n")
        self._missions: dict[tuple[str, str], list[MissionScore]] = {}
        # of a line that a kill has cut short
        self._torn_at = len((whole + newline).encode()) if rest else None
        for number, line in enumerate(whole.split("\n") if whole else (), start=1):
            level, planner, mission = _read(line, f"{self.path}, line {number}")
            self._missions.setdefault((level, planner), []).append(mission)

    def missions(self, level: str, planner: str) -> tuple[MissionScore, ...]:
        """What was flown of a planner on a level."""
        return tuple(self._missions.get((level, planner), ()))

    def planners(self, level: str) -> tuple[str, ...]:
        """Names of the planners that have flown on a level."""
        return tuple(planner for name, planner in self._missions if name == level)

    def add(self, level: str, planner: str, mission: MissionScore) -> None:
        """Keep a mission."""
        self._missions.setdefault((level, planner), []).append(mission)
        sha256 = _sha256(level, mission.seed)
        row = {**dict(zip(_HEAD, (level, planner, sha256), strict=True)), **asdict(mission)}
        if self._torn_at is not None:
            os.truncate(self.path, self._torn_at)
            self._torn_at = None
        with self.path.open("ab") as file:
            file.write(json.dumps(row, allow_nan=False).encode() + b"\n")


def _sha256(level: str, seed: int) -> str:
    return scenario_hash(LEVELS[level].scenario(seed))


def _read(line: str, place: str) -> tuple[str, str, MissionScore]:
    wanted: Mapping[str, Any] = {
        **dict.fromkeys(_HEAD, str),
        **{field.name: field.type for field in fields(MissionScore)},
    }
    try:
        row = json.loads(line)
    except ValueError:
        row = None
    if isinstance(row, dict) and "player" in row:  # as versions before wrote it
        row = {"planner": row.pop("player"), **row}
    if not isinstance(row, dict) or set(row) != set(wanted):
        raise InputError(f"{place}: is no scored mission; give another --out")
    for name, kind in wanted.items():
        if type(row[name]) is not kind or (kind is float and not math.isfinite(row[name])):
            raise InputError(f"{place}: {name} is {row[name]!r}; give another --out")
    level, planner, sha256 = (row.pop(name) for name in _HEAD)
    if level not in LEVELS:
        raise InputError(f"{place}: level is {level[:40]!r}; there are {', '.join(LEVELS)}")
    if row["seed"] < 0 or _sha256(level, row["seed"]) != sha256:
        raise InputError(
            f"{place}: mission {row['seed']} of {level} is another one now; give another --out"
        )
    return level, planner, MissionScore(**row)
