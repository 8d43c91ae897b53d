"""The paper's figures, settings and events beside ours, and what leaves its tolerance."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from uas_coverage_baselines.reproduction.events import EVENTS, Event, Story
from uas_coverage_baselines.reproduction.figures import UasFigures, figures_of
from uas_coverage_baselines.reproduction.published import (
    Paper,
    PublishedFigure,
    Setting,
    ToldEvent,
    published_curves,
)
from uas_coverage_baselines.reproduction.settings import flown_setting
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.leaderboard.statistics import Estimate, estimate

_PAPER_DT_S = 1.0


@dataclass(frozen=True)
class FigureLine:
    """A figure of one UAS.

    Attributes:
        figure: Which.
        uas: Name of the UAS.
        paper: The paper's value.
        ours: Of the flight on the map that stands for the paper's.
        drawn: Of the flights on the drawn maps.
        mean: Interquartile mean over the drawn maps, with its 95 % interval.
    """

    figure: PublishedFigure
    uas: str
    paper: float
    ours: float
    drawn: tuple[float, ...]
    mean: Estimate

    @property
    def difference(self) -> float:
        """Ours less the paper's, as a share of the paper's."""
        return (self.ours - self.paper) / abs(self.paper)

    @property
    def within(self) -> bool:
        """Whether the difference keeps the stated tolerance."""
        return abs(self.difference) <= self.figure.tolerance


@dataclass(frozen=True)
class SettingLine:
    """A parameter of the paper's table, and what was flown."""

    setting: Setting
    flown: tuple[float, ...]

    @property
    def within(self) -> bool:
        """Whether it is the paper's, as far as the stated tolerance."""
        same_length = len(self.flown) == len(self.setting.value)
        return same_length and bool(
            np.allclose(self.flown, self.setting.value, rtol=0.0, atol=self.setting.tolerance)
        )


@dataclass(frozen=True)
class EventLine:
    """Something told, and whether it happened in each flight: name of the map -> event."""

    told: ToldEvent
    flights: Mapping[str, Event]


@dataclass(frozen=True)
class ReproducedPaper:
    """All that is compared.

    Attributes:
        paper: What it prints.
        flights: By the name of the map; the one that stands for the paper's first.
        figures: A line per figure and UAS.
        settings: A line per parameter.
        events: A line per event.
    """

    paper: Paper
    flights: Mapping[str, Flight]
    figures: Sequence[FigureLine]
    settings: Sequence[SettingLine]
    events: Sequence[EventLine]

    @classmethod
    def of(cls, paper: Paper, flights: Mapping[str, Flight]) -> "ReproducedPaper":
        """Compare flights, among which is one on the map that stands for the paper's."""
        main = flights[paper.scenario]
        drawn = [flight for name, flight in flights.items() if name != paper.scenario]
        stories = {name: Story(flight) for name, flight in flights.items()}
        return cls(
            paper,
            flights,
            tuple(_figure_lines(paper, main, drawn)),
            tuple(SettingLine(one, flown_setting(one.symbol, main)) for one in paper.settings),
            tuple(
                EventLine(told, {name: EVENTS[told.name](story) for name, story in stories.items()})
                for told in paper.events
            ),
        )

    def failures(self) -> list[str]:
        """What left its tolerance, a line each; empty where nothing did."""
        lines = [
            f"{line.figure.title} of {line.uas}: {line.ours:.{line.figure.digits}f} is "
            f"{line.difference:+.0%} of the paper's {line.paper:.{line.figure.digits}f}, "
            f"more than {line.figure.tolerance:.0%}"
            for line in self.figures
            if not line.within
        ]
        lines += [
            f"{line.setting.symbol}: flown with {_values(line.flown)}, "
            f"the paper has {_values(line.setting.value)}"
            for line in self.settings
            if not line.within
        ]
        lines += [
            f"did not happen on {self.paper.scenario}: {line.told.says} "
            f"({line.flights[self.paper.scenario].detail})"
            for line in self.events
            if not line.flights[self.paper.scenario].happened
        ]
        for name, flight in self.flights.items():
            if not accomplished(flight):
                lines.append(f"{name}: the mission was not accomplished")
            if flight.breaches:
                lines.append(f"{name}: {flight.breaches} breaches of safe distances")
        return lines


def _figure_lines(paper: Paper, main: Flight, drawn: Sequence[Flight]) -> Iterator[FigureLine]:
    theirs = [UasFigures.of(curves, _PAPER_DT_S) for curves in published_curves()]
    ours, others = figures_of(main), [figures_of(flight) for flight in drawn]
    for figure in paper.figures:
        for i, name in enumerate(main.names):
            values = tuple(flown[i].value(figure) for flown in others)
            yield FigureLine(
                figure,
                name,
                theirs[i].value(figure),
                ours[i].value(figure),
                values,
                # one flight per map: what would other maps change?
                estimate([np.array([value]) for value in values], "scenarios"),
            )


def _values(value: Sequence[float]) -> str:
    return ", ".join(f"{number:g}" for number in value)
