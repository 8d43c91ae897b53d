"""What `policy.json` says about a policy: everything but its weights, checked strictly."""

from collections.abc import Iterable, Mapping
from typing import Annotated, Literal, Self

from pydantic import Field, JsonValue, model_validator

from uas_coverage_agents.policy.networks import Network
from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.files.strict_toml import StrictModel

Name = Annotated[str, Field(min_length=1, max_length=200)]
Count = Annotated[int, Field(ge=0)]
Size = Annotated[int, Field(ge=1, le=100_000)]


class ObservedFeature(StrictModel):
    """Some numbers of an observation, as in `uas_coverage_env.env.observation.Feature`."""

    name: Name
    size: Size
    low: float
    high: float
    meaning: str


class ObservedGroup(StrictModel):
    """Features that belong together, `repeats` times in a row."""

    name: Name
    repeats: Size
    features: Annotated[tuple[ObservedFeature, ...], Field(min_length=1)]

    @property
    def size(self) -> int:
        """How many numbers."""
        return self.repeats * sum(feature.size for feature in self.features)


class Observation(StrictModel):
    """What the network reads: the numbers one after the other, and what lengths were scaled by.

    Attributes:
        layout: Name of the layout; a runner flies only policies of the layout it can compute.
        groups: In order.
        scales: Constants of the layout by name, with the unit at the end of the name.
    """

    layout: Name
    groups: Annotated[tuple[ObservedGroup, ...], Field(min_length=1)]
    scales: dict[Name, float]

    @property
    def size(self) -> int:
        """How many numbers."""
        return sum(group.size for group in self.groups)

    def has_the_numbers_of(self, other: Self) -> bool:
        """Whether both mean the same numbers, in whatever words."""
        words = {"groups": {"__all__": {"features": {"__all__": {"meaning"}}}}}
        return self.model_dump(exclude=words) == other.model_dump(exclude=words)

    @classmethod
    def of(cls, layout: str, groups: Iterable[Group], scales: Mapping[str, float]) -> Self:
        """Describe a layout that is given as the environment gives it."""
        described = [
            {
                "name": group.name,
                "repeats": group.repeats,
                "features": tuple(
                    {
                        "name": feature.name,
                        "size": feature.size,
                        "low": feature.low,
                        "high": feature.high,
                        "meaning": feature.meaning,
                    }
                    for feature in group.features
                ),
            }
            for group in groups
        ]
        return cls.model_validate(
            {"layout": layout, "groups": tuple(described), "scales": dict(scales)}
        )


class Towns(StrictModel):
    """Which generated scenarios: counts are drawn between the two numbers, both included."""

    first_seed: Count
    n_uas: tuple[Size, Size]
    n_waypoints: tuple[Size, Size]
    n_obstacles: tuple[Count, Count]

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        for name in ("n_uas", "n_waypoints", "n_obstacles"):
            least, most = getattr(self, name)
            if least > most:
                raise ValueError(f"{name} is [{least}, {most}]; the smaller number comes first")
        return self


class ScenarioFamily(StrictModel):
    """What a policy was trained on.

    Attributes:
        name: "generated", or the name of a scenario.
        towns: Of a generated family.
    """

    name: Name
    towns: Towns | None = None


class Training(StrictModel):
    """How a policy came about.

    Attributes:
        algorithm: As in `uas-coverage train ALGORITHM`.
        settings: The whole configuration, as plain data.
        seed: Of the training.
        steps: Of all environments together, those that wait for the others included.
        process_s: Processor time [s].
        wall_s: [s].
        machine: Where.
    """

    algorithm: Name
    settings: dict[str, JsonValue]
    seed: Count
    steps: Count
    process_s: Annotated[float, Field(ge=0.0)]
    wall_s: Annotated[float, Field(ge=0.0)]
    machine: str


class Interval(StrictModel):
    """A mean with its 95 % interval."""

    mean: float
    low: float
    high: float


class ValidationScore(StrictModel):
    """How it flew scenarios that it was not trained on.

    Attributes:
        scenarios: Which.
        missions: How many.
        measures: Measure, with its unit at the end -> mean and interval.
    """

    scenarios: Name
    missions: Annotated[int, Field(ge=1)]
    measures: dict[Name, Interval]


Interface = Literal["route", "route-velocity", "environment"]
"""What the outputs of a network mean: routes, these and velocities along them, or the actions of an
environment."""


class PolicyDescription(StrictModel):
    """The content of `policy.json`.

    Attributes:
        format: "uas-coverage-policy".
        version: Of the format.
        interface: What its outputs mean.
        network: What computes them.
        observation: What it reads.
        scenarios: What it was trained on.
        training: How.
        score: How it flew, where it was scored.
        versions: Package -> version that it was trained with.
        weights_sha256: Of `policy.safetensors`; empty until it is saved.
    """

    format: Literal["uas-coverage-policy"] = "uas-coverage-policy"
    version: Annotated[int, Field(ge=1, le=1)] = 1
    interface: Interface
    network: Network
    observation: Observation
    scenarios: ScenarioFamily
    training: Training
    score: ValidationScore | None = None
    versions: dict[Name, str]
    weights_sha256: Annotated[str, Field(pattern="^([0-9a-f]{64})?$")] = ""

    @model_validator(mode="after")
    def _inputs_fit(self) -> Self:
        # the sizes of a file are not trusted: this keeps a network from reading what is not there
        if self.network.inputs != self.observation.size:
            raise ValueError(
                f"network.inputs is {self.network.inputs}, but the observation has "
                f"{self.observation.size} numbers; they are the same"
            )
        return self
