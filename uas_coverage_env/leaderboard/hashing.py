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
    for place in sorted(place for name in set(packages) for place in _places(name)):
        paths = [place] if place.is_file() else sorted(place.rglob("*"))
        for path in (path for path in paths if path.suffix in (".py", ".toml")):
            relative = path.relative_to(place.parent).as_posix()
            total.update(f"{relative}\0".encode())
            total.update(hashlib.sha256(path.read_bytes()).digest())
    return total.hexdigest()


def _places(package: str) -> list[Path]:
    """Where a package lies: its folders, or the file of a single module."""
    spec = find_spec(package)
    if spec is None:
        return []
    if spec.submodule_search_locations is None:
        return [Path(spec.origin)] if spec.has_location and spec.origin else []
    return [Path(place) for place in spec.submodule_search_locations]
