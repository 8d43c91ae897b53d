"""MILP solvers behind one interface: one file each, chosen by name."""

from importlib import import_module

from uas_coverage_baselines.milp_mpc.solvers.interface import Solve, SolverLimits
from uas_coverage_env.files.strict_toml import InputError

_PACKAGES = {"highs": "highspy", "scip": "pyscipopt", "gurobi": "gurobipy"}
SOLVERS = tuple(_PACKAGES)


def solver_named(name: str) -> Solve:
    """The function that solves with the named solver; its package is imported here and not before.

    Args:
        name: one of `SOLVERS`.

    Raises:
        InputError: unknown name, or the solver's package is not installed; one line.
    """
    if name not in _PACKAGES:
        raise InputError(f"unknown solver {name!r}; allowed: {', '.join(SOLVERS)}")
    try:
        return import_module(f"{__name__}.{name}").solve
    except ImportError as error:
        package = _PACKAGES[name]
        reason = " ".join(str(error).split())
        raise InputError(
            f"solver {name!r} needs the package {package} ({reason}); "
            "install it with: pip install 'uas-coverage-env[solvers]'"
        ) from error


__all__ = ["SolverLimits", "solver_named"]
