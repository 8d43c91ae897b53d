"""A flight that is shipped, with the data of its page: there before anything is compiled.

`python docs/recorded_flight.py` flies and records it anew.
"""

import json
from importlib.resources import files
from io import BytesIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from uas_coverage_env.flight import Flight
from uas_coverage_env.replay.flight_data import flight_data
from uas_coverage_env.replay.page import page_of, write_page

_ARCHIVE, _DATA = "recorded.zip", "page.json"


def write_recorded_page(path: Path) -> tuple[str, str]:
    """Write the page of the recorded flight.

    Args:
        path: Of the page; a file there is replaced.

    Returns:
        The planner that flew, and the scenario.

    Raises:
        InputError: The file cannot be written.
    """
    with _opened() as archive:
        data = json.loads(archive.read(_DATA))
    write_page(page_of([data | {"planner": f"{data['planner']} (recorded)"}]), path)
    return data["planner"], data["scene"]["name"]


def unpack_recorded(directory: Path) -> Path:
    """Write the directory of the recorded flight, to load it; returns it."""
    with _opened() as archive:
        archive.extractall(directory, [name for name in archive.namelist() if name != _DATA])
    return directory


def archive_of(directory: Path) -> bytes:
    """What is shipped of the flight in a directory, the same bytes for the same flight."""
    data = flight_data(Flight.load(directory), directory.name)
    contents = {path.name: path.read_bytes() for path in sorted(directory.iterdir())}
    contents[_DATA] = json.dumps(data, separators=(",", ":")).encode()
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED, compresslevel=9) as archive:
        for name, content in contents.items():
            archive.writestr(ZipInfo(name), content, ZIP_DEFLATED)
    return packed.getvalue()


def _opened() -> ZipFile:
    return ZipFile(BytesIO(files("uas_coverage_env.replay").joinpath(_ARCHIVE).read_bytes()))
