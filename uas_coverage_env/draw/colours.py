"""Colours of the pictures.

What has to be told apart is told apart by shape or length as well, and the strong colours are those
of Okabe and Ito, which stay distinct for colour-blind eyes.
"""

Colour = tuple[int, int, int]

PAPER: Colour = (250, 249, 245)
GROUND: Colour = (234, 235, 224)
GRID: Colour = (221, 223, 210)
INK: Colour = (38, 40, 44)
FAINT: Colour = (120, 122, 124)
WHITE: Colour = (255, 255, 255)

BLUE: Colour = (0, 114, 178)
VERMILLION: Colour = (213, 94, 0)
GREEN: Colour = (0, 158, 115)
YELLOW: Colour = (240, 205, 40)
RED: Colour = (200, 30, 45)
PURPLE: Colour = (170, 75, 140)
ORANGE: Colour = (230, 159, 0)
SKY: Colour = (86, 180, 233)

UAS: tuple[Colour, ...] = (BLUE, VERMILLION, PURPLE, GREEN, ORANGE, SKY, INK)
"""Paths and marks of the UAS, in their order; repeated in larger swarms."""

COVERED: Colour = (112, 190, 134)
COVERED_EDGE: Colour = (24, 116, 72)

OBSTACLES: dict[str, Colour] = {
    "forest": (134, 168, 120),
    "residential": (209, 178, 138),
    "high_rise": (163, 141, 126),
    "church": (190, 122, 100),
    "terrain": (203, 193, 158),
    "no_fly": (232, 170, 160),
    "outside_fence": (214, 190, 190),
}
OTHER_OBSTACLE: Colour = (168, 168, 164)

DECORATIONS: dict[str, Colour] = {
    "water": (166, 206, 232),
    "pad": (208, 208, 204),
    "street": (208, 208, 204),
}
OTHER_DECORATION: Colour = (222, 216, 200)

SEEN: tuple[Colour, ...] = (SKY, ORANGE, PURPLE, YELLOW)
"""Ground that cameras have seen, a tint for each kind of camera."""


def shaded(colour: Colour, factor: float) -> Colour:
    """The colour darkened (factor < 1) or lightened, within what a byte can hold."""
    red, green, blue = (min(255, max(0, round(part * factor))) for part in colour)
    return red, green, blue


def of_words(colour: Colour) -> Colour:
    """Of words about what has this colour: so dark that they are read on white (WCAG AA)."""
    return shaded(colour, 0.62)


def of_obstacle(kind: str | None) -> Colour:
    """The tint of an obstacle."""
    return OBSTACLES.get(kind or "", OTHER_OBSTACLE)


def of_decoration(kind: str | None) -> Colour:
    """The tint of what lies on the ground and is no obstacle."""
    return DECORATIONS.get(kind or "", OTHER_DECORATION)


def of_charge(soc: float) -> Colour:
    """Green, yellow or red for a charged, half-charged or discharged battery (the paper's Fig.)."""
    if soc > 0.6:
        return GREEN
    return YELLOW if soc > 0.35 else RED
