"""The step of a GPU, compiled without one: by numba, and by NVIDIA's compiler where it is there."""

from inspect import getclosurevars
from types import SimpleNamespace

import own_disturbances_on_gpu
import pytest
from changing_missions import EVENTS, mission
from numba import typeof, types
from own_actions import CLIMB_RATE
from own_blocks import SLOW, beacon

from uas_coverage_env.compiled.views import Handover
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env import REWARD, grid, local
from uas_coverage_env.env.gpu import missions as missions_on_gpu
from uas_coverage_env.env.versions import V1

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


OWN = {
    "as_usual": {},
    "with_own_disturbances": {"disturbances": own_disturbances_on_gpu.OWN, "action": CLIMB_RATE},
    "going_to_places": {"action": "waypoint", "version": V1, "return_mode": True},
    "with_own_blocks": {
        "observation": (*local(), grid(4), beacon(0.0, 0.0)),
        "reward": (*REWARD, SLOW),
    },
}


@pytest.fixture(params=OWN)
def missions(request, monkeypatch):
    """Missions whose arrays stay on the host."""
    monkeypatch.setattr(missions_on_gpu, "check_gpu", lambda: None)
    monkeypatch.setattr(missions_on_gpu, "on_device", lambda arrays: arrays)
    disturbed = request.param == "with_own_disturbances"
    ground = own_disturbances_on_gpu.GROUND if disturbed else mission(EVENTS[0])
    return missions_on_gpu.CudaMissions(2, ground, **OWN[request.param])


class OnDevice:
    """An array as CUDA's are, with an address that no program here may read."""

    def __init__(self, array):
        self.shape, self.size, self.dtype = array.shape, array.size, array.dtype
        self.strides = array.strides
        self._numba_type_ = typeof(array)
        self.__cuda_array_interface__ = {"data": (array.ctypes.data, False)}


def there(arrays):
    """The same named tuple, of arrays on a device."""
    return arrays._make(map(there, arrays)) if isinstance(arrays, tuple) else OnDevice(arrays)


def test_arrays_on_a_gpu_are_handed_over_by_where_they_lie_there():
    state = STATE.zeros(dict.fromkeys(STATE.names, 2))
    handover = Handover(lambda: state)
    here = handover.numbers_of(state).tolist()
    assert state.x.ctypes.data in here
    assert handover.numbers_of(there(state)).tolist() == here


def test_numba_finds_the_types_of_all_that_the_step_calls(missions):
    # on the simulated GPU it runs as Python, which asks for none
    for launch in missions.launches:
        part = getclosurevars(launch.kernel.py_func).nonlocals["part"]
        part.compile((typeof(missions.numbers), types.int64))


def test_the_step_compiles_for_a_gpu(compiler, missions):
    from numba.cuda import compile_ptx

    for launch in missions.launches:
        arguments = (typeof(missions.numbers),)
        code, _ = compile_ptx(launch.kernel.py_func, arguments, cc=COMPUTE_CAPABILITY)
        assert ".visible .entry" in code
        assert ".extern .func" not in code  # all that is called is there
