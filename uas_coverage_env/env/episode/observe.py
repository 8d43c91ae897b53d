"""The observations of all UAS: the blocks of a version as one kernel, others at their address."""

from collections.abc import Sequence
from functools import cache
from typing import Any

from numba import types

from uas_coverage_env.compiled.calls import Signature
from uas_coverage_env.compiled.kernels import in_turn, inlined_kernel, kernel, rarely
from uas_coverage_env.compiled.views import slice_view
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.episode.memory import LEARNERS, TABLES, Observing
from uas_coverage_env.env.episode.parts import handed_over
from uas_coverage_env.env.observation import ObservationBlock
from uas_coverage_env.env.observation.nearest import nearest_waypoints
from uas_coverage_env.world.arena import ARENA

Blocks = tuple[ObservationBlock, ...]


@cache
def _types() -> tuple[types.Type, ...]:
    """Of the arguments of a block's kernel."""
    return (
        ARENA.numba_type(), STATE.numba_type(), TABLES.numba_type(), LEARNERS.numba_type(),
        types.int64, types.Array(types.float64, 1, "C"), types.Array(types.float32, 1, "C"),
    )  # fmt: skip


_SIGNATURE = Signature("arena state tables learners i parameters row", _types)
_write_block = _SIGNATURE.call


def observing_of(blocks: Sequence[ObservationBlock], own: Blocks) -> Observing:
    """Compile the blocks, or load them from the cache.

    Args:
        blocks: Of an observation.
        own: Of the version.

    Raises:
        ValueError: A block cannot be compiled.
    """
    return Observing(*handed_over(blocks, own, _address_of))


def _address_of(block: ObservationBlock) -> int:
    write = _with_notes(block.write, block.needs) if block.needs else block.write
    return _SIGNATURE.address_of(write)


@cache
def _with_notes(write: Any, needs: tuple[Any, ...]) -> Any:
    """The kernel of a block after those that it needs."""
    note = noted(needs)

    @kernel
    def write_with_notes(arena, state, tables, learners, i, parameters, row):
        note(arena, state, tables, learners, i)
        write(arena, state, tables, learners, i, parameters, row)

    return write_with_notes


def noted(needs: Sequence[Any]) -> Any:
    """One kernel that calls others in turn."""
    return in_turn(needs, "arena, state, tables, learners, i")


def _written(blocks: Blocks, column: int, first: int) -> Any:
    """One kernel that writes blocks in turn, from a column and a parameter on.

    Nested, one function a block: of all of them written out in one, which compiles a second
    faster, LLVM makes a batch's step that takes a tenth longer.
    """
    write, size, n = blocks[0].write, blocks[0].size, len(blocks[0].parameters)
    if len(blocks) == 1:

        @inlined_kernel
        def write_last(arena, state, tables, learners, parameters, i, row):
            write(
                arena, state, tables, learners, i,
                slice_view(parameters, first, n), slice_view(row, column, size),
            )  # fmt: skip

        return write_last
    rest = _written(blocks[1:], column + size, first + n)

    @inlined_kernel
    def write_both(arena, state, tables, learners, parameters, i, row):
        write(
            arena, state, tables, learners, i,
            slice_view(parameters, first, n), slice_view(row, column, size),
        )  # fmt: skip
        rest(arena, state, tables, learners, parameters, i, row)

    return write_both


LOOK = "arena, state, tables, learners, observing, observation, i"
"""The arguments of a look of a UAS."""

_NUMBERS_OF_A_LOOK = 48


def blocks_of_looks(own: Blocks) -> list[Blocks]:
    """Which blocks are written by each look after the first, see `looks_with`.

    As many as follow one another and have no more numbers than `_NUMBERS_OF_A_LOOK`; one at least.
    """
    groups: list[Blocks] = []
    for block in own:
        n = sum(each.size for each in groups[-1]) if groups else _NUMBERS_OF_A_LOOK
        if n + block.size > _NUMBERS_OF_A_LOOK:
            groups.append(())
        groups[-1] = (*groups[-1], block)
    return groups


@inlined_kernel
def _choose(arena, state, tables, learners, observing, observation, i):
    nearest_waypoints(arena, state, i, learners.candidates[i])


def _look_of(needs: Sequence[Any], write: Any, calls: bool) -> Any:
    """A look that writes blocks, after what has to be noted for them."""
    note, notes = noted(needs), bool(needs)

    @inlined_kernel
    def look(arena, state, tables, learners, observing, observation, i):
        if not calls or observing.begins_as_version[0]:
            if notes:
                note(arena, state, tables, learners, i)
            write(arena, state, tables, learners, observing.parameters, i, observation[i])

    return look


@inlined_kernel
def _call(arena, state, tables, learners, observing, observation, i):
    if rarely(observing.calls.shape[0] > 0):
        for b in range(observing.calls.shape[0]):
            call = observing.calls[b]
            _write_block(
                call.address, arena, state, tables, learners, i,
                slice_view(observing.parameters, call.first, call.parameters),
                slice_view(observation[i], call.column, call.width),
            )  # fmt: skip


@cache
def looks_with(own: Blocks, *, calls: bool = True) -> tuple[Any, ...]:
    """The kernels that observe, one after the other, of which some blocks are part.

    Several, as a batch lets many missions look before the next one begins: the machine code of all
    of them together fits into no cache.

    Args:
        own: These; each note that they need is taken once.
        calls: Whether others can be called at their address, which a GPU cannot.

    Returns:
        Kernels of the arguments `LOOK`, for UAS i, whatever the others do: each writes a part of
        its row of `observation` (U, V) float32; the first one writes the waypoints that it chooses
        among.
    """
    looks = [_choose]
    column = first = 0
    known: set[Any] = set()
    for blocks in blocks_of_looks(own):
        needs = dict.fromkeys(note for block in blocks for note in block.needs)
        new = [note for note in needs if note not in known]
        known |= needs.keys()
        looks.append(_look_of(new, _written(blocks, column, first), calls))
        column += sum(block.size for block in blocks)
        first += sum(len(block.parameters) for block in blocks)
    if calls:
        looks[-1] = in_turn((looks[-1], _call), LOOK)
    return tuple(looks)


LOOK_AROUND = "arena, state, tables, learners, observing, looks, observation"
"""The arguments of a look of all UAS for which `looks` (U,) is set."""


def look_around(look: Any) -> Any:
    """A kernel of the arguments `LOOK_AROUND`: one of `looks_with` for all UAS."""

    @inlined_kernel
    def look_of_all(arena, state, tables, learners, observing, looks, observation):
        for i in range(looks.shape[0]):
            if looks[i]:
                look(arena, state, tables, learners, observing, observation, i)

    return look_of_all


@cache
def observe_with(own: Blocks) -> Any:
    """A kernel that observes, of which some blocks are part.

    Returns:
        `observe(arena, state, tables, learners, observing, looks, observation)`: writes the rows of
        `observation` (U, V) of those UAS for which `looks` (U,) is set.
    """
    look = in_turn([look_around(each) for each in looks_with(own)], LOOK_AROUND)

    @kernel
    def observe(arena, state, tables, learners, observing, looks, observation):
        look(arena, state, tables, learners, observing, looks, observation)

    return observe
