"""How often UAS may take off with a fresh battery: `[sorties]`."""

from typing import Annotated, Any

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer

from uas_coverage_env.files.strict_toml import StrictModel


class Sorties(StrictModel):
    """Battery packs of each UAS: one for each flight.

    Attributes:
        packs: How many each UAS has, that of its first take-off included.
        swap_s: From the landing of the last UAS (of each, where not together) to the next take-off,
            with fresh packs [s].
        together: Whether all UAS land, swap and take off together, in flights one after the other
            (`--sorties` of `run`); otherwise each swaps on its own while the others fly on, in one
            flight.
    """

    packs: Annotated[int, Field(ge=1, le=1_000)]
    swap_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 0.0
    together: bool = True

    @model_serializer(mode="wrap")
    def _without_the_default(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # files are those of scenarios before the field
        data = serialise(self)
        if self.together:
            data.pop("together", None)
        return data
