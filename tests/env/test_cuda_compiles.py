"""The step of a GPU, compiled for one by NVIDIA's compiler, which needs no GPU."""

from types import SimpleNamespace

import own_disturbances_on_gpu
import pytest
from changing_missions import EVENTS, mission
from numba import typeof
from own_actions import CLIMB_RATE

from uas_coverage_env.env import cuda as missions_on_gpu

COMPUTE_CAPABILITY = (8, 0)


@pytest.fixture
def compiler(monkeypatch):
    """NVIDIA's compiler, asked to compile for a GPU that is not there."""
    pytest.importorskip(
        "numba_cuda", reason="numba-cuda, which compiles for GPUs, is not installed"
    )
    from numba.cuda import dispatcher
    from numba.cuda.cudadrv.error import NvvmSupportError
    from numba.cuda.cudadrv.nvvm import NVVM

    try:
        NVVM()
    except NvvmSupportError as error:
        pytest.skip(f"NVVM, which numba-cuda compiles with, is not installed: {error}")
    there = SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    monkeypatch.setattr(dispatcher, "get_current_device", lambda: there)
    monkeypatch.setattr(missions_on_gpu, "on_device", lambda arrays: arrays)


@pytest.mark.parametrize(
    ("scenario", "settings"),
    [
        (mission(EVENTS[0]), {}),
        (
            own_disturbances_on_gpu.GROUND,
            {"disturbances": own_disturbances_on_gpu.OWN, "action": CLIMB_RATE},
        ),
    ],
    ids=["as_usual", "with_own_blocks"],
)
def test_the_step_compiles_for_a_gpu(compiler, scenario, settings):
    missions = missions_on_gpu.CudaMissions(2, scenario, **settings)
    given = [typeof(argument) for argument in (missions._pool_there, *missions._arguments)]
    from numba.cuda import compile_ptx  # pyright: ignore[reportPrivateImportUsage]

    code, _ = compile_ptx(missions._launched.py_func, tuple(given), cc=COMPUTE_CAPABILITY)
    assert ".visible .entry" in code
    assert ".extern .func" not in code  # all that is called is there
