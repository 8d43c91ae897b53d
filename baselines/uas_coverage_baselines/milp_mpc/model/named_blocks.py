"""Blocks from outside the package: by the name of an entry point, or as MODULE:CLASS."""

from inspect import signature
from types import FunctionType
from typing import Any

from uas_coverage_baselines.milp_mpc.model.ocp import Block
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.named_objects import object_named
from uas_coverage_env.plugins.users_code import described, place_of_function

GROUP = "uas_coverage.blocks"
"""The entry-point group in which packages announce blocks by name."""


def block_names() -> tuple[str, ...]:
    """The names of the blocks that installed packages announce."""
    return tuple(sorted({entry.name for entry in entry_points(group=GROUP)}))


def block_named(name: str) -> Block:
    """Make a block.

    Args:
        name: of an entry point in `GROUP`, or MODULE:OBJECT with a module that is installed or
            lies in the current folder. The object is a block, or makes one without arguments.

    Raises:
        InputError: there is no such block; one line.
    """
    try:
        found = _loaded(name)
        block = found() if isinstance(found, type) or not hasattr(found, "add_to") else found
    except InputError:
        raise
    except Exception as error:  # whatever a foreign module raises is one line for its user
        raise InputError(f"block {name!r} cannot be made: {described(error)}") from error
    return checked(block, name)


def checked(block: Any, name: str = "") -> Block:
    """The block, if it is one.

    Raises:
        InputError: it is a class, or has no method `add_to` that takes what it is given.
    """
    if isinstance(block, type) or not callable(getattr(block, "add_to", None)):
        raise InputError(
            f"block {name or block!r} is no object with a method add_to(milp, variables, problem)"
        )
    try:
        signature(block.add_to).bind(None, None, None)
    except TypeError as error:
        function = getattr(block.add_to, "__func__", None)
        place = place_of_function(function) if isinstance(function, FunctionType) else ""
        raise InputError(
            f"block {name or block!r}: add_to is called with (milp, variables, problem): "
            f"{error}{place}"
        ) from error
    return block


def _loaded(name: str) -> Any:
    module_name, colon, attribute = name.partition(":")
    if not colon:
        for entry in entry_points(group=GROUP):
            if entry.name == name:
                return entry.load()
        known = ", ".join(block_names()) or "none is installed"
        raise InputError(f"unknown block {name!r}; give MODULE:CLASS or a name ({known})")
    if not module_name or not attribute:
        raise InputError(f"block {name!r}: should be MODULE:CLASS, as in my_module:Ceiling")
    return object_named("block", name)
