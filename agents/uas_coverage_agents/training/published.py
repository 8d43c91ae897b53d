"""The configurations that come with the package, by name."""

from pathlib import Path

PUBLISHED = Path(__file__).parents[1] / "configs"


def published_names() -> tuple[str, ...]:
    """Names of the configurations that come with the package."""
    return tuple(sorted(path.stem for path in PUBLISHED.glob("*.toml")))
