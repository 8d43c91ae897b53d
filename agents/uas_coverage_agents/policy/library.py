"""A network that the library flies which trained it; it needs the extra `learn`."""

from typing import Annotated, Any, Literal

from pydantic import Field, JsonValue

from uas_coverage_env.files.strict_toml import StrictModel

_Count = Annotated[int, Field(ge=0, le=100_000)]
_Shape = tuple[Annotated[int, Field(ge=0, le=10_000_000)], ...]


class Library(StrictModel):
    """What is needed to make it again; the settings of its training say which class it is of.

    Attributes:
        kind: "library".
        inputs: Numbers of the observation of one UAS.
        tensors: Name -> shape.
        room: UAS, waypoints and moving obstacles that the environments had room for.
        environment: Keyword arguments of the environments.
    """

    kind: Literal["library"] = "library"
    inputs: Annotated[int, Field(ge=1, le=10_000_000)]
    tensors: Annotated[dict[str, _Shape], Field(max_length=10_000)]
    room: tuple[_Count, _Count, _Count]
    environment: dict[str, JsonValue]

    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Name -> shape of every tensor."""
        return dict(self.tensors)

    def forward(self, tensors: Any, inputs: Any) -> Any:
        """It has none in NumPy.

        Raises:
            TypeError: Always.
        """
        raise TypeError("a network of a library is flown by the library")
