"""What kernels are handed in one array, and kernels that call others in turn."""

from typing import NamedTuple

import numpy as np
import pytest

from uas_coverage_env.compiled.digest import digest_of
from uas_coverage_env.compiled.kernels import in_turn, kernel
from uas_coverage_env.compiled.memory import record_dtype
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


def digests_handed(dtype, order=(0, 1)):
    """What two kernels of numbers alone are kept on disk by: of all that is handed, of a part."""
    handover = Handover(lambda: Whole(Part(np.zeros(SHAPE), 7), *whole()[1:-1], np.zeros(2, dtype)))
    taken, taken_first = handover.take, handover.take_first

    @kernel
    def read(numbers):
        return taken(numbers)[0].table[0, 0]

    @kernel
    def read_first(numbers):
        return taken_first(numbers).table[0, 0]

    digests = {k: digest_of((read, read_first)[k]) for k in order}
    return digests[0], digests[1]


def test_kernels_are_others_where_what_they_are_handed_lies_elsewhere():
    narrow = record_dtype([("x", "f8"), ("k", "i8")])
    wide = record_dtype([("x", "f8"), ("more", "f8"), ("k", "i8")])
    assert digests_handed(narrow) == digests_handed(narrow, order=(1, 0))
    for one, other in zip(digests_handed(narrow), digests_handed(wide), strict=True):
        assert one != other


@pytest.mark.parametrize("handover", [batch_kernel.GIVEN, gpu_kernel.GIVEN])
def test_what_steps_are_handed_is_told_with_the_place_of_each_field(handover):
    assert "unit_m[type=float64;offset=" in handover.described()
