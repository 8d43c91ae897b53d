"""SciPy's linear programs."""

from typing import Any

from scipy import optimize

linprog: Any = optimize.linprog
"""Without its type: to find it out, a type checker reads through all of SciPy's solvers."""
