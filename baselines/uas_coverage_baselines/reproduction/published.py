"""What a paper prints, as data: its settings, figures and events, and how far off we may be."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Strict

from uas_coverage_env.files.strict_toml import InputError, StrictModel, read_toml

PAPERS = ("gasche2025",)
"""The papers that can be reproduced: names of the TOML files of this package."""

Share = Annotated[float, Field(ge=0.0, le=10.0)]


class PublishedPlanner(StrictModel):
    """The paper's settings as a planner's name and options."""

    name: str
    options: dict[str, Any]


class Setting(StrictModel):
    """A parameter of the paper's table.

    Attributes:
        symbol: As the paper writes it.
        value: One number, or the three of a position.
        tolerance: By how much ours may differ.
        reason: Why it may.
    """

    symbol: str
    value: Annotated[tuple[float, ...], Strict(False)]
    tolerance: Share = 0.0
    reason: str = ""


class PublishedFigure(StrictModel):
    """A figure that follows from the paper's curves, one for each UAS.

    Attributes:
        name: A field of `UasFigures`.
        title: For people.
        unit: For people; empty where it is a number alone.
        digits: After the point, in tables.
        tolerance: Largest difference as a share of the paper's figure.
        reason: Why there is a difference at all.
    """

    name: str
    title: str
    unit: str
    digits: int
    tolerance: Share
    reason: str


class ToldEvent(StrictModel):
    """Something that the paper's text says of its flight.

    Attributes:
        name: A key of `EVENTS`.
        says: In the words of the text, nearly.
        place: Where it stands.
    """

    name: str
    says: str
    place: str


class Paper(StrictModel):
    """Everything that is compared.

    Attributes:
        title: Of the paper.
        authors: Of the paper.
        scenario: The shipped map that stands for the paper's.
        planner: Its settings.
        snapshots: Figure -> the sample that it shows.
        settings: Its table of parameters.
        figures: What follows from its curves.
        events: What its text tells.
    """

    title: str
    authors: str
    scenario: str
    planner: PublishedPlanner
    snapshots: dict[str, int]
    settings: Annotated[tuple[Setting, ...], Strict(False)]
    figures: Annotated[tuple[PublishedFigure, ...], Strict(False)]
    events: Annotated[tuple[ToldEvent, ...], Strict(False)]


def paper_named(name: str) -> Paper:
    """What a paper prints.

    Raises:
        InputError: No such paper.
    """
    if name not in PAPERS:
        raise InputError(f"unknown paper {name[:80]!r}; take {', '.join(PAPERS)}")
    with resources.as_file(
        resources.files("uas_coverage_baselines.reproduction") / f"{name}.toml"
    ) as path:
        return read_toml(path, Paper)


@dataclass(frozen=True)
class Curves:
    """The battery of one UAS over its flight, a sample per second, the landed ones left out.

    Attributes:
        soc: (T,) state of charge.
        voltage_V: (T,) under the current.
        current_A: (T,) of the step that begins.
    """

    soc: NDArray[np.float64]
    voltage_V: NDArray[np.float64]
    current_A: NDArray[np.float64]


def published_curves() -> tuple[Curves, ...]:
    """Those of Fig. 3, one of each UAS; without current a UAS has landed."""
    from uas_coverage_env.replay.figures import published_battery  # draws, needs matplotlib

    table: Mapping[str, NDArray[np.float64]] = published_battery()
    curves = []
    for uas in ("uas1", "uas2"):
        airborne = np.flatnonzero(table[f"current_{uas}_A"])[-1] + 1
        columns = {"soc": "", "voltage": "_V", "current": "_A"}
        soc, voltage_V, current_A = (
            table[f"{quantity}_{uas}{unit}"] for quantity, unit in columns.items()
        )
        curves.append(
            Curves(
                soc=soc[: airborne + 1],
                voltage_V=voltage_V[:airborne],
                current_A=current_A[:airborne],
            )
        )
    return tuple(curves)
