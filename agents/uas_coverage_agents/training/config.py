"""How a learner is trained, as a small file: one TOML per published run, checked strictly."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AliasChoices, Field, model_validator

from uas_coverage_agents.policy.description import ScenarioFamily
from uas_coverage_agents.training.published import PUBLISHED, published_names
from uas_coverage_agents.velocity.settings import VelocitySettings
from uas_coverage_agents.waypoint.settings import WaypointSettings
from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse, read_toml
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.scenario import load_scenario

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
Count = Annotated[int, Field(ge=1)]

_FORMER = {"player": "policy", "lanes": "num_envs"}
"""Tables and keys that had another name before."""


class PpoSettings(StrictModel):
    """Proximal policy optimisation, as Stable-Baselines3 has it.

    Attributes:
        algorithm: "ppo"; "maskable-ppo" where the action has a mask.
        rollout_steps: Steps of every environment between two updates.
        batch_size: Samples of a gradient step.
        epochs: Passes over the samples of a rollout.
        learning_rate: At the start.
        final_share: What part of the learning rate is left in the end; it falls linearly.
        gamma: Discount of a decision.
        gae_lambda: Of the generalised advantage estimate.
        clip: Of the probability ratio.
        entropy: Weight of the entropy in the loss.
    """

    algorithm: Literal["ppo", "maskable-ppo"]
    rollout_steps: Count = 128
    batch_size: Count = 2048
    epochs: Count = 4
    learning_rate: Positive = 4e-4
    final_share: Share = 0.1
    gamma: Share = 0.99
    gae_lambda: Share = 0.95
    clip: Positive = 0.2
    entropy: Annotated[float, Field(ge=0.0)] = 0.0

    @property
    def keywords(self) -> dict[str, Any]:
        """The same by the names of Stable-Baselines3; the learning rate at the start."""
        return {
            "learning_rate": self.learning_rate,
            "n_steps": self.rollout_steps,
            "batch_size": self.batch_size,
            "n_epochs": self.epochs,
            "gamma": self.gamma,
            "gae_lambda": self.gae_lambda,
            "clip_range": self.clip,
            "ent_coef": self.entropy,
        }


class SacSettings(StrictModel):
    """Soft actor-critic, as Stable-Baselines3 has it.

    Attributes:
        algorithm: "sac".
        buffer_size: Samples that are remembered.
        first_samples: Samples before the first update.
        batch_size: Samples of a gradient step.
        updates_per_step: Gradient steps for a step of all environments.
        learning_rate: At the start.
        final_share: See `PpoSettings`.
        gamma: Discount of a decision.
        first_entropy: What a unit of entropy is worth at the start, in units of the reward; it is
            learned from there on. To be of the size of the reward of a step: where it is much
            larger, random actions pay best, and unlearning that takes 1/learning_rate updates for
            each factor of e.
    """

    algorithm: Literal["sac"]
    buffer_size: Annotated[int, Field(ge=1000, le=2_000_000)] = 100_000
    first_samples: Count = 5000
    batch_size: Count = 512
    updates_per_step: Count = 2
    learning_rate: Positive = 5e-4
    final_share: Share = 0.1
    gamma: Share = 0.99
    first_entropy: Positive = 0.02


class TrainingScenarios(StrictModel):
    """What is flown while learning.

    Attributes:
        family: Generated towns, or one scenario.
        pool: How many different towns; each episode draws one of them.
    """

    family: ScenarioFamily
    pool: Annotated[int, Field(ge=1, le=10_000)] = 128


class TrainingConfig(StrictModel):
    """One training.

    Attributes:
        summary: What it is, in a line.
        steps: Of all environments together, those that wait for the others included.
        num_envs: Missions flown at the same time. An environment of the learner is one UAS of one
            of them (velocities) or the whole team (waypoints). Files may say `lanes`, as before.
        scenarios: Where.
        learning: How the network is improved.
        policy: What it reads, what it commands, and what it is paid for.
    """

    summary: str
    steps: Count
    num_envs: Annotated[
        int, Field(ge=1, le=65_536, validation_alias=AliasChoices("num_envs", "lanes"))
    ]
    scenarios: TrainingScenarios
    learning: Annotated[PpoSettings | SacSettings, Field(discriminator="algorithm")]
    policy: Annotated[
        VelocitySettings | WaypointSettings,
        Field(discriminator="interface", validation_alias=AliasChoices("policy", "player")),
    ]

    @model_validator(mode="after")
    def _fits(self) -> Self:
        masked = self.policy.interface == "waypoint"
        if masked != (self.learning.algorithm == "maskable-ppo"):
            raise ValueError(
                f"learning.algorithm is {self.learning.algorithm!r}, but policy.interface is "
                f"{self.policy.interface!r}; waypoints need maskable-ppo, velocities ppo or sac"
            )
        attention = isinstance(self.policy, VelocitySettings) and self.policy.network == "attention"
        if attention and self.learning.algorithm != "ppo":
            raise ValueError("policy.network is 'attention', which is learned by ppo alone")
        return self


def load_config(
    name_or_path: str, *, scenario: str | None = None, changes: Sequence[str] = ()
) -> TrainingConfig:
    """Read a configuration.

    Args:
        name_or_path: One of `published_names()`, or the path of a TOML file.
        scenario: Train on this one instead: "generated", or what `load_scenario` takes.
        changes: `key=value` pairs, the key as in `learning.gamma`, the value as in TOML.

    Raises:
        InputError: There is none such, or something in it is wrong; one line.
    """
    if name_or_path in published_names():
        path = PUBLISHED / f"{name_or_path}.toml"
    elif name_or_path.endswith(".toml"):
        path = Path(name_or_path)
    else:
        take = f"take {', '.join(published_names())}, or the path of a .toml file"
        instead = did_you_mean(name_or_path, published_names(), take)
        raise InputError(f"unknown algorithm {name_or_path[:80]!r}; {instead}")
    config = read_toml(path, TrainingConfig)
    if scenario is None and not changes:
        return config
    data = config.model_dump(mode="json")
    if scenario is not None and scenario != data["scenarios"]["family"]["name"]:
        if scenario == "generated":
            raise InputError(f"{path}: trains on {data['scenarios']['family']['name']}, no towns")
        load_scenario(scenario)  # refuses now what could not be flown later
        data["scenarios"]["family"] = {"name": scenario}
    for change in changes:
        _set(data, change)
    return parse(data, TrainingConfig, f"{path} with your --set and --scenario")


def _set(data: dict[str, Any], change: str) -> None:
    """Put one `key=value` into the nested tables."""
    key, separator, text = (part.strip() for part in change.partition("="))
    if not separator or not key:
        raise InputError(f"--set {change!r}: should be KEY=VALUE, as in learning.gamma=0.99")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        value = text  # a plain word is text
    *tables, last = (_FORMER.get(name, name) for name in key.split("."))
    table = data
    for name in tables:
        inner = table.get(name)
        if not isinstance(inner, dict):
            raise InputError(f"--set {change!r}: there is no table {name!r}")
        table = inner
    if last not in table:
        raise InputError(f"--set {change!r}: there is no {last!r}; there are {', '.join(table)}")
    table[last] = value
