"""PPO with shared weights, from decisions alone: `uas-coverage train ppo-waypoint`, `ppo-velocity`.

Schulman et al. 2017 as it is usually done, on the batch of environments itself. What is its own:

- *Packed samples.* Rows of a batch in which no UAS decides, since it has landed, is lost, or is not
  in the fleet, are not learned from; they are up to 70 % of all.
- *Phases.* Weights of the reward, learning rate, entropy and noise change with the steps, see
  `Phase`. A loss that costs much from the first step on teaches to land at once.
- *Noise by a schedule* where actions are numbers: no landing is found with more than a tenth of the
  top speed, and a spread that is learned stays above it.
- *The time limit is an end*, since the time that is left is observed.
"""

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple, Self

import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray
from pydantic import Field, model_validator
from torch import Tensor, nn

from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.policy.environment import observed, plain
from uas_coverage_agents.training.actor import ActorCritic
from uas_coverage_agents.training.draws import drawn, likely
from uas_coverage_agents.training.flown import CUDA, FlownMissions, device_of
from uas_coverage_agents.training.learner import SEEDS_APART, Arrays, Learned, Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.settings import Count, LearnerSettings, own_settings
from uas_coverage_agents.training.torch_state import Modules
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.env import K_WAYPOINTS, CoverageBatch, MissionSettings
from uas_coverage_env.files.strict_toml import InputError, StrictModel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.tasks.lessons import LESSONS

Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]

_READ = {"num_envs", "total_timesteps", "environment", "device"}
AUTORESET = "same_step"
"""Of missions on the processor."""

_MOMENTS = ("exp_avg", "exp_avg_sq", "step")


class Phase(StrictModel):
    """What holds from some step on; a round has the phase in which it begins.

    Attributes:
        begins: At which share of all steps.
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
    phases: Annotated[tuple[Phase, ...], Field(min_length=1)] = (Phase(),)

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        begins = [phase.begins for phase in self.phases]
        if begins[0] != 0 or sorted(set(begins)) != begins:
            raise ValueError(f"phases: they begin at {begins}; give 0 first, then rising numbers")
        return self


class PackedPpo:
    """See `Learner`.

    Args:
        settings: Of the training; `[learning]` is `PackedSettings`.
        missions: Where it learns.
        seed: Of network, sampling and missions.

    Raises:
        InputError: A setting is not for this learner.
    """

    def __init__(self, settings: LearnerSettings, missions: Missions, seed: int) -> None:
        torch.manual_seed(seed)
        self._settings, self._missions, self._seed = settings, missions, seed
        self._own = own_settings(settings, PackedSettings, _READ)
        self._keywords, self._steps = missions.settings(), 0
        for phase in self._own.phases:
            self._check(phase)
        rules = MissionSettings.of(self._keywords)
        self._check_device(rules)
        points = rules.kind.numbers[:2] == ("north_mps", "east_mps")
        self._network = Actor.of(
            rules.observation,
            K_WAYPOINTS if (rules.chooses or points) and self._own.width else 0,
            rules.kind.choices or rules.kind.size,
            hidden=self._own.hidden,
            width=self._own.width,
            rows=self._own.rows,
            temperature=self._own.temperature if rules.chooses or points else 0.0,
            environment=plain(self._keywords),
            slope=next(iter(rules.kind.parameters), 1.0) if points else None,
        )
        self._model = ActorCritic(self._network).to(self._device)
        self._optimiser = torch.optim.Adam(self._model.parameters(), eps=1e-5)
        self._modules = Modules(model=self._model)

    @property
    def steps(self) -> int:
        """Decisions that were learned from."""
        return self._steps

    def learn(self, number: int, told: Told) -> None:
        """As many steps as are a round's share of the whole, in new missions."""
        settings = self._settings
        wanted = settings.total_timesteps * (number + 1) // settings.rounds
        if self._steps >= wanted:
            return
        begins = [phase.begins for phase in self._own.phases]
        phase = self._own.phases[bisect_right(begins, self._share) - 1]
        flown = _Flown(self._begun(phase, number), self._own)
        while self._steps < wanted:
            noise = self._noise(phase)
            rows = flown.collect(self._model, noise)
            if self._steps == 0:
                # what was seen at first is what is expected from then on
                with torch.no_grad():
                    self._model.standardise(rows.read, rows.each, rows.exists)
            self._steps += len(rows.read)
            kl = self._learn_from(rows, phase, noise)
            told.add(self._steps, kl=kl, noise=noise, **flown.tell())

    def state_dict(self) -> Arrays:
        """Weights, the moments of Adam, and the steps."""
        arrays = {**self._modules.state_dict(), "steps": np.array(self._steps)}
        for k, kept in self._optimiser.state_dict()["state"].items():
            arrays |= {f"adam/{k}/{name}": kept[name].cpu().numpy().copy() for name in _MOMENTS}
        return arrays

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Learner`."""
        self._modules.load_state_dict(state)
        kept = self._optimiser.state_dict()
        shapes = [parameter.shape for parameter in self._model.parameters()]
        try:
            self._steps = int(state["steps"])
            if self._steps:
                for k, shape in enumerate(shapes):
                    moments = {n: torch.from_numpy(state[f"adam/{k}/{n}"].copy()) for n in _MOMENTS}
                    if any(moments[name].shape != shape for name in _MOMENTS[:2]):
                        raise ValueError(f"adam/{k}: other shapes")
                    kept["state"][k] = moments
            self._optimiser.load_state_dict(kept)
        except (KeyError, ValueError, TypeError, RuntimeError) as error:
            raise InputError(f"the checkpoint does not fit this learner ({error})") from error

    def learned(self) -> Learned:
        """The policy; it flies without torch."""
        return Learned(
            "environment", self._network, observed(self._keywords), self._model.tensors()
        )

    def _check(self, phase: Phase) -> None:
        try:
            MissionSettings.of(self._paid(phase))
        except ValueError as error:
            raise InputError(f"[learning] phases: {error}") from error

    def _paid(self, phase: Phase) -> dict[str, Any]:
        """Keyword arguments of the environments in a phase."""
        weights = {**(self._keywords.get("reward_weights") or {}), **phase.reward_weights}
        return {**self._keywords, "reward_weights": weights}

    def _check_device(self, rules: MissionSettings) -> None:
        """Find where it learns, and refuse what does not fly there, before anything is compiled."""
        if self._settings.device == CUDA:
            from uas_coverage_env.env.gpu.refused import Asked, refuse

            try:
                refuse(Asked((), rules, None, AutoresetMode.NEXT_STEP, 1, None))
            except ValueError as error:
                raise InputError(f"{self._settings.algorithm}: {error}") from error
            if rules.kind.mask and all(rules.kind is not each for each in rules.version.actions):
                raise InputError(f"action {rules.kind.name!r}: its masks are made on the processor")
        self._device = device_of(self._settings.device)

    def _begun(self, phase: Phase, number: int) -> FlownMissions:
        """New missions for a round; on a GPU, one that ends begins anew in the step after."""
        first = (self._seed // SEEDS_APART * self._settings.rounds + number) * self._own.missions
        drawn = [self._missions.mission(first + k) for k in range(self._own.missions)]
        taught = phase.taught(list({id(each): each for each in drawn}.values()))
        num_envs, paid = self._settings.num_envs, self._paid(phase)
        seed = self._seed * num_envs
        if self._settings.device == CUDA:
            from uas_coverage_env.env.gpu.missions import CudaMissions

            missions = CudaMissions(num_envs, taught, **paid)
            missions.reset(seed=seed)
            return FlownMissions(missions, same_step=False)
        batch = CoverageBatch(num_envs, taught, autoreset=AUTORESET, **paid)
        batch.reset(seed)
        return FlownMissions(batch, same_step=AUTORESET == "same_step")

    @property
    def _share(self) -> float:
        return self._steps / self._settings.total_timesteps

    def _noise(self, phase: Phase) -> float:
        """Of actions that are numbers, now."""
        later = [p.begins for p in self._own.phases if p.begins > phase.begins]
        past = (self._share - phase.begins) / (min(later, default=1.0) - phase.begins)
        share = min(max(past, 0.0), 1.0)
        return float(phase.noise[0] ** (1.0 - share) * phase.noise[1] ** share)

    def _learn_from(self, rows: "Rows", phase: Phase, noise: float) -> float:
        """Change the weights; gives how far the policy has moved (KL divergence)."""
        own, kl = self._own, 0.0
        for group in self._optimiser.param_groups:
            group["lr"] = phase.learning_rate
        advantages = (rows.advantages - rows.advantages.mean()) / (rows.advantages.std() + 1e-6)
        for _ in range(own.n_epochs):
            moved = []
            order = torch.randperm(len(advantages), device=self._device)
            for some in order.split(own.batch_size):
                each = None if rows.each is None else rows.each[some]
                exists = None if rows.masks is None else rows.masks[some]
                outputs = self._model.outputs(rows.read[some], each)
                chance, entropy = likely(outputs, rows.actions[some], exists, noise)
                apart = chance - rows.likely[some]
                ratio, better = apart.exp(), advantages[some]
                within = ratio.clamp(1.0 - own.clip_range, 1.0 + own.clip_range)
                errors = self._model.values(rows.read[some]) - rows.returns[some]
                loss = (
                    -torch.min(ratio * better, within * better).mean()
                    + own.vf_coef * (errors**2).mean()
                    - phase.ent_coef * entropy
                )
                self._optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(self._model.parameters(), own.max_grad_norm)
                self._optimiser.step()
                moved.append(float((ratio.detach() - 1.0 - apart.detach()).mean()))
            kl = float(np.mean(moved))
            if kl > own.target_kl:
                break
        return kl


class Rows(NamedTuple):
    """Decisions, N of them, one after the other: of all steps, missions and UAS."""

    read: Tensor
    """(N, features)."""
    each: Tensor | None
    """(N, candidates, their inputs)."""
    masks: Tensor | None
    """(N, choices) which exist."""
    actions: Tensor
    """(N,) choices, or (N, numbers) with their noise."""
    likely: Tensor
    """(N,) logarithms of their probabilities when they were taken."""
    advantages: Tensor
    """(N,)."""
    returns: Tensor
    """(N,)."""

    @property
    def exists(self) -> Tensor | None:
        """(N, candidates)."""
        if self.masks is None or self.each is None:
            return None
        return self.masks[:, : self.each.shape[1]]


class _Flown:
    """Missions that are flown to learn from them; they go on from one `collect` to the next.

    Args:
        missions: That have begun.
        own: How long is flown, and what a reward is worth later.
    """

    def __init__(self, missions: FlownMissions, own: PackedSettings) -> None:
        self._missions, self._own = missions, own
        self._ended: Tensor | float = 0.0

    def collect(self, model: ActorCritic, noise: float) -> Rows:
        """Fly on with what is known, with noise; nothing but decisions is kept."""
        missions, own = self._missions, self._own
        kept: list[tuple[Any, ...]] = []
        of_steps: list[tuple[Tensor, ...]] = []
        for _ in range(own.n_steps):
            acts = missions.deciding
            read, each = model.read(missions.observation[acts])
            masks = missions.masks[acts] if missions.chooses else None
            with torch.no_grad():
                actions, chance = drawn(model.outputs(read, each), masks, noise)
            expected = self._values(model, acts, read)
            kept.append((read, each, masks, actions, chance))
            missions.step(acts, actions)
            rewards = (own.reward_scale * missions.rewards).float()
            of_steps.append((acts, expected, rewards, self._end(acts)))
        missions.check()
        last = missions.deciding
        beyond = self._values(model, last, model.read(missions.observation[last])[0])
        decided, expected, rewards, ended = map(torch.stack, zip(*of_steps, strict=True))
        values = torch.cat([expected, beyond[None]])
        advantages = advantages_of(rewards, values, ended, own.gamma, own.gae_lambda)
        read, each, masks, actions, chance = map(_joined, zip(*kept, strict=True))
        gained = advantages[decided]
        return Rows(read, each, masks, actions, chance, gained, gained + expected[decided])

    def tell(self) -> dict[str, float]:
        """Of the UAS whose flights ended since the last time: how, with the noise of learning."""
        flights, home, share = torch.as_tensor(self._ended).expand(3).tolist()
        self._ended = 0.0
        there = max(flights, 1.0)
        return {"flights": flights, "home": home / there, "lost_or_late": share / there}

    def _values(self, model: ActorCritic, acts: Tensor, read: Tensor) -> Tensor:
        """(L, U) what is expected, where it is asked for."""
        values = torch.zeros(self._missions.shape, device=read.device)
        with torch.no_grad():
            values[acts] = model.values(read)
        return values

    def _end(self, acted: Tensor) -> Tensor:
        """(L, U) whose flight this step has ended."""
        status = self._missions.status
        ended = acted & (self._missions.over[:, None] | (status != FLYING))
        home = ended & (status == LANDED)
        self._ended = self._ended + torch.stack([ended.sum(), home.sum(), (ended & ~home).sum()])
        return ended


def advantages_of(
    rewards: Tensor, values: Tensor, ended: Tensor, gamma: float, gae_lambda: float
) -> Tensor:
    """Generalised advantages (Schulman et al. 2016); an end is worth nothing beyond its reward.

    Args:
        rewards: (T, ...).
        values: (T + 1, ...) what was expected.
        ended: (T, ...).
        gamma: Discount.
        gae_lambda: Of the mean over longer and longer looks.

    Returns:
        (T, ...).
    """
    found, later = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for t in range(len(rewards) - 1, -1, -1):
        goes_on = torch.where(ended[t], 0.0, 1.0)
        error = rewards[t] + gamma * goes_on * values[t + 1] - values[t]
        later = found[t] = error + gamma * gae_lambda * goes_on * later
    return found


def _joined(parts: Sequence[Any]) -> Any:
    """Of all steps, one after the other; None where there are none."""
    return None if parts[0] is None else torch.cat(tuple(parts))
