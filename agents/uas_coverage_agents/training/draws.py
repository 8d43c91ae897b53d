"""What a learner does by chance: which choice, which action, and how likely it was."""

import torch
from torch import Tensor

_NEVER = -1e9
_LEAST = -30.0


def drawn(outputs: Tensor, masks: Tensor | None, noise: float) -> tuple[Tensor, Tensor]:
    """Actions, and the logarithms of their probabilities.

    Args:
        outputs: (N, choices) scores, with masks; (N, numbers) means; or (N, components,
            1 + numbers) the score of each component of a mixture, and its mean.
        masks: (N, choices) which exist; None: actions are numbers.
        noise: Standard deviation of actions that are numbers.
    """
    if masks is not None:
        actions = _choice(_masked(outputs, masks))
    else:
        means = outputs
        if outputs.dim() == 3:
            chosen = _choice(outputs[:, :, 0])
            means = outputs[torch.arange(len(outputs), device=outputs.device), chosen, 1:]
        actions = means + noise * torch.randn_like(means)
    return actions, likely(outputs, actions, masks, noise)[0]


def likely(
    outputs: Tensor, actions: Tensor, masks: Tensor | None, noise: float
) -> tuple[Tensor, Tensor]:
    """(N,) logarithms of the probabilities of actions, and the mean entropy of what is chosen."""
    if masks is not None:
        logarithms = torch.log_softmax(_masked(outputs, masks), 1)
        return logarithms.gather(1, actions[:, None])[:, 0], _entropy(logarithms)
    if outputs.dim() == 2:
        return _gaussian(actions - outputs, noise), torch.zeros(())
    weights = torch.log_softmax(outputs[:, :, 0], 1)
    near = _gaussian(actions[:, None] - outputs[:, :, 1:], noise)
    return torch.logsumexp(weights + near, 1), _entropy(weights)


def _choice(scores: Tensor) -> Tensor:
    """By the softmax of its score (E. Gumbel)."""
    chance = torch.rand_like(scores).clamp(1e-9, 1.0 - 1e-7)
    return (scores - torch.log(-torch.log(chance))).argmax(1)


def _gaussian(apart: Tensor, noise: float) -> Tensor:
    return -0.5 * ((apart / noise) ** 2).sum(-1)


def _entropy(logarithms: Tensor) -> Tensor:
    return -(logarithms.exp() * logarithms.clamp(min=_LEAST)).sum(1).mean()


def _masked(outputs: Tensor, masks: Tensor) -> Tensor:
    return outputs.masked_fill(~masks, _NEVER)
