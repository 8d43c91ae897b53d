"""Which of several logs is of which UAS of a plan."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.operations.logs.read_log import read_log


def read_fleet_logs(
    logs: Sequence[str], names: Sequence[str], batteries: Mapping[str, int]
) -> dict[str, Logged]:
    """The logs by the UAS that they are of.

    Args:
        logs: [UAS=]FILE[:SYSTEM] each; a file without a UAS is named like it, or says which it is.
        names: Of the UAS.
        batteries: UAS -> number of its battery monitor, from 1 on; otherwise the first.

    Raises:
        InputError: A log cannot be read, is of no UAS of these, or of one that has one already.
    """
    found: dict[str, Logged] = {}
    for text in logs:
        given, equals, rest = text.partition("=")
        told = given if equals and given in names else ""
        path, system = _path_and_system(rest if told else text)
        meant = told or _named_like(path, names)
        for logged in _of_system(path, read_log(path, batteries.get(meant)), system):
            name = told or logged.uas or meant
            if name not in names:
                what = f"is of {name[:40]!r}" if name else "does not say of which UAS it is"
                raise InputError(
                    f"{path}: {what}; give UAS={path.name}, where the plan has {', '.join(names)}"
                )
            if name in found:
                raise InputError(f"{path}: is a second log of {name}; give one")
            found[name] = logged
    return found


def _path_and_system(text: str) -> tuple[Path, int | None]:
    """A file, and which vehicle of it: the number behind a colon, unless a file is called so."""
    before, colon, number = text.rpartition(":")
    if colon and number.isascii() and number.isdecimal() and not Path(text).exists():
        return Path(before), int(number)
    return Path(text), None


def _of_system(path: Path, logs: list[Logged], system: int | None) -> list[Logged]:
    """The log of a vehicle, all of a table; of several vehicles of a link one is to be chosen."""
    systems = [logged.system for logged in logs if logged.system is not None]
    listed = ", ".join(map(str, systems))
    if system is None:
        if len(systems) > 1:
            raise InputError(
                f"{path}: holds several vehicles (systems {listed}); choose one for each UAS, as "
                f"in UAS={path.name}:{systems[0]}"
            )
        return logs
    if system not in systems:
        raise InputError(f"{path}: has no vehicle of system {system}; it has {listed or 'none'}")
    return [logged for logged in logs if logged.system == system]


def _named_like(path: Path, names: Sequence[str]) -> str:
    """The UAS whose name a file has, or begins with."""
    if len(names) == 1:
        return names[0]
    like = [
        name
        for name in names
        if path.stem == name or path.stem.startswith((f"{name}.", f"{name}_", f"{name}-"))
    ]
    return max(like, key=len, default="")
