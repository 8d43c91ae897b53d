"""Arrays of many missions that are replaced one by one, as kernels read them from a pool."""

import hashlib
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
            column.put(slot, array)
            self.pool.first[:, f] = column.first
        self.pool.sizes[slot] = [sizes[name] for name in self._memory.names]
        arrays = {column.field.name: column.array for column in self._columns}
        self.pool = self.pool._replace(arrays=self._memory.made_of(arrays))


class _Column:
    """One array of n missions, in n places as large as the largest of them so far."""

    def __init__(self, field: Field, n: int) -> None:
        self.field = field
        self.array: NDArray[Any] = np.zeros(0, dtype=field.dtype)
        self._room = 0
        self._place = np.zeros(n, dtype=np.int64)
        self._content = [b""] * n  # of each slot
        self._places: dict[bytes, int] = {}
        self._free = list(range(n - 1, -1, -1))

    @property
    def first(self) -> NDArray[np.int64]:
        """(n,) where the array of a slot begins."""
        return self._place * self._room

    def put(self, slot: int, array: NDArray[Any]) -> None:
        before, content = self._content[slot], hashlib.blake2b(array.tobytes()).digest()
        self._content[slot] = content
        if before and before not in self._content:
            self._free.append(self._places.pop(before))
        if content not in self._places:
            if array.size > self._room:
                self._make_room(array.size + array.size // 4)
            place = self._places[content] = self._free.pop()
            first = place * self._room
            self.array[first : first + array.size] = array.reshape(-1)
        self._place[slot] = self._places[content]

    def _make_room(self, room: int) -> None:
        n, before = len(self._place), self._room
        array = np.zeros(n * room, dtype=self.field.dtype)
        array.reshape(n, room)[:, :before] = self.array.reshape(n, before)
        self.array, self._room = array, room
