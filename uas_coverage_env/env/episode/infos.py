"""What is told about a UAS beside its observation and reward: what is made most often of all."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.episode.memory import Learners, Scratch
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.report import FILTERED, FIRST_TERM, InfoField


class Infos:
    """The infos of `CoverageParallelEnv`.

    Args:
        settings: How it is flown.
        learners: The arrays of the mission.
        scratch: Likewise.

    Attributes:
        of: `of(i, row, amounts)`, the info of UAS i: made of its row of the report and its row of
            the amounts, the columns of `env.report`.
    """

    def __init__(self, settings: MissionSettings, learners: Learners, scratch: Scratch) -> None:
        self._kind = settings.kind
        self._masks = settings.chooses and not settings.mask_in_observation
        self._filters = settings.safety_filter
        self._flat = settings.flat_infos
        self._learners = learners
        self._scratch = scratch
        self._told = _written_out(settings.version.infos, settings.term_names)
        more = self._masks or self._filters or self._flat
        self.of = self._with_more if more else self._told

    def _with_more(self, i: int, row: Sequence[int], amounts: Sequence[float]) -> dict[str, Any]:
        info = self._told(i, row, amounts)
        if self._masks:
            info["action_mask"] = self.action_mask(i)
        if self._filters:
            info["filter"] = {
                "changed": row[FILTERED] > 0,
                "asked": _described(self._scratch.commands[i]),
                "applied": _described(self._scratch.outcome[i]["applied_command"]),
            }
        return flat(info) if self._flat else info

    def action_mask(self, i: int) -> NDArray[np.int8]:
        """(choices,) 1 where a choice of UAS i exists now."""
        return self._kind.masks(self._learners.candidates[i]).astype(np.int8)


@cache
def _written_out(
    fields: tuple[InfoField, ...], terms: tuple[str, ...]
) -> Callable[[int, Sequence[int], Sequence[float]], dict[str, Any]]:
    """A function that makes an info from the rows of a UAS.

    Its source is written out, a dictionary literal: a third of the time of `dict(zip(...))`, and
    infos are a tenth of a step.
    """
    told = []
    for field in fields:
        value = f"{'amounts' if field.of_amounts else 'row'}[{field.column}]"
        told.append(f"{field.name!r}: {value}{' > 0' if field.flag else ''}")
    paid = (f"{name!r}: amounts[{k}]" for k, name in enumerate(terms, FIRST_TERM))
    told.append(f"'reward_terms': {{{', '.join(paid)}}}")
    # names as Python quotes them, columns as numbers: there is nothing else in it
    made: Callable[..., dict[str, Any]] = eval(f"lambda i, row, amounts: {{{', '.join(told)}}}")
    return made


def _described(command: np.void) -> dict[str, Any]:
    return {"kind": int(command["kind"]), "values": command["values"].copy()}


def flat(infos: Mapping[str, Any], parent: str = "") -> dict[str, Any]:
    """Infos without sub-dictionaries: `reward_terms_home` for `["reward_terms"]["home"]`."""
    told: dict[str, Any] = {}
    for name, value in infos.items():
        if isinstance(value, Mapping):
            told |= flat(value, f"{parent}{name}_")
        else:
            told[parent + name] = value
    return told


def absent(info: Mapping[str, Any], fields: Sequence[InfoField]) -> dict[str, Any]:
    """An info of the same kinds and shapes, of a UAS that the mission does not have."""
    return {**_zero(info), **{field.name: field.absent for field in fields if field.absent}}


def _zero(info: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _zero(value)
        if isinstance(value, Mapping)
        else np.zeros_like(value)
        if isinstance(value, np.ndarray)
        else type(value)()
        for name, value in info.items()
    }
