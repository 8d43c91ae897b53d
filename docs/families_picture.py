"""Draw the picture of the families of scenarios: python docs/families_picture.py."""

from pathlib import Path

import numpy as np
from PIL import Image

from uas_coverage_env.draw import picture
from uas_coverage_env.scenario.families import BUILT_IN, Family
from uas_coverage_env.simulation import World

PICTURE = Path(__file__).parent / "pictures" / "families.png"
TILE_PX, COLUMNS, SEED = 400, 4, 2


def main() -> None:
    """Draw a mission of each family."""
    tiles = []
    sized = (family for family in BUILT_IN.values() if isinstance(family, Family))
    for family in sized:
        scenario = family.sized(n_uas=(3, 3), n_waypoints=(24, 24)).of_seed(SEED)
        tiles.append(picture(scenario, World(scenario).swarm_state(), size_px=TILE_PX))
    rows = [np.hstack(tiles[k : k + COLUMNS]) for k in range(0, len(tiles), COLUMNS)]
    image = Image.fromarray(np.vstack(rows)).quantize(128)
    image.save(PICTURE, optimize=True)


if __name__ == "__main__":
    main()
