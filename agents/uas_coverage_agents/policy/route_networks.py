"""The networks of a policy that plans routes: three small ones in one file."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.mlp import Mlp
from uas_coverage_agents.policy.tensors import Tensors
from uas_coverage_env.files.strict_toml import StrictModel


class RouteNetworks(StrictModel):
    """Scores of a waypoint and of going home, and how long a flight takes.

    Attributes:
        kind: "routes".
        order: Reads the numbers of one waypoint that may come next.
        home: Reads those of going home.
        flight: Reads a state and the next three places.
    """

    kind: Literal["routes"] = "routes"
    order: Mlp
    home: Mlp
    flight: Mlp

    @property
    def inputs(self) -> int:
        """Of all three, one after the other."""
        return self.order.inputs + self.home.inputs + self.flight.inputs

    @property
    def outputs(self) -> int:
        """Likewise."""
        return self.order.outputs + self.home.outputs + self.flight.outputs

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor, each after the name of its network."""
        return {
            f"{part}.{name}": shape
            for part, network in self._parts().items()
            for name, shape in network.shapes().items()
        }

    def forward(self, tensors: Tensors, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run all three.

        Args:
            tensors: Those of `shapes`.
            inputs: (..., inputs).

        Returns:
            (..., outputs).
        """
        outputs, at = [], 0
        for part, network in self._parts().items():
            own = {name: tensors[f"{part}.{name}"] for name in network.shapes()}
            outputs.append(network.forward(own, inputs[..., at : at + network.inputs]))
            at += network.inputs
        return np.concatenate(outputs, axis=-1)

    def _parts(self) -> dict[str, Mlp]:
        return {"order": self.order, "home": self.home, "flight": self.flight}
