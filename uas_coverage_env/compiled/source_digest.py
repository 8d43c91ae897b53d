"""What a module is made from: the contents of its file and of all that it imports.

Compiled code holds the code and the constants of other modules. Whether it is still true depends on
their sources, too. Imports are read from the text: what else a process has imported does not
matter.
"""

import hashlib
import os
import re
import sysconfig
from functools import cache
from typing import NamedTuple

_IMPORT = re.compile(
    r"(?:^|;)[ \t]*(?:"
    r"from[ \t]*(?P<level>\.*)[ \t]*(?P<module>[\w.]*)[ \t]+import[ \t]*"
    r"(?P<names>\([^)]*\)|[^(\n;]*)"
    r"|import[ \t]+(?P<modules>[^\n;]*))",
    re.MULTILINE,
)
_PACKAGE = os.path.dirname(os.path.dirname(os.path.realpath(__file__)))
_INSTALLED = {os.path.realpath(sysconfig.get_path(kind)) for kind in ("purelib", "platlib")}


class _Import(NamedTuple):
    module: str
    level: int
    name: str | None
    """What is taken out of the module; None where it is the module itself."""
    bound: str
    """What it is called from then on."""


class _Source(NamedTuple):
    digest: str
    imports: tuple[_Import, ...]


class _Home(NamedTuple):
    folder: str
    """From which a module is imported, by way of its packages."""
    top: str
    """Name of the outermost package, or of the module."""


def source_digest(path: str) -> str:
    """SHA-256 of a module's file and of the modules it imports, directly or not.

    Imports are followed within this package, within the package that the module belongs to and,
    where that is not an installed one, to what lies beside it. `from package import name` leads to
    the module that defines the name, not to all that the package imports.

    Args:
        path: A Python file.

    Raises:
        OSError: The file cannot be read.
    """
    file = _real(path)
    _forget_what_was_edited(file)
    return _digest(file)


@cache
def _real(path: str) -> str:
    return os.path.realpath(path)


@cache
def _digest(file: str) -> str:
    home = _home(file)
    reached, found = {file}, [file]
    lines: list[str] = []
    while found:
        targets, of_module = _lines(found.pop(), home)
        lines += of_module
        found += targets - reached
        reached |= targets
    return hashlib.sha256("\n".join(sorted(lines)).encode()).hexdigest()


@cache  # most modules are reached from many
def _lines(module: str, home: _Home) -> tuple[frozenset[str], tuple[str, ...]]:
    """The files that define what a module imports, and what the module adds to a digest."""
    label, source = _label(module, home), _source(module)
    imports = [(each.bound, _targets(module, each, home)) for each in source.imports]
    lines = [
        f"{label} {name} {_label(target, home)}" for name, targets in imports for target in targets
    ]
    reached = frozenset(target for _, targets in imports for target in targets)
    return reached, (f"{label} {source.digest}", *lines)


@cache
def _source(file: str) -> _Source:
    with open(file, "rb") as opened:
        content = opened.read()
    text = content.decode("utf-8", "replace")
    text = re.sub(r"#.*", "", text).replace("\\\n", " ")
    imports: list[_Import] = []
    for found in _IMPORT.finditer(text):
        if found["modules"] is not None:
            for module, bound in _names(found["modules"]):
                # `import a.b` binds a, through which all of it can be reached
                whole = [module] if bound != module else _with_parents(module)
                imports += (_Import(part, 0, None, bound) for part in whole)
        elif found["level"] or found["module"]:
            for name, bound in _names(found["names"].strip("()")):
                imports.append(_Import(found["module"], len(found["level"]), name, bound))
    return _Source(hashlib.sha256(content).hexdigest(), tuple(imports))


def _names(text: str) -> list[tuple[str, str]]:
    """What a list of names imports, and what each is bound to."""
    words = (part.split() for part in text.split(","))
    return [(part[0], part[-1]) for part in words if part]


def _with_parents(module: str) -> list[str]:
    parts = module.split(".")
    return [".".join(parts[:n]) for n in range(1, len(parts) + 1)]


def _targets(
    module: str, imported: _Import, home: _Home, through: tuple[str, ...] = ()
) -> list[str]:
    """The files that define what is imported; none where it is not ours."""
    place = _place(module, imported, home)
    if place is None:
        return []
    file = _file(place)
    if imported.name is None or (file is not None and not file.endswith("__init__.py")):
        return [file] if file else []
    submodule = _file(os.path.join(place, imported.name))
    targets = [submodule] if submodule else []
    if file is not None and file not in (module, *through):
        for inner in _source(file).imports:
            if inner.bound == imported.name:
                targets += _targets(file, inner, home, (module, *through))
        if not targets:
            targets.append(file)
    return targets


def _place(module: str, imported: _Import, home: _Home) -> str | None:
    """Where an imported module lies, without its suffix."""
    parts = imported.module.split(".") if imported.module else []
    if imported.level:
        folder = module
        for _ in range(imported.level):
            folder = os.path.dirname(folder)
        return os.path.join(folder, *parts)
    if parts[0] == os.path.basename(_PACKAGE):
        return os.path.join(os.path.dirname(_PACKAGE), *parts)
    if parts[0] == home.top or home.folder not in _INSTALLED:
        return os.path.join(home.folder, *parts)
    return None


@cache
def _file(place: str) -> str | None:
    for candidate in (f"{place}.py", os.path.join(place, "__init__.py")):
        if os.path.isfile(candidate):
            return candidate
    return None


def _home(file: str) -> _Home:
    folder, top = os.path.split(file)
    while os.path.isfile(os.path.join(folder, "__init__.py")):
        folder, top = os.path.split(folder)
    return _Home(folder, top.removesuffix(".py"))


def _label(file: str, home: _Home) -> str:
    """A name for a file that is the same in every copy of the sources."""
    for folder in (os.path.dirname(_PACKAGE), home.folder):
        if file.startswith(folder + os.sep):
            return file[len(folder) :]
    return file


_edited_ns: dict[str, int] = {}


def _forget_what_was_edited(file: str) -> None:
    """A module that is loaded again in the same process is made from what its file says now."""
    now_ns = os.stat(file).st_mtime_ns
    if _edited_ns.setdefault(file, now_ns) != now_ns:
        _edited_ns[file] = now_ns
        for remembered in (_digest, _lines, _source, _file):
            remembered.cache_clear()
