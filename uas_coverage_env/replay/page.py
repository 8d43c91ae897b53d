"""The replay page: viewer, style and flights in one file that loads nothing from anywhere."""

import base64
import hashlib
import html
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from uas_coverage_env.draw.colours import page_style
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.replay.flight_data import flight_data

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<noscript>This page draws the flight with JavaScript, which is switched off here.</noscript>
<script type="application/json" id="flights"{live}>{data}</script>
<script>{script}</script>
</body>
</html>
"""


def write_replay(
    flights: Sequence[Flight], path: Path, *, sources: Sequence[str] | None = None
) -> Path:
    """Write `replay_page` to a file, which is replaced where it exists.

    Raises:
        InputError: A flight holds a value that is not finite, or the file cannot be written.
    """
    return write_page(replay_page(flights, sources=sources), path)


def write_page(page: str, path: Path) -> Path:
    """Write a page to a file, which is replaced where it exists.

    Raises:
        InputError: The file cannot be written.
    """
    try:
        # a name may hold what is no character (a lone surrogate): it is shown as such
        write_atomically(path, page.encode("utf-8", errors="xmlcharrefreplace"))
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    return path


def replay_page(
    flights: Sequence[Flight], *, sources: Sequence[str] | None = None, live: str | None = None
) -> str:
    """One flight, or two side by side, as a page that opens from disk.

    The page may run its own script and style, known by their hashes, and nothing else: what a
    scenario is called, or a planner, is data and stays data.

    Args:
        flights: One or two flights.
        sources: What mistakes call each flight; by default its planner.
        live: Where the page asks its server for the rest of a flight that is still flown.

    Raises:
        ValueError: No flight, or more than two.
        InputError: A flight holds a value that is not finite.
    """
    if not 1 <= len(flights) <= 2:
        raise ValueError(f"{len(flights)} flights were given; a page shows one or two")
    names = sources or [flight.planner for flight in flights]
    data = [flight_data(flight, name) for flight, name in zip(flights, names, strict=True)]
    return page_of(data, live=live)


def page_of(data: Sequence[Mapping[str, Any]], *, live: str | None = None) -> str:
    """`replay_page` of what `flight_data` says of each flight."""
    script, style = _part("viewer.js"), page_style() + _part("viewer.css")
    title = " and ".join(f"{flight['scene']['name']}, {flight['planner']}" for flight in data)
    return _PAGE.format(
        policy=html.escape(_policy(script, style, live is not None)),
        live="" if live is None else f' data-live="{html.escape(live)}"',
        title=html.escape(title),
        style=style,
        data=_embedded(data),
        script=script,
    )


def _policy(script: str, style: str, live: bool) -> str:
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src '{_hash(script)}'",
            f"style-src '{_hash(style)}'",
            "base-uri 'none'",
            "form-action 'none'",
            *(["connect-src 'self'"] if live else []),
        ]
    )


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _embedded(data: Any) -> str:
    """JSON in which no tag can begin: `<` appears only as its escape."""
    text = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _part(name: str) -> str:
    return files("uas_coverage_env.replay").joinpath(name).read_text(encoding="utf-8")
