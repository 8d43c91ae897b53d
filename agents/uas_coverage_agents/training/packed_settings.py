"""What `packed-ppo` is told: the table `[learning]` of its learners."""

from collections.abc import Sequence
from typing import Annotated, Self

from pydantic import Field, model_validator

from uas_coverage_agents.training.settings import Count
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.tasks.lessons import LESSONS

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


class Phase(StrictModel):
    """What holds from some step on; a round has the phase in which it begins.

    Attributes:
        begins: At which share of all steps, those of other beginnings left out.
        reward_weights: Instead of those of the environment.
        learning_rate: Of Adam.
        ent_coef: Weight of the entropy of the choices.
        noise: Standard deviation of actions that are numbers, at its begin and its end; between
            them it falls exponentially.
        lessons: Lessons of levels (`uas_coverage_env.tasks.LESSONS`), and which share of the
            missions is easier by each; the rest are as they are.
    """

    begins: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    reward_weights: dict[str, float] = Field(default_factory=dict)
    learning_rate: Positive = 7e-4
    ent_coef: NotNegative = 0.0
    noise: tuple[Positive, Positive] = (0.4, 0.4)
    lessons: dict[str, Share] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _are_lessons(self) -> Self:
        for name in self.lessons:
            if name not in LESSONS or LESSONS[name].of is None:
                known = ", ".join(each for each, lesson in LESSONS.items() if lesson.of)
                raise ValueError(f"lessons: {name!r} is none that changes missions: {known}")
        if sum(self.lessons.values()) > 1.0:
            raise ValueError(f"lessons: shares of {sum(self.lessons.values()):g}; give at most 1")
        return self

    def taught(self, missions: Sequence[Scenario]) -> list[Scenario]:
        """The missions, of which shares are those of the lessons."""
        taught, first = list(missions), 0
        for name, share in self.lessons.items():
            last = first + round(share * len(taught))
            easier = LESSONS[name].of
            assert easier is not None
            taught[first:last] = map(easier, taught[first:last])
            first = last
        return taught


class PackedSettings(StrictModel):
    """The table `[learning]`; names are those of Stable-Baselines3 where it has one.

    Attributes:
        n_steps: Of each environment, before the weights are changed.
        batch_size: Decisions that are learned from at once.
        n_epochs: How often each is learned from.
        gamma: Discount of a step.
        gae_lambda: Of generalised advantage estimation.
        clip_range: Of the ratio of probabilities.
        vf_coef: Weight of the error of values.
        max_grad_norm: Gradients are shortened to it.
        target_kl: No further epoch where the policy has moved so far.
        reward_scale: What is learned is this times the reward.
        hidden: Widths of the layers, of policy and of values.
        width: Of the scorer of candidates; 0: there is none, choices are outputs like others.
        rows: How many of the nearest waypoints the layers see.
        temperature: At which the policy draws its choices in flight: 1 as while it learns, 0 the
            best one.
        missions: Of a round, from which the environments draw.
        beginnings: So many trainings begin, one after the other; the one that comes to most on
            validation missions goes on in the rounds after these.
        beginning_rounds: Of each, where there are several.
        validate_every: Steps after which what was learned flies validation missions; the best so
            far is the policy. 0: never, and the last is.
        validation_missions: How many.
        phases: In order of their begin; the first begins at 0.
    """

    n_steps: Count = 64
    batch_size: Count = 4096
    n_epochs: Count = 2
    gamma: Share = 0.998
    gae_lambda: Share = 0.97
    clip_range: Positive = 0.2
    vf_coef: NotNegative = 0.5
    max_grad_norm: Positive = 0.5
    target_kl: Positive = 0.04
    reward_scale: Positive = 0.2
    hidden: Annotated[tuple[Count, ...], Field(min_length=1, max_length=8)] = (96, 64)
    width: Annotated[int, Field(ge=0, le=4096)] = 32
    rows: Count = 6
    temperature: NotNegative = 0.5
    missions: Count = 128
    beginnings: Count = 1
    beginning_rounds: Count = 1
    validate_every: Annotated[int, Field(ge=0)] = 0
    validation_missions: Annotated[int, Field(ge=1, le=50)] = 50
    phases: Annotated[tuple[Phase, ...], Field(min_length=1)] = (Phase(),)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        begins = [phase.begins for phase in self.phases]
        if begins[0] != 0 or sorted(set(begins)) != begins:
            raise ValueError(f"phases: they begin at {begins}; give 0 first, then rising numbers")
        if self.beginnings > 1 and not self.validate_every:
            raise ValueError(f"beginnings = {self.beginnings}: give validate_every, too")
        return self
