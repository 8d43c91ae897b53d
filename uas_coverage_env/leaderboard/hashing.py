"""Hashes of contents: what a flight is known by, and which source code flew it."""

import hashlib
import json
from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path
from typing import Any


def content_hash(data: Any) -> str:
    """SHA-256 of plain data; the order of keys does not matter.

    Args:
        data: What JSON can hold; finite numbers only.
    """
    text = json.dumps(
        data, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False
    )
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def source_hash(packages: Iterable[str]) -> str:
    """SHA-256 of all Python and TOML files of some packages, with their relative paths."""
    total = hashlib.sha256()
    for folder in sorted(folder for name in set(packages) for folder in _folders(name)):
        paths = sorted(path for path in folder.rglob("*") if path.suffix in (".py", ".toml"))
        for path in paths:
            total.update(f"{folder.name}/{path.relative_to(folder).as_posix()}\0".encode())
            total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def _folders(package: str) -> list[Path]:
    """Where a package lies; nowhere where it is a single module."""
    spec = find_spec(package)
    places = spec.submodule_search_locations if spec else None
    return [Path(place) for place in places or ()]
