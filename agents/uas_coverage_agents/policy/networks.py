"""The networks that a policy may consist of: each a small record."""

from typing import Annotated

from pydantic import Field

from uas_coverage_agents.policy.actor import Actor
from uas_coverage_agents.policy.library import Library
from uas_coverage_agents.policy.mlp import Mlp
from uas_coverage_agents.policy.route_networks import RouteNetworks

Network = Annotated[Actor | Library | Mlp | RouteNetworks, Field(discriminator="kind")]
"""Any network; several kinds are told apart by `kind`. All but `Library` can be run in NumPy."""
