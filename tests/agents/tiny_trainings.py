"""Trainings that learn next to nothing, quickly."""

from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.rounds import learner_of
from uas_coverage_agents.training.settings import LearnerSettings, settings_of

SMALL = ("num_envs=2", "rounds=2", "total_timesteps=64")
ON_POLICY = (*SMALL, "learning.n_steps=16", "learning.batch_size=16")
OFF_POLICY = (
    *(*SMALL, "learning.batch_size=16", "learning.learning_starts=8"),
    *("learning.buffer_size=500", "environment.action=velocity"),
)


def tiny(name: str, *changes: str, scenario: str = "easy") -> LearnerSettings:
    """A learner of the package, or MODULE:CLASS, in two short rounds."""
    off = name in ("sac", "td3", "tqc")
    small = OFF_POLICY if off else SMALL if ":" in name else ON_POLICY
    return settings_of(name, scenario=scenario, changes=[*small, *changes])


def untrained(*changes: str, name: str = "learned-velocity", seed: int = 0):
    """A learner that has learned nothing."""
    settings = settings_of(name, changes=changes)
    return learner_of(settings, Missions.of(settings), seed)
