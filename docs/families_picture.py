"""Draw the picture of the families of scenarios: python docs/gallery.py families.png.

`families_table` is the table under it.
"""

import inspect
from pathlib import Path

import numpy as np
from PIL import Image

from uas_coverage_env.draw import picture
from uas_coverage_env.scenario.families import BUILT_IN, Family
from uas_coverage_env.simulation import World

PICTURE = Path(__file__).parent / "pictures" / "families.png"
TILE_PX, COLUMNS, SEED = 400, 5, 2


SIZED = {name: family for name, family in BUILT_IN.items() if isinstance(family, Family)}
"""Those that take a size."""


def families_table() -> str:
    """The difficulty of each family, from the first line of its file."""
    lines = ["| family | its difficulty |", "| --- | --- |"]
    for name, family in SIZED.items():
        module = inspect.getmodule(family.draw)
        says = (module.__doc__ or "") if module else ""
        lines.append(f"| `{name}` | {says.splitlines()[0].partition(': ')[2].removesuffix('.')} |")
    return "\n".join(lines)


def main() -> None:
    """Draw a mission of each family."""
    tiles = []
    for family in SIZED.values():
        scenario = family.sized(n_uas=(3, 3), n_waypoints=(24, 24)).of_seed(SEED)
        tiles.append(picture(scenario, World(scenario).swarm_state(), size_px=TILE_PX))
    tiles += [np.full_like(tiles[0], 255)] * (-len(tiles) % COLUMNS)
    rows = [np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)]
    image = Image.fromarray(np.vstack(rows)).quantize(128)
    image.save(PICTURE, optimize=True)
