"""How policies are trained: needs the extra `learn` (torch, Stable-Baselines3); flying does not."""
