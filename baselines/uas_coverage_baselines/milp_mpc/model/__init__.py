"""The OCP as data: the problem of a decision, its blocks, its formulations, what flights cost."""
