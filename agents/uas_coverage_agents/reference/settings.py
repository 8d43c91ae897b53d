"""What a reference learner is, as a small file: `learners/NAME.toml`, checked strictly."""

from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from uas_coverage_env.files.strict_toml import InputError, StrictModel, read_toml
from uas_coverage_env.files.suggestions import did_you_mean

Count = Annotated[int, Field(ge=1)]

FOLDER = Path(str(files("uas_coverage_agents.reference"))) / "learners"


class Environment(StrictModel):
    """What a learner chooses of a level.

    Attributes:
        action: Kind of action; None: that of the level.
        observation: Name of an observation.
    """

    action: str | None = None
    observation: str = "default"


class Reference(StrictModel):
    """One learner.

    Attributes:
        summary: What it is, in a line.
        library: Where the class is that learns.
        algorithm: The class.
        policy: Its network, by the library's name.
        agent: "swarm": one agent flies the whole fleet. "each": one agent per UAS, all of which
            share the weights.
        critic: "own": the critic sees what the policy sees. "full": the whole mission.
        missions: Flown at the same time.
        steps: Learned from, of all agents together.
        rounds: How many; each ends with a checkpoint and begins with new missions.
        environment: What it chooses of a level.
        learning: Arguments of the class, by its own names; else the library's defaults.
    """

    summary: str
    library: Literal["stable_baselines3", "sb3_contrib"]
    algorithm: Literal["PPO", "SAC", "MaskablePPO", "RecurrentPPO"]
    policy: Literal["MlpPolicy", "MlpLstmPolicy"]
    agent: Literal["swarm", "each"]
    critic: Literal["own", "full"] = "own"
    missions: Count
    steps: Count
    rounds: Count
    environment: Environment = Environment()
    learning: dict[str, Any] = Field(default_factory=dict)


def reference_names() -> list[str]:
    """Of the learners that come with the package."""
    return sorted(path.stem for path in FOLDER.glob("*.toml"))


def reference_named(name_or_path: str) -> Reference:
    """A learner of the package, or one of your own.

    Args:
        name_or_path: One of `reference_names()`, or the path of a TOML file.

    Raises:
        InputError: There is none, or something in it is wrong; one line.
    """
    known = reference_names()
    if name_or_path in known:
        return read_toml(FOLDER / f"{name_or_path}.toml", Reference)
    if name_or_path.endswith(".toml"):
        return read_toml(name_or_path, Reference)
    take = f"take {', '.join(known)}, or the path of a .toml file"
    raise InputError(f"unknown learner {name_or_path!r}; {did_you_mean(name_or_path, known, take)}")
