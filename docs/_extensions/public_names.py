"""The API reference: what a module makes public, described by its docstrings.

A page names a module, and the names of it that it describes; without names it describes all of the
module's `__all__` that no package above it exports under a shorter path:

    ```{public} uas_coverage_env.flight
    ```
"""

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from numba.core.dispatcher import Dispatcher
from pydantic import BaseModel
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.ext.autodoc.mock import mock
from sphinx.pycode import ModuleAnalyzer
from sphinx.util.docutils import SphinxDirective


def described(module_name: str, names: list[str]) -> list[str]:
    """The names that the directive describes, in the order of `__all__`, values after the rest."""
    module = importlib.import_module(module_name)
    if names:
        return names
    parents = [importlib.import_module(parent) for parent in _parents(module_name)]
    shorter = {
        id(getattr(parent, name)) for parent in parents for name in getattr(parent, "__all__", ())
    }
    found = [name for name in module.__all__ if id(getattr(module, name)) not in shorter]
    return sorted(found, key=lambda name: _kind(getattr(module, name)) == "data")


def _parents(module_name: str) -> Iterator[str]:
    while "." in module_name:
        module_name = module_name.rpartition(".")[0]
        yield module_name


def _kind(thing: Any) -> str:
    if inspect.isclass(thing):
        return "class"
    function = inspect.isroutine(thing) or isinstance(thing, Dispatcher)
    return "function" if function or hasattr(thing, "__wrapped__") else "data"


class Public(SphinxDirective):
    """Describes public names of a module."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        """What stands in the page for the directive."""
        module_name = self.arguments[0]
        with mock(self.config.autodoc_mock_imports):
            names = described(module_name, " ".join(self.content).split())
            module = importlib.import_module(module_name)
            parts = [_entry(module_name, name, getattr(module, name)) for name in names]
        text = "\n".join(["```{eval-rst}", *parts, "```"])
        return self.parse_text_to_nodes(text)


def _entry(module_name: str, name: str, thing: Any) -> str:
    kind = _kind(thing)
    if kind == "data":
        value = repr(thing)
        lines = [f".. py:data:: {module_name}.{name}"]
        if len(value) < 60 and "0x" not in value:
            lines += [f"   :value: {value}"]
        text = "\n".join(_comment(module_name, name))
        return "\n".join([*lines, "", *(f"   {line}" for line in _restructured(text)), ""])
    lines = [f".. auto{kind}:: {module_name}.{name}"]
    if kind == "class":
        lines += ["   :members:"]
    return "\n".join([*lines, ""])


def _comment(module_name: str, name: str) -> list[str]:
    """The text below a value in the file that defines it, wherever it is imported from."""
    for defining in _imported_from(module_name, name):
        comments = ModuleAnalyzer.for_module(defining).find_attr_docs()
        if text := comments.get(("", name)):
            return text
    return []


def _imported_from(module_name: str, name: str) -> Iterator[str]:
    yield module_name
    for statement in ast.walk(ast.parse(ModuleAnalyzer.for_module(module_name).code)):
        if not isinstance(statement, ast.ImportFrom) or statement.module is None:
            continue
        if name in [alias.asname or alias.name for alias in statement.names]:
            yield from _imported_from(statement.module, name)


def _restructured(text: str) -> list[str]:
    """A docstring of ours as reStructuredText: code in backticks, bars and stars as they are."""
    lines = []
    header = True
    for line in text.splitlines():
        start, content = line[: len(line) - len(line.lstrip())], line.strip()
        if content.startswith("|--"):
            continue
        if content.startswith("| "):  # a table, as Markdown has it
            if header:
                lines += ["", f"{start}.. list-table::", f"{start}   :header-rows: 1", ""]
            cells = [_escaped(cell.strip()) for cell in content.strip("|").split(" | ")]
            marks = ["* -", *["  -"] * (len(cells) - 1)]
            lines += [f"{start}   {mark} {cell}" for mark, cell in zip(marks, cells, strict=True)]
        else:
            lines += ([] if header else [""]) + [start + _escaped(content)]
        header = not content.startswith("| ")
    return lines


def _escaped(text: str) -> str:
    pieces = re.split(r"(``?[^`]+``?)", text)
    for k, piece in enumerate(pieces):
        if k % 2:
            pieces[k] = f"``{piece.strip('`')}``"
        else:
            piece = re.sub(r"([|\\]|(?<!^)(?<!^\*)\*|(?<=\w)_(?!\w))", r"\\\1", piece)
            pieces[k] = re.sub(r"(^|: )(\w)\.", r"\1\2\\.", piece)  # no item of a list
    return "".join(pieces)


def _on_docstring(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]
) -> None:
    lines[:] = _restructured("\n".join(lines))


def _on_signature(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, signature: str | None, returns: Any
) -> tuple[str, str] | None:
    if signature is None:
        return None
    if inspect.isclass(thing) and issubclass(thing, BaseModel):
        return "(**fields)", ""  # its attributes say which
    return _ARRAY.sub(r"NDArray[\1]", signature), _ARRAY.sub(r"NDArray[\1]", returns or "")


_ARRAY = re.compile(r"~?numpy\.ndarray\[tuple\[[^\[\]]*\], ~?numpy\.dtype\[([^\[\]]*)\]\]")


def _on_missing_reference(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, shown: nodes.TextElement
) -> nodes.Node | None:
    """Leads a type, named by the file that defines it, to where it is described."""
    if node.get("refdomain") != "py":
        return None
    name = node["reftarget"].rpartition(".")[2]
    domain = env.domains.python_domain
    found = [full for full in domain.objects if full.rpartition(".")[2] == name]
    if len(found) != 1 or not node["reftarget"].startswith("uas_coverage"):
        return None
    return domain.resolve_xref(
        env, node["refdoc"], app.builder, node["reftype"], found[0], node, shown
    )


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.setup_extension("sphinx.ext.napoleon")
    app.add_directive("public", Public)
    app.connect("autodoc-process-docstring", _on_docstring, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", _on_signature)
    app.connect("missing-reference", _on_missing_reference)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
