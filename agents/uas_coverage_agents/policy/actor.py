"""A network that acts for each UAS of a fleet: layers, and one scorer for all candidates."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, JsonValue, model_validator

from uas_coverage_agents.policy.tensors import Tensors, Width
from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.env.observation.scales import NEARBY_M
from uas_coverage_env.files.strict_toml import StrictModel

SHARPENED = ("energy_margin", "below")
"""Features of which small values matter: they are read a second time, times `GAIN`."""

OF_FLYING = ("clearance", "fence")
"""Likewise, where actions are velocities."""

NEARLY_ONE = ("rays",)
"""Then, features of which values near 1 matter: that from 1 is read, times `GAIN`."""

GAIN = 6.0
REACHES_M = (10.0, 60.0)
FAR_M = 200.0
"""Distances are read up to here [m]."""

NEARLY_STRAIGHT = 0.999
"""A slope of 1, with which numbers of an action are velocities themselves, is taken for this."""

OF_WAYPOINTS = ("waypoints", "ways")
"""Blocks of which each row is about a waypoint, in the same order."""

_Column = Annotated[int, Field(ge=0, le=100_000)]
_Columns = Annotated[tuple[_Column, ...], Field(max_length=10_000)]
_Vectors = Annotated[tuple[tuple[_Column, _Column, _Column], ...], Field(max_length=1000)]
_NEVER = -1e9
_EACH = "candidates."
_STANDARD = "offset", "scale"


def _at(columns: Any) -> NDArray[np.intp]:
    return np.array(columns, dtype=np.intp)


class Candidates(StrictModel):
    """What is read of each candidate, by columns of the observation; a row for each.

    Attributes:
        columns: Read as they are.
        sharp: Read times `GAIN`, within ±1.
        vectors: Direction (north, east) and closeness: read as distance, and as the share of its
            speed with which the UAS flies there.
        width: Of the scorer.
    """

    columns: Annotated[tuple[_Columns, ...], Field(min_length=1, max_length=1000)]
    sharp: Annotated[tuple[_Columns, ...], Field(max_length=1000)]
    vectors: _Vectors
    width: Width

    @model_validator(mode="after")
    def _one_shape(self) -> Self:
        rows = {len(self.columns), len(self.sharp), len(self.vectors)}
        if len(rows) > 1 or len({*map(len, self.columns)}) > 1 or len({*map(len, self.sharp)}) > 1:
            raise ValueError("candidates: give columns, sharp and vectors a row for each of them")
        return self

    @property
    def inputs(self) -> int:
        """Numbers that are read of each."""
        return len(self.columns[0]) + len(self.sharp[0]) + 2


class Pointing(StrictModel):
    """Actions that are velocities: towards a candidate, or home, or anywhere, by a mixture.

    For each of these there is a score, and a mean action: the way to it (its first leg past
    obstacles), shortened to each of `REACHES_M`, times a speed for each; a height, and one more
    within the first of the reaches. Added to all is the rest, which alone is anywhere.

    Attributes:
        home: Direction (north, east) of the first leg home.
        slope: Of the action at rest: a number s of it is s · (slope + (1 - slope) · s²) of the
            vehicle's limit. Speeds are such numbers, too, so that they are fine near rest.
    """

    home: tuple[_Column, _Column]
    slope: Annotated[float, Field(gt=0.0, le=NEARLY_STRAIGHT)]


class Actor(StrictModel):
    """Layers with tanh over features of the observation; then a score for each choice, or actions.

    Candidates are scored by one scorer, which sees one of them and the last layer (pointer
    network: Vinyals, Fortunato, Jaitly 2015); all other outputs are linear in the last layer and
    the features. Whatever it reads is standardised by what was seen at first in its training.

    Attributes:
        kind: "actor".
        inputs: Numbers of the observation of one UAS.
        columns: Of these, those that are read as they are.
        sharp: Those that are read times `GAIN`, within ±1, too.
        ones: Those of which the distance from 1 is read times `GAIN`, within ±1, too.
        vectors: Direction (north, east) and closeness, which are read as vectors, too: each
            shortened to `REACHES_M`, and in units of it.
        velocity: Where its velocity north and east is.
        hidden: Widths of the layers.
        candidates: What there is to choose from; None: actions are no choices.
        pointing: How candidates become velocities; None: they are choices.
        others: Outputs after the candidates.
        temperature: Choices are drawn with probabilities exp(score / this), as they were while it
            was learned; 0: the best one is taken. UAS that see the same and never draw collide.
        nearby_m: Closeness is 1/(1 + distance / nearby_m) [m].
        environment: Keyword arguments of the environments that it flies in.
    """

    kind: Literal["actor"] = "actor"
    inputs: Width
    columns: _Columns
    sharp: _Columns
    ones: _Columns = ()
    vectors: _Vectors
    velocity: tuple[_Column, _Column]
    hidden: Annotated[tuple[Width, ...], Field(min_length=1, max_length=8)]
    candidates: Candidates | None = None
    pointing: Pointing | None = None
    others: Width
    temperature: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    nearby_m: Annotated[float, Field(gt=0.0)]
    environment: dict[str, JsonValue]

    @model_validator(mode="after")
    def _reads_what_is_there(self) -> Self:
        each = self.candidates
        rows = [*self.vectors, self.columns, self.sharp, self.ones, self.velocity]
        rows += [*each.columns, *each.sharp, *each.vectors] if each else []
        rows += [self.pointing.home] if self.pointing else []
        last = max((column for row in rows for column in row), default=0)
        if last >= self.inputs:
            raise ValueError(f"column {last} is read, and there are {self.inputs}")
        return self

    @classmethod
    def of(
        cls,
        blocks: Sequence[Group],
        choices: int,
        outputs: int,
        *,
        hidden: tuple[int, ...],
        width: int,
        rows: int,
        temperature: float,
        environment: dict[str, Any],
        slope: float | None = None,
    ) -> "Actor":
        """The network for an observation.

        Args:
            blocks: What it is to read.
            choices: How many of the outputs are candidates, in the order of the waypoints in the
                observation; 0: none.
            outputs: How many there are.
            hidden: See `Actor`.
            width: Of the scorer.
            rows: How many waypoints the layers see.
            temperature: See `Actor`.
            environment: See `Actor`.
            slope: Of velocities that candidates become, see `Pointing`; None: they do not.
        """
        table = _columns_of(blocks)
        sharp = SHARPENED if slope is None else (*SHARPENED, *OF_FLYING)
        of_all, of_each = _Read(sharp), [_Read(sharp) for _ in range(choices)]
        for name, rows_of in table.items():
            for row in rows_of[:rows] if name in OF_WAYPOINTS else rows_of:
                of_all.add(row)
            if name in OF_WAYPOINTS and len(rows_of) >= choices:
                for read, row in zip(of_each, rows_of, strict=False):
                    read.add(row)
        rows_of_all = [row for rows_of in table.values() for row in rows_of]
        ones = [
            column
            for name in (NEARLY_ONE if slope is not None else ())
            for row in rows_of_all
            for column in row.get(name, ())
        ]
        north, east, *_ = table["own"][0]["velocity"]
        each = None
        if choices:
            each = Candidates(
                columns=tuple(tuple(one.columns) for one in of_each),
                sharp=tuple(tuple(one.sharp) for one in of_each),
                vectors=tuple(one.vectors[-1] for one in of_each),
                width=width,
            )
        pointing, others = None, outputs - choices
        if choices and slope is not None:
            home = table["home"][0]["direction"]
            pointing = Pointing(home=(home[0], home[1]), slope=min(slope, NEARLY_STRAIGHT))
            others = 3 * outputs
        return cls(
            inputs=sum(block.size for block in blocks),
            columns=tuple(of_all.columns),
            sharp=tuple(of_all.sharp),
            ones=tuple(ones),
            vectors=tuple(of_all.vectors),
            velocity=(north, east),
            hidden=hidden,
            candidates=each,
            pointing=pointing,
            others=others,
            temperature=temperature,
            nearby_m=NEARBY_M,
            environment=environment,
        )

    @property
    def outputs(self) -> int:
        """Choices that it scores, or numbers of an action."""
        if self.pointing:
            return self.others // 3
        return self.others + (len(self.candidates.columns) if self.candidates else 0)

    @property
    def per_candidate(self) -> int:
        """Numbers that the scorer gives: a score; with `pointing` speeds and heights, too."""
        return 2 * self.outputs - 1 if self.pointing else 1

    @property
    def heights_at(self) -> tuple[int, int]:
        """Where heights begin among these, after score and speeds, and those within 10 m."""
        first = 1 + len(REACHES_M)
        return first, first + (self.per_candidate - first) // 2

    @property
    def features(self) -> int:
        """Numbers that the layers read."""
        return self._plain + 2 * len(REACHES_M) * len(self.vectors)

    @property
    def _plain(self) -> int:
        """Those before the vectors."""
        return len(self.columns) + len(self.sharp) + len(self.ones)

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor."""
        last = self.hidden[-1]
        shapes: dict[str, tuple[int, ...]] = {name: (self.features,) for name in _STANDARD}
        for k, (below, above) in enumerate(pairwise((self.features, *self.hidden))):
            shapes[f"layers.{k}.weight"] = (above, below)
            shapes[f"layers.{k}.bias"] = (above,)
        shapes |= {"others.weight": (self.others, last + self.features)}
        shapes |= {"others.bias": (self.others,)}
        if each := self.candidates:
            parts = {
                **{name: (each.inputs,) for name in _STANDARD},
                "one.weight": (each.width, each.inputs), "one.bias": (each.width,),
                "all.weight": (each.width, last), "score.weight": (self.per_candidate, each.width),
            }  # fmt: skip
            if self.pointing:
                parts["score.bias"] = (self.per_candidate,)
            shapes |= {_EACH + name: shape for name, shape in parts.items()}
        return shapes

    def read(self, inputs: Any, maths: Any = np, at: Callable[[Any], Any] = _at) -> Any:
        """What the layers read, in NumPy or torch: (..., inputs) -> (..., features).

        Args:
            inputs: Of a UAS.
            maths: Either of them.
            at: Makes an index of columns.
        """
        parts = [
            inputs[..., at(self.columns)],
            maths.clip(GAIN * inputs[..., at(self.sharp)], -1.0, 1.0),
        ]
        if self.ones:
            parts.append(maths.clip(GAIN * (inputs[..., at(self.ones)] - 1.0), -1.0, 1.0))
        if self.vectors:
            north, east, closeness = map(at, zip(*self.vectors, strict=True))
            distance_m = self._distance(maths, inputs[..., closeness])
            for reach_m in REACHES_M:
                share = maths.clip(distance_m, None, reach_m) / reach_m
                parts += [share * inputs[..., north], share * inputs[..., east]]
        return maths.concatenate(parts, -1)

    def read_of_each(self, inputs: Any, maths: Any = np, at: Callable[[Any], Any] = _at) -> Any:
        """What the scorer reads: (..., inputs) -> (..., candidates, their inputs); see `read`."""
        each = self.candidates
        assert each is not None
        north, east, closeness = map(at, zip(*each.vectors, strict=True))
        north_speed, east_speed = (inputs[..., at((column,))] for column in self.velocity)
        there = inputs[..., north] * north_speed + inputs[..., east] * east_speed
        parts = [
            inputs[..., at(each.columns)],
            maths.clip(GAIN * inputs[..., at(each.sharp)], -1.0, 1.0),
            (self._distance(maths, inputs[..., closeness]) / FAR_M)[..., None],
            there[..., None],
        ]
        return maths.concatenate(parts, -1)

    def forward(self, tensors: Tensors, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run it.

        Args:
            tensors: Those of `shapes`.
            inputs: (..., inputs).

        Returns:
            (..., candidates + others); with `pointing` (..., components, 1 + numbers): the score
            of each, and its action.
        """
        inputs = np.asarray(inputs, dtype=np.float64)
        x = seen = (self.read(inputs) - tensors["offset"]) * tensors["scale"]
        for k in range(len(self.hidden)):
            x = np.tanh(x @ tensors[f"layers.{k}.weight"].T + tensors[f"layers.{k}.bias"])
        whole = np.concatenate([x, seen], axis=-1)
        others = whole @ tensors["others.weight"].T + tensors["others.bias"]
        if self.candidates is None:
            return others
        of = {name.removeprefix(_EACH): t for name, t in tensors.items() if name.startswith(_EACH)}
        one = (self.read_of_each(inputs) - of["offset"]) * of["scale"]
        both = one @ of["one.weight"].T + of["one.bias"] + (x @ of["all.weight"].T)[..., None, :]
        scored = np.tanh(both) @ of["score.weight"].T
        if self.pointing is None:
            return np.concatenate([scored[..., 0], others], axis=-1)
        scored = scored + of["score.bias"]
        return self.pointed(np, scored, others, self.read(inputs), self.read_of_each(inputs))

    def pointed(self, maths: Any, scored: Any, others: Any, read: Any, each: Any) -> Any:
        """Scores and mean actions of all components, in NumPy or torch.

        Args:
            maths: Either of them.
            scored: (..., candidates, per_candidate) what the scorer gives.
            others: (..., 3 numbers): the same of home, the score of anywhere, and the rest.
            read: See `read`.
            each: See `read_of_each`; of a candidate that is not there all columns are 0.

        Returns:
            (..., candidates + 2, 1 + numbers).
        """
        assert self.candidates is not None
        assert self.pointing is not None
        m, slope, columns = self.per_candidate, self.pointing.slope, self.candidates.columns[0]
        named = maths.concatenate([scored, others[..., None, :m]], -2)
        to_each = each[..., [columns.index(column) for column in self.candidates.vectors[0][:2]]]
        level, within = 0.0, []
        for k, reach_m in enumerate(REACHES_M):
            shares = maths.clip(FAR_M / reach_m * each[..., -2:-1], 0.0, 1.0)
            way = maths.concatenate([shares * to_each, read[..., None, self._home_within(k)]], -2)
            level = level + finely(maths.tanh(named[..., k + 1 : k + 2]), slope) * way
            within.append(1.0 - (way * way).sum(-1)[..., None] ** 0.5)
        first, near = self.heights_at
        heights = named[..., first:near] + within[0] * named[..., near:]
        towards = maths.concatenate([on_straight_line(maths, level, slope), heights], -1)
        anywhere = 0.0 * towards[..., :1, :]
        means = maths.concatenate([towards, anywhere], -2) + others[..., None, m + 1 :]
        there = (each[..., : len(columns)] != 0.0).any(-1)
        scores = maths.where(there, scored[..., 0], _NEVER)
        scores = maths.concatenate([scores, others[..., [0, m]]], -1)
        return maths.concatenate([scores[..., None], means], -1)

    def _home_within(self, k: int) -> list[int]:
        """Where `read` has the way home, shortened to a reach."""
        assert self.pointing is not None
        at = [vector[:2] for vector in self.vectors].index(self.pointing.home)
        first, n = self._plain, len(self.vectors)
        return [first + 2 * k * n + at, first + (2 * k + 1) * n + at]

    def _distance(self, maths: Any, closeness: Any) -> Any:
        nearest = self.nearby_m / (self.nearby_m + FAR_M)
        # a number over a tensor is the number times its reciprocal in torch: other last digits
        whole = maths.full_like(closeness, self.nearby_m)
        return whole / maths.clip(closeness, nearest, None) - self.nearby_m


def finely(number: Any, slope: float) -> Any:
    """Share of the limit that a number of the velocity action is."""
    return number * (slope + (1.0 - slope) * number * number)


def on_straight_line(maths: Any, share: Any, slope: float) -> Any:
    """The number that is this share of the limit: the one root of a cubic that rises everywhere."""
    bend = (3.0 * (1.0 - slope) / slope) ** 0.5
    return 2.0 / bend * maths.sinh(maths.asinh(1.5 / slope * bend * share) / 3.0)


_Row = dict[str, tuple[int, ...]]


def _columns_of(blocks: Sequence[Group]) -> dict[str, list[_Row]]:
    """Block -> for each of its rows, feature -> columns."""
    found: dict[str, list[_Row]] = {}
    column = 0
    for block in blocks:
        found[block.name] = []
        for _ in range(block.repeats):
            row = {}
            for feature in block.features:
                row[feature.name] = tuple(range(column, column + feature.size))
                column += feature.size
            found[block.name].append(row)
    return found


@dataclass
class _Read:
    """Columns that are read, as in `Actor`."""

    sharpened: tuple[str, ...]
    columns: list[int] = field(default_factory=list)
    sharp: list[int] = field(default_factory=list)
    vectors: list[Any] = field(default_factory=list)

    def add(self, row: _Row) -> None:
        """Read a row of a block."""
        self.columns += [column for columns in row.values() for column in columns]
        self.sharp += [column for name in self.sharpened for column in row.get(name, ())]
        if "direction" in row:
            self.vectors.append((*row["direction"], *(row.get("leg") or row["closeness"])))
