"""The pointer network: one scorer for every choice, whatever their number and order."""

from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from uas_coverage_agents.policy.tensors import Tensors, Width
from uas_coverage_env.files.strict_toml import StrictModel

HOME_AT_FIRST = -5.0
"""Score of the last choice before anything is learned; the nearest candidate has 0."""


class Pointer(StrictModel):
    """Scores the candidates and, last, the choice that is always there (home).

    A candidate c becomes e = relu(W₂ relu(W₁ c + b₁) + b₂). What the team and the mean candidate
    look like becomes t = relu(Wₜ [team, mean e] + bₜ). The score of a candidate is
    w · relu(Wₑ e + Wₛ t + bₛ) - prior (way - least way), that of home w' · relu(Wₕ t + bₕ) + b'.
    So with w = 0 the nearest candidate wins, and what is learned is added to that.

    Attributes:
        kind: "pointer".
        inputs: `team` numbers, then `features` of each of the `candidates`.
        outputs: One score for each candidate, and the last.
        team: Numbers about the team.
        candidates: How many there are at most.
        features: Numbers about a candidate; the first is 1, or 0 where there is none.
        way: Which of them says how long the way is.
        hidden: Width of all layers between.
        prior: Score lost per unit of way.
    """

    kind: Literal["pointer"] = "pointer"
    inputs: Width
    outputs: Width
    team: Width
    candidates: Width
    features: Width
    way: Width
    hidden: Width
    prior: float

    @model_validator(mode="after")
    def _sizes_fit(self) -> Self:
        if self.inputs != self.team + self.candidates * self.features:
            raise ValueError(
                f"inputs is {self.inputs}, but team + candidates * features is "
                f"{self.team + self.candidates * self.features}; they are the same"
            )
        if self.outputs != self.candidates + 1:
            raise ValueError(f"outputs is {self.outputs}; it should be {self.candidates + 1}")
        if self.way >= self.features:
            raise ValueError(f"way is {self.way}, but there are {self.features} features")
        return self

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor."""
        h = self.hidden
        return {
            "candidate.0.weight": (h, self.features),
            "candidate.0.bias": (h,),
            "candidate.1.weight": (h, h),
            "candidate.1.bias": (h,),
            "team.weight": (h, self.team + h),
            "team.bias": (h,),
            "score.candidate.weight": (h, h),
            "score.team.weight": (h, h),
            "score.team.bias": (h,),
            "score.out.weight": (1, h),
            "home.0.weight": (h, h),
            "home.0.bias": (h,),
            "home.1.weight": (1, h),
            "home.1.bias": (1,),
        }

    def forward(self, tensors: Tensors, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run it.

        Args:
            tensors: Those of `shapes`.
            inputs: (..., inputs).

        Returns:
            (..., outputs); the score of a candidate that is not there means nothing.
        """
        x = np.asarray(inputs, dtype=np.float64)
        team = x[..., : self.team]
        candidates = x[..., self.team :].reshape(*x.shape[:-1], self.candidates, self.features)

        def layer(name: str, value: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.maximum(value @ tensors[f"{name}.weight"].T + tensors[f"{name}.bias"], 0.0)

        there = candidates[..., :1]
        e = layer("candidate.1", layer("candidate.0", candidates)) * there
        mean = e.sum(axis=-2) / np.maximum(there.sum(axis=-2), 1.0)
        t = layer("team", np.concatenate([team, mean], axis=-1))
        offered = t @ tensors["score.team.weight"].T + tensors["score.team.bias"]
        hidden = np.maximum(e @ tensors["score.candidate.weight"].T + offered[..., None, :], 0.0)
        way = candidates[..., self.way]
        # candidates come in the order of their ways
        scores = (hidden @ tensors["score.out.weight"].T)[..., 0]
        scores = scores - self.prior * (way - way[..., :1])
        home = layer("home.0", t) @ tensors["home.1.weight"].T + tensors["home.1.bias"]
        return np.concatenate([scores, home], axis=-1)
