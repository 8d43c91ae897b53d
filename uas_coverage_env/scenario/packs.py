"""How often UAS may take off with a fresh battery: `[sorties]`."""

from typing import Annotated

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel


class Sorties(StrictModel):
    """Battery packs of each UAS: one for each flight; `--sorties` of `run` flies with all.

    Attributes:
        packs: How many each UAS has, that of its first take-off included.
        swap_s: From the landing of the last UAS to the next take-off, with fresh packs [s].
    """

    packs: Annotated[int, Field(ge=1, le=1_000)]
    swap_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 0.0
