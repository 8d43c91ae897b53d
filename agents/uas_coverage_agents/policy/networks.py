"""The networks that a policy may consist of: each a small record that can be run in NumPy."""

from typing import Annotated

from pydantic import Field

from uas_coverage_agents.policy.attention import Attention
from uas_coverage_agents.policy.mlp import Mlp
from uas_coverage_agents.policy.pointer import Pointer
from uas_coverage_agents.policy.route_networks import RouteNetworks

Network = Annotated[Attention | Mlp | Pointer | RouteNetworks, Field(discriminator="kind")]
"""Any network; several kinds are told apart by `kind`."""
