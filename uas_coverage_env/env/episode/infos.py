"""What is told about a UAS beside its observation and reward: what is made most often of all."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.episode.memory import ENERGY, FIRST_TERM, Learners, Scratch
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.rewards import REWARD_TERMS
from uas_coverage_env.world import ABSENT


class Infos:
    """The infos of `CoverageParallelEnv`.

    Args:
        settings: How it is flown.
        learners: The arrays of the mission.
        scratch: Likewise.
    """

    def __init__(self, settings: MissionSettings, learners: Learners, scratch: Scratch) -> None:
        self._term_names = settings.term_names
        self._usual = self._term_names == REWARD_TERMS
        self._kind = settings.kind
        self._masks = settings.chooses and not settings.mask_in_observation
        self._filters = settings.safety_filter
        self._flat = settings.flat_infos
        self._tells_more = self._masks or self._filters or self._flat
        self._learners = learners
        self._scratch = scratch

    def of(self, i: int, row: Sequence[int], amounts: Sequence[float]) -> dict[str, Any]:
        """The info of a UAS.

        Args:
            i: Its index.
            row: Its row of the report, the columns of `memory`.
            amounts: Its row of the amounts, likewise.
        """
        contact, contact_with, limits, status, filtered, returning, covered = row
        if self._usual:
            # written out: in half the time of `dict(zip(...))`, and this is a tenth of a step
            (
                energy_Wh, _,
                coverage, team_coverage, energy, violation, home, stranded, filter_, time,
            ) = amounts  # fmt: skip
            named = {
                "coverage": coverage,
                "team_coverage": team_coverage,
                "energy": energy,
                "violation": violation,
                "home": home,
                "stranded": stranded,
                "filter": filter_,
                "time": time,
            }
        else:
            energy_Wh = amounts[ENERGY]
            named = dict(zip(self._term_names, amounts[FIRST_TERM:], strict=True))
        info: dict[str, Any] = {
            "status": status,
            "contact": contact,
            "contact_with": contact_with,
            "limits_exceeded": limits,
            "returning": returning > 0,
            "covered": covered,
            "energy_Wh": energy_Wh,
            "reward_terms": named,
        }
        if not self._tells_more:
            return info
        if self._masks:
            info["action_mask"] = self.action_mask(i)
        if self._filters:
            info["filter"] = {
                "changed": filtered > 0,
                "asked": _described(self._scratch.commands[i]),
                "applied": _described(self._scratch.outcome[i]["applied_command"]),
            }
        return flat(info) if self._flat else info

    def action_mask(self, i: int) -> NDArray[np.int8]:
        """(choices,) 1 where a choice of UAS i exists now."""
        return self._kind.masks(self._learners.candidates[i]).astype(np.int8)


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


def absent(info: Mapping[str, Any]) -> dict[str, Any]:
    """An info of the same kinds and shapes, of a UAS that the mission does not have."""
    return {**_zero(info), "status": ABSENT, "contact_with": -1}


def _zero(info: Mapping[str, Any]) -> dict[str, Any]:
    return {
        name: _zero(value)
        if isinstance(value, Mapping)
        else np.zeros_like(value)
        if isinstance(value, np.ndarray)
        else type(value)()
        for name, value in info.items()
    }
