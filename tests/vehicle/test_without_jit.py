"""The kernels say the same when numba does not compile them."""

import json
import os
import subprocess
import sys

import every_kernel
import numpy as np


def test_every_kernel_gives_the_same_without_compilation():
    result = subprocess.run(
        [sys.executable, every_kernel.__file__],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    interpreted, compiled = np.array(json.loads(result.stdout)), np.array(every_kernel.numbers())
    assert compiled.shape == (14, 2 + 14 + 5 + 2)
    assert np.isfinite(compiled).all()
    np.testing.assert_allclose(interpreted, compiled, rtol=1e-9, atol=1e-9)
