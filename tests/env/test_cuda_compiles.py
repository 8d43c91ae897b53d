"""The step of a GPU, compiled without one: by numba, and by NVIDIA's compiler where it is there."""

from inspect import getclosurevars, signature
from types import SimpleNamespace

import own_disturbances_on_gpu
import pytest
from changing_missions import EVENTS, mission
from numba import typeof
from own_actions import CLIMB_RATE

from uas_coverage_env.compiled.internals import KernelDispatcher
from uas_coverage_env.env.gpu import missions as missions_on_gpu

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


@pytest.fixture(params=["as_usual", "with_own_blocks"])
def missions(request, monkeypatch):
    """Missions whose arrays stay on the host."""
    monkeypatch.setattr(missions_on_gpu, "on_device", lambda arrays: arrays)
    if request.param == "as_usual":
        return missions_on_gpu.CudaMissions(2, mission(EVENTS[0]))
    own = own_disturbances_on_gpu
    return missions_on_gpu.CudaMissions(2, own.GROUND, disturbances=own.OWN, action=CLIMB_RATE)


def test_numba_finds_the_types_of_all_that_the_step_calls(missions):
    # on the simulated GPU it runs as Python, which asks for none
    step = missions._launched.py_func
    given = (missions._pool_there, *missions._arguments, 0)
    names = (*signature(step).parameters, "lane")
    types = {name: typeof(value) for name, value in zip(names, given, strict=True)}
    named = getclosurevars(step)
    parts = {*named.nonlocals.values(), *named.globals.values()}
    called = [part for part in parts if isinstance(part, KernelDispatcher)]
    assert len(called) == 5
    for kernel in called:
        kernel.compile(tuple(types[name] for name in signature(kernel.py_func).parameters))


def test_the_step_compiles_for_a_gpu(compiler, missions):
    given = [typeof(argument) for argument in (missions._pool_there, *missions._arguments)]
    from numba.cuda import compile_ptx

    code, _ = compile_ptx(missions._launched.py_func, tuple(given), cc=COMPUTE_CAPABILITY)
    assert ".visible .entry" in code
    assert ".extern .func" not in code  # all that is called is there
