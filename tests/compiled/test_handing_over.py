"""What kernels are handed in one array, and kernels that call others in turn."""

from typing import Annotated, NamedTuple

import numpy as np
import pytest

from uas_coverage_env.compiled.digest import digest_of
from uas_coverage_env.compiled.kernels import in_turn, kernel
from uas_coverage_env.compiled.memory import Memory, record_dtype
from uas_coverage_env.compiled.views import Handover
from uas_coverage_env.env.batch import kernel as batch_kernel
from uas_coverage_env.env.gpu import kernel as gpu_kernel

SHAPE = (3, 4)


class Part(NamedTuple):
    table: np.ndarray
    number: int


class Whole(NamedTuple):
    first: Part
    flags: np.ndarray
    records: np.ndarray


def whole(number=7):
    table = np.arange(12.0).reshape(SHAPE)
    records = np.zeros(2, [("x", "f8"), ("k", "i8")])
    return Whole(Part(table, number), np.array([False, True]), records.view(np.recarray)[:])


HANDOVER = Handover(whole)
take, take_first = HANDOVER.take, HANDOVER.take_first


@kernel
def write(numbers):
    (table, number), flags, _ = take(numbers)
    table[2, 3] = number + table.shape[0] * 100 + table.shape[1] * 1000
    flags[0] = True
    return number


@kernel
def read_first(numbers):
    table, number = take_first(numbers)
    return table[1, 2] + number


def test_what_is_handed_over_is_read_and_written_where_it_lies():
    given = whole(number=9)
    numbers = HANDOVER.numbers_of(given)
    assert write(numbers) == 9
    assert given.first.table[2, 3] == 9 + 300 + 4000
    assert given.flags.tolist() == [True, True]
    assert read_first(numbers) == 6.0 + 9


def test_two_that_are_handed_over_are_not_confused():
    one, two = whole(number=1), whole(number=2)
    numbers = [HANDOVER.numbers_of(each) for each in (one, two)]
    assert [write(each) for each in numbers] == [1, 2]
    assert one.first.table[2, 3] + 1 == two.first.table[2, 3]


def test_what_is_of_another_type_is_not_handed_over():
    given = whole()
    for wrong in (
        given._replace(flags=np.zeros(2)),
        given._replace(first=Part(np.zeros((3, 4))[:, ::2], 7)),
        given._replace(first=Part(np.zeros((3, 4)), True)),
    ):
        with pytest.raises(TypeError, match="is handed over, not"):
            HANDOVER.numbers_of(wrong)


@kernel
def double(values, by):
    values[0] = values[0] * 2 + by


@kernel
def add(values, by):
    values[0] += 10 * by


def test_kernels_are_called_in_turn_with_all_arguments():
    values = np.array([1.0])
    in_turn((double, add), "values, by")(values, 3.0)
    assert values[0] == 1 * 2 + 3 + 30
    in_turn((add, double), "values, by")(values, 1.0)
    assert values[0] == (35 + 10) * 2 + 1
    in_turn((), "values, by")(values, 1.0)
    assert values[0] == 91


def kernel_handed(dtype):
    """A kernel of numbers alone, and what it is kept on disk by."""

    class Records(NamedTuple):
        records: Annotated[np.ndarray, dtype, 2]

    taken = Handover(whole, Memory(Records)).take

    @kernel
    def read(numbers):
        return taken(numbers)[2][0].k

    return digest_of(read)


def test_a_kernel_is_another_one_where_records_that_it_is_handed_are_others():
    narrow = record_dtype([("x", "f8"), ("k", "i8")])
    wide = record_dtype([("x", "f8"), ("more", "f8"), ("k", "i8")])
    assert kernel_handed(narrow) == kernel_handed(narrow)
    assert kernel_handed(narrow) != kernel_handed(wide)


def records_in(given):
    """Types of the records in a tuple of arrays and tuples."""
    if isinstance(given, tuple):
        return set().union(*map(records_in, given))
    return {given.dtype} if isinstance(given, np.ndarray) and given.dtype.names else set()


@pytest.mark.parametrize("handover", [batch_kernel.GIVEN, gpu_kernel.GIVEN])
def test_all_records_that_steps_are_handed_are_declared(handover):
    declared = {field.dtype for memory in handover.memories for field in memory.fields}
    handed = records_in(handover._example())
    assert len(handed) > 10
    assert handed <= declared
