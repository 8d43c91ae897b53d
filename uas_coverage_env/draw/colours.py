"""The colours of all that is drawn: pictures, figures, replay pages and reports of exports.

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

MODES: dict[str, Colour] = {
    "covering": BLUE,
    "transit": ORANGE,
    "return": (217, 154, 192),
    "landed": (185, 185, 180),
    "lost": RED,
}
"""What UAS are doing, by the names of `flight.MODES`."""

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


def of_uas(i: int) -> Colour:
    """That of the i-th UAS."""
    return UAS[i % len(UAS)]


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


def mixed(colour: Colour, towards: int, share: float) -> Colour:
    """The colour by a share nearer to black (0) or white (255)."""
    red, green, blue = (int(part + share * (towards - part) + 0.5) for part in colour)
    return red, green, blue


def on_dark_line(colour: Colour) -> Colour:
    """That of a line or mark on a dark ground: lighter (`bright` of the viewer's palette.ts)."""
    return mixed(colour, 255, 0.65 if sum(colour) < 200 else 0.3)


def on_dark_area(colour: Colour) -> Colour:
    """That of a large area on a dark ground: darker (`dim` of the viewer's palette.ts)."""
    return mixed(colour, 0, 0.3)


def hex_of(colour: Colour) -> str:
    """As pages write it: #rrggbb."""
    return "#" + "".join(f"{part:02x}" for part in colour)


def _on_both(**colours: Colour) -> dict[str, tuple[Colour, Colour]]:
    """Properties that are the same on light and dark pages."""
    return {name.replace("_", "-"): (colour, colour) for name, colour in colours.items()}


PAGES: dict[str, tuple[Colour, Colour]] = {
    "paper": (PAPER, (19, 22, 24)),
    "panel": (WHITE, (27, 31, 33)),
    "edge": ((217, 216, 208), (54, 60, 63)),
    "ink": (INK, (233, 233, 228)),
    "faint": ((100, 103, 107), (162, 168, 170)),
    "halo": (WHITE, (16, 19, 20)),
    "accent": (BLUE, SKY),
    "outside": ((221, 225, 212), (24, 28, 29)),
    "ground": (GROUND, (38, 43, 43)),
    "grid": ((198, 202, 185), (71, 80, 81)),
    "fence": (INK, (201, 204, 200)),
    "open": (INK, (211, 214, 210)),
    "covered": (COVERED, (61, 154, 96)),
    "covered-edge": (COVERED_EDGE, (134, 223, 165)),
    "charged": (GREEN, (32, 196, 148)),
    "half": ((232, 192, 32), (240, 208, 64)),
    "discharged": (RED, (255, 90, 95)),
    "landed": (MODES["landed"], (139, 143, 143)),
    **_on_both(
        covering=MODES["covering"],
        transit=MODES["transit"],
        returning=MODES["return"],
        alert=RED,
        button=BLUE,
        breach=(224, 123, 0),
        fallback=PURPLE,
        progress=GREEN,
        effort=PURPLE,
        near_obstacles=(140, 86, 75),
        near_moving=RED,
        near_others=BLUE,
        near_fence=(127, 127, 127),
        near_height=(184, 134, 11),
    ),
    **{
        name: (tint, on_dark_area(tint))
        for name, tint in (
            ("obstacle", OTHER_OBSTACLE),
            ("no-fly", OBSTACLES["no_fly"]),
            ("street", DECORATIONS["street"]),
            ("search", OTHER_DECORATION),
        )
    },
    **{f"uas-{n}": (colour, on_dark_line(colour)) for n, colour in enumerate(UAS)},
}
"""Custom properties of pages -> their colour on light and on dark ones."""


def page_style() -> str:
    """The custom properties of `PAGES` as CSS, on pages light and dark, printed light."""
    light, dark = (
        "".join(f"--{name}:{hex_of(both[k])};" for name, both in PAGES.items()) for k in (0, 1)
    )
    return (
        f":root{{color-scheme:light dark;{light}}}\n"
        f"@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}\n"
    )
