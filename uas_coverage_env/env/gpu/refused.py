"""What does not run on a GPU: one table, of which its errors and its page in the docs are made."""

from collections.abc import Callable
from typing import Any, NamedTuple

from gymnasium.vector import AutoresetMode

from uas_coverage_env.env.episode.settings import MissionSettings

_OWN_MODE = (AutoresetMode.NEXT_STEP, AutoresetMode.NEXT_STEP.value)


class Asked(NamedTuple):
    """What missions on a GPU are asked for."""

    scenario: Any
    """A tuple of scenarios, or what draws them."""
    settings: MissionSettings
    flat_infos: bool | None
    autoreset_mode: str | AutoresetMode
    threads: int
    render_mode: str | None
    overhangs: bool = False
    """Whether guidance would have to find a way past overhangs."""


class Refusal(NamedTuple):
    """A thing that does not run there."""

    what: str
    instead: str
    is_asked_for: Callable[[Asked], bool]


REFUSED = (
    Refusal("`safety_filter`", "leave it out", lambda given: given.settings.safety_filter),
    Refusal(
        "missions that are drawn one by one: a family, a generator",
        "give a sequence of scenarios drawn beforehand, from which each mission is one",
        lambda given: not isinstance(given.scenario, tuple),
    ),
    Refusal(
        '`action="waypoint"`, `return_mode`, or an event that sends UAS home, where obstacles '
        "overhang",
        "leave these out, or take a scenario whose obstacles stand on the ground",
        lambda given: given.overhangs,
    ),
    Refusal(
        "`autoreset_mode` other than `NextStep`",
        "leave it out: a mission that has ended begins anew in the next step",
        lambda given: given.autoreset_mode not in _OWN_MODE,
    ),
    Refusal(
        "`mask_in_observation`",
        "leave it out: the mask of your kind of action takes `missions.learners.candidates`",
        lambda given: given.settings.mask_in_observation,
    ),
    Refusal(
        "`images_apart`",
        "leave it out: pictures are columns of the observation",
        lambda given: given.settings.images_apart,
    ),
    Refusal(
        "`flat_infos`",
        "leave it out: there are no infos, `report` has what they say",
        lambda given: given.flat_infos is not None,
    ),
    Refusal(
        "`render_mode`",
        "leave it out, and watch single missions of `parallel_env`",
        lambda given: given.render_mode is not None,
    ),
    Refusal(
        "`threads` other than 1",
        "leave it out: every UAS has a thread of the GPU",
        lambda given: given.threads != 1,
    ),
)
"""In the order in which they are looked for."""


def refuse(given: Asked) -> None:
    """Refuse what does not run on a GPU.

    Raises:
        ValueError: There is such a thing; says what, and what to do instead.
    """
    for refusal in REFUSED:
        if refusal.is_asked_for(given):
            raise ValueError(
                f'not on a GPU: {refusal.what}; {refusal.instead}, or take device="cpu"'.replace(
                    "`", ""
                )
            )
