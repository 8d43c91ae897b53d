"""Arrays that are declared once: what follows from a declaration, in Python and in a kernel."""

from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import pytest
from numpy.typing import NDArray
from typing_extensions import TypeAliasType

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.memory import Memory, Values, as_bytes
from uas_coverage_env.compiled.views import (
    Layout,
    copy_arrays,
    lane_view,
    pool_view,
    record_view,
    rows_view,
)
from uas_coverage_env.env.batch.slots import Slots

S = TypeVar("S", bound=np.generic)
NESTED = np.ndarray[tuple[Any, ...], np.dtype[S]]
NAMED = TypeAliasType("NAMED", NESTED[S], type_params=(S,))
ALIASES = {
    "before numpy 2.5": lambda scalar: NESTED[scalar],
    "since numpy 2.5": lambda scalar: NAMED[scalar],
    "of this numpy": lambda scalar: NDArray[scalar],
    "a name for one": lambda scalar: TypeAliasType("Rows", NAMED[scalar]),
}
"""How `NDArray[scalar]` may be nested."""

BOX_DTYPE = np.dtype((np.record, np.dtype([("side_m", "f8"), ("n", "i8")], align=True)))


class Depot(NamedTuple):
    boxes: Annotated[NDArray[np.void], BOX_DTYPE, "B"]
    height_m: Annotated[NDArray[np.float64], "B", 2]
    owner: Annotated[NDArray[np.int64], "B", Values(-1, "P")]
    people: Annotated[NDArray[np.float32], "P"]


class Visit(NamedTuple):
    seen: Annotated[NDArray[np.bool_], "B"]
    place: Annotated[NDArray[np.int64], 1, Values(0, 2)]


DEPOT, VISIT = Memory(Depot), Memory(Visit)
BOTH = Layout(DEPOT, VISIT)
views = BOTH.views
depot_at = pool_view(DEPOT)
visit_of = lane_view(VISIT, sized_by=DEPOT)
boxes_at = record_view(BOX_DTYPE)


def depot(n_boxes: int, n_people: int, seed: int = 0) -> Depot:
    rng = np.random.default_rng(seed)
    made = DEPOT.zeros({"B": n_boxes, "P": n_people})
    made.boxes["side_m"] = rng.random(n_boxes)
    made.boxes["n"] = rng.integers(9, size=n_boxes)
    made.height_m[:] = rng.random((n_boxes, 2))
    made.people[:] = rng.random(n_people)
    return made


@kernel
def add_all(arrays, visit):
    total = 0.0
    for b in range(arrays.boxes.shape[0]):
        total += arrays.boxes[b].side_m * arrays.boxes[b].n + 7.0 * arrays.height_m[b, 1]
        visit.seen[b] = True
    for p in range(arrays.people.shape[0]):
        total += 100.0 * arrays.people[p]
    visit.place[0] += 1
    return total


@kernel
def add_at(at):
    arrays, visit = views(at)
    return add_all(arrays, visit)


@kernel
def add_lane(pool, visits, lane, s):
    return add_all(depot_at(pool, s), visit_of(visits, lane, pool, s))


@kernel
def copy_in_kernel(source, target):
    copy_arrays(source, target)


@kernel
def fill_boxes(words, first, n):
    boxes = boxes_at(words, first, n)
    for b in range(boxes.shape[0]):
        boxes[b].side_m = 0.5 * b
        boxes[b].n += 10 + b
    return boxes[n - 1].n


@kernel
def double_rows(array, row, n):
    rows = rows_view(array, row, (n, 4))
    for k in range(n):
        rows[k, 3] *= 2.0


def test_bytes_copied_from_one_mission_make_another_the_same():
    given, written = depot(3, 0, seed=1), depot(3, 0, seed=2)
    for source, target in zip(as_bytes(given), as_bytes(written), strict=True):
        target[:] = source
    for ours, expected in zip(written, depot(3, 0, seed=1), strict=True):
        np.testing.assert_array_equal(ours, expected)


def test_new_arrays_have_the_declared_types_and_shapes():
    arrays = DEPOT.zeros({"B": 3, "P": 5})
    assert [array.shape for array in arrays] == [(3,), (3, 2), (3,), (5,)]
    assert [array.dtype for array in arrays] == [BOX_DTYPE, float, np.int64, np.float32]
    assert DEPOT.zeros({"B": 3, "P": 5}, lanes=4).height_m.shape == (4, 3, 2)


@pytest.mark.parametrize("scalar", [np.float64, np.float32, np.int64, np.bool_, np.uint64])
@pytest.mark.parametrize("form", ALIASES)
def test_an_array_has_the_declared_type_however_its_alias_is_nested(form, scalar):
    class Shed(NamedTuple):
        height_m: Annotated[ALIASES[form](scalar), "B", 2]  # pyrefly: ignore[invalid-annotation]

    (field,) = Memory(Shed).fields
    assert (field.dtype, field.axes) == (np.dtype(scalar), ("B", 2))


@pytest.mark.parametrize("array", [np.ndarray, NDArray[Any], NDArray[np.int64] | NDArray[np.int8]])
def test_a_declaration_that_does_not_say_one_type_of_elements_is_refused(array):
    class Shed(NamedTuple):
        height_m: Annotated[array, "B"]

    with pytest.raises(TypeError, match=r"height_m: .* does not say one type of elements"):
        Memory(Shed)


def test_a_kernel_finds_at_their_addresses_the_arrays_themselves():
    arrays, visit = depot(3, 5), VISIT.zeros({"B": 3})
    expected = add_all(arrays, VISIT.zeros({"B": 3}))
    assert add_at(BOTH.addresses_of(arrays, visit)) == expected
    assert visit.seen.all()
    assert visit.place[0] == 1


def test_two_arrays_that_are_exchanged_are_noticed():
    arrays = depot(3, 3)
    wrong = arrays._replace(people=arrays.owner, owner=arrays.people)
    with pytest.raises(ValueError, match=r"Depot\.owner has dtype float32"):
        BOTH.addresses_of(wrong, VISIT.zeros({"B": 3}))


def test_arrays_whose_sizes_do_not_agree_are_refused():
    with pytest.raises(ValueError, match=r"Visit\.seen has shape \(4,\); axis B is 3"):
        BOTH.addresses_of(depot(3, 5), VISIT.zeros({"B": 4}))


def test_arrays_that_are_not_contiguous_are_refused():
    arrays = depot(6, 2)
    with pytest.raises(ValueError, match=r"Depot\.owner is not contiguous"):
        DEPOT.sizes_of(arrays._replace(owner=np.arange(12)[::2]))


def test_every_mission_of_a_pool_is_what_was_put_there():
    missions = [depot(3, 5), depot(1, 2, seed=1), depot(4, 0, seed=2)]
    pool = DEPOT.pool(missions)
    for s, mission in enumerate(missions):
        for mine, its in zip(DEPOT.mission(pool, s), mission, strict=True):
            np.testing.assert_array_equal(mine, its)
    assert DEPOT.largest(pool) == {"B": 4, "P": 5}
    assert DEPOT.size(pool, "P").tolist() == [5, 2, 0]


def test_equal_arrays_of_a_pool_are_stored_once():
    pool = DEPOT.pool([depot(3, 5), depot(3, 5), depot(2, 5)])
    assert len(pool.arrays.boxes) == 5
    assert pool.first[:, 0].tolist() == [0, 0, 3]


def test_a_lane_has_the_size_of_the_mission_that_it_flies():
    missions = [depot(3, 5), depot(1, 2, seed=1)]
    pool = DEPOT.pool(missions)
    visits = VISIT.zeros({"B": 3}, lanes=3)
    expected = add_all(missions[1], VISIT.zeros({"B": 1}))
    assert add_lane(pool, visits, 2, 1) == expected
    assert visits.seen.tolist() == [[False] * 3, [False] * 3, [True, False, False]]
    assert visits.place.ravel().tolist() == [0, 0, 1]


def test_a_kernel_copies_all_arrays_and_nothing_else():
    source, target, other = depot(3, 5), depot(3, 5, seed=1), depot(3, 5, seed=1)
    copy_in_kernel(source, target)
    for mine, its, before in zip(target, source, other, strict=True):
        np.testing.assert_array_equal(mine, its)
        assert not np.shares_memory(mine, before)


def test_records_lie_in_the_words_that_begin_at_an_index():
    words = np.zeros(12, np.uint64)
    words[6] = 5
    assert fill_boxes(words, 5, 3) == 12
    boxes = words[5:11].view(BOX_DTYPE)
    assert boxes["n"].tolist() == [15, 11, 12]
    assert boxes["side_m"].tolist() == [0.0, 0.5, 1.0]
    assert not words[:5].any()
    assert not words[11:].any()


def test_rows_are_seen_in_another_shape_and_written_through():
    array = np.arange(24.0).reshape(4, 3, 2)
    double_rows(array, 1, 3)
    expected = np.arange(24.0)
    expected[[9, 13, 17]] *= 2.0
    assert array.ravel().tolist() == expected.tolist()


def test_indices_are_limited_by_the_size_that_they_are_declared_with():
    limits = DEPOT.limits({"P": np.array([4, 2])}, lanes=True)
    low, high = limits["owner"]
    assert low == -1
    assert high.tolist() == [[3], [1]]
    assert set(limits) == {"owner"}


def test_a_field_without_axes_is_refused_where_it_is_declared():
    class Wrong(NamedTuple):
        x: NDArray[np.float64]

    with pytest.raises(TypeError, match="x: declare it as Annotated"):
        Memory(Wrong)


def test_only_the_first_axis_of_a_lane_may_vary_with_the_mission():
    class Wrong(NamedTuple):
        x: Annotated[NDArray[np.float64], 2, "B"]

    with pytest.raises(TypeError, match="x: only its first axis"):
        lane_view(Memory(Wrong), sized_by=DEPOT)


def test_slots_hold_what_was_put_last_and_equal_arrays_once():
    slots = Slots(DEPOT, 5)
    rng = np.random.default_rng(0)
    held: dict[int, Depot] = {}
    for _ in range(200):
        slot, seed = int(rng.integers(5)), int(rng.integers(4))
        held[slot] = depot(1 + seed * 2, seed, seed)
        slots.put(slot, held[slot])
        for other, expected in held.items():
            for array, own in zip(DEPOT.mission(slots.pool, other), expected, strict=True):
                assert array.tobytes() == own.tobytes()
                assert array.shape == own.shape
        begins = {repr(d.height_m): slots.pool.first[s, 1] for s, d in held.items()}
        assert all(slots.pool.first[s, 1] == begins[repr(d.height_m)] for s, d in held.items())
    assert slots.pool.arrays.height_m.size == 5 * (14 + 14 // 4)
