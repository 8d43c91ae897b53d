"""Arrays of many missions that are replaced one by one, as kernels read them from a pool."""

from typing import Any, Generic, TypeVar

import numpy as np

from uas_coverage_env.compiled.memory import Memory, Pool

T = TypeVar("T", bound=tuple)


class Slots(Generic[T]):
    """A `Pool` of n missions, empty at first, each in a slot of its own.

    Every array has room for the largest mission so far; where a larger one comes, it is made anew.

    Args:
        memory: The declaration.
        n: Number of slots.

    Attributes:
        pool: For kernels; to be taken anew after `put`.
    """

    def __init__(self, memory: Memory[T], n: int) -> None:
        self._memory = memory
        self._n = n
        self._room = [0] * len(memory.fields)
        empty = {field.name: np.zeros(0, dtype=field.dtype) for field in memory.fields}
        self.pool = Pool(
            memory.made_of(empty),
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
        for f, array in enumerate(mission):
            if array.size > self._room[f]:
                self._make_room(f, array.size)
            first = slot * self._room[f]
            self.pool.arrays[f][first : first + array.size] = array.reshape(-1)
        self.pool.sizes[slot] = [sizes[name] for name in self._memory.names]

    def _make_room(self, f: int, size: int) -> None:
        before, room = self._room[f], size + size // 4
        field = self._memory.fields[f]
        array: np.ndarray[Any, Any] = np.zeros(self._n * room, dtype=field.dtype)
        array.reshape(self._n, room)[:, :before] = self.pool.arrays[f].reshape(self._n, before)
        self._room[f] = room
        self.pool.first[:, f] = np.arange(self._n) * room
        self.pool = self.pool._replace(arrays=self.pool.arrays._replace(**{field.name: array}))
