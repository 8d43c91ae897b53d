"""Round-robin replanning: the UAS that are planned for where the work does not suffice for all.

Many UAS share the work of one decision. A UAS that is not planned for goes on along its last
verified plan and its backup trajectory, around which the others plan; so a plan lasts several
decisions, and no UAS waits for ever.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence


class RoundRobin:
    """The order in which UAS are planned for, where the work does not suffice for all."""

    def __init__(self) -> None:
        self.work_of_one = 0.05  # what solving one program took in the last decision
        self._last: dict[str, int] = {}
        self._decision = 0

    def select(self, names: Sequence[str], urgent: Collection[int], most: int) -> list[int]:
        """Rows of those planned for now: the urgent ones, then those that have waited longest.

        Args:
            names: the active UAS.
            urgent: rows of those that have nothing safe to go on with.
            most: how many.
        """
        self._decision += 1
        waited = sorted(
            range(len(names)),
            key=lambda row: (row not in urgent, self._last.get(names[row], 0)),
        )
        taken = waited[:most]
        self._last.update((names[row], self._decision) for row in taken)
        return taken
