"""What every kind of network is made of."""

from collections.abc import Mapping
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

Tensors = Mapping[str, NDArray[np.float64]]
"""Weights by name."""

Width = Annotated[int, Field(ge=1, le=4096)]
"""Of a layer. Bounded, as the number of layers and the weights are: no sum can overflow."""

LARGEST_WEIGHT = 1e6
"""No weight of a policy is larger."""
