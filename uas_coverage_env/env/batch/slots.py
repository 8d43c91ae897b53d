"""Arrays of many missions that are replaced one by one, as kernels read them from a pool."""

import hashlib
from collections import Counter
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Field, Memory, Pool

T = TypeVar("T", bound=tuple)


class Slots(Generic[T]):
    """A `Pool` of n missions, empty at first, each in a slot of its own.

    Equal arrays are stored once, as in every pool: with one copy of a vehicle instead of hundreds a
    step takes two thirds of the time.

    Args:
        memory: The declaration.
        n: Number of slots.

    Attributes:
        pool: For kernels; to be taken anew after `put`.
    """

    def __init__(self, memory: Memory[T], n: int) -> None:
        self._memory = memory
        self._columns = [_Column(field, n) for field in memory.fields]
        self.pool = Pool(
            memory.made_of({column.field.name: column.array for column in self._columns}),
            np.zeros((n, len(memory.fields)), dtype=np.int64),
            np.zeros((n, len(memory.names)), dtype=np.int64),
        )

    def put(self, slot: int, mission: T) -> None:
        """Replace the mission of a slot.

        Args:
            slot: Which.
            mission: The declaration; its arrays are copied.

        Raises:
            ValueError: See `Memory.sizes_of`.
        """
        sizes = self._memory.sizes_of(mission)
        for f, (column, array) in enumerate(zip(self._columns, mission, strict=True)):
            if column.put(slot, array):
                self.pool.first[:, f] = column.place * column.room
            self.pool.first[slot, f] = column.place[slot] * column.room
        self.pool.sizes[slot] = [sizes[name] for name in self._memory.names]
        arrays = {column.field.name: column.array for column in self._columns}
        self.pool = self.pool._replace(arrays=self._memory.made_of(arrays))


class _Column:
    """One array of n missions, in up to n places as large as the largest of them so far.

    Attributes:
        array: All places, end to end.
        room: Length of a place.
        place: (n,) where the array of each slot lies.
    """

    def __init__(self, field: Field, n: int) -> None:
        self.field = field
        self.array: NDArray[Any] = np.zeros(0, dtype=field.dtype)
        self.room = 0
        self.place = np.zeros(n, dtype=np.int64)
        self._content = [b""] * n  # of each slot
        self._slots_with: Counter[bytes] = Counter()
        self._places: dict[bytes, int] = {}
        self._n_places = 0
        self._free: list[int] = []

    def put(self, slot: int, array: NDArray[Any]) -> bool:
        """Put the array of a slot into its place; says whether other places have moved."""
        before, content = self._content[slot], hashlib.blake2b(array.tobytes()).digest()
        self._content[slot] = content
        self._slots_with[content] += 1
        if before:
            self._slots_with[before] -= 1
            if not self._slots_with[before]:
                del self._slots_with[before]
                self._free.append(self._places.pop(before))
        if content in self._places:
            self.place[slot] = self._places[content]
            return False
        grows = array.size > self.room
        if grows or not self._free:
            self._make_room(array.size + array.size // 4 if grows else self.room)
        place = self.place[slot] = self._places[content] = self._free.pop()
        self.array[place * self.room :][: array.size] = array.reshape(-1)
        return grows

    def _make_room(self, room: int) -> None:
        """Make places this long, and more of them where none is free."""
        n, kept = self._n_places, self._n_places
        if not self._free:
            n = min(2 * n + 1, len(self.place))
            self._free = list(range(n - 1, kept - 1, -1))
        array = np.zeros(n * room, dtype=self.field.dtype)
        array.reshape(n, room)[:kept, : self.room] = self.array.reshape(kept, self.room)
        self.array, self.room, self._n_places = array, room, n
