"""Many missions: one runner of jobs, and one store of what came of them."""

from uas_coverage_env.runner.jobs import Backend, Job, WorkerLostError, Workers
from uas_coverage_env.runner.store import STORE, Store, opened, rows_in

__all__ = [
    "STORE",
    "Backend",
    "Job",
    "Store",
    "WorkerLostError",
    "Workers",
    "opened",
    "rows_in",
]
