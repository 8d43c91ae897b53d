"""Tables of pages on what readers make of files: roles, words, plans, kinds of a town."""

from uas_coverage_env.operations.area_import.feature_roles import ROLES, SOLID_WORDS, UNSAID
from uas_coverage_env.operations.area_import.osm_tags import (
    BUILDING,
    GUESSED_M,
    GUESSED_OTHER_M,
    LOW,
    MET_TALL,
    STANDING,
)
from uas_coverage_env.operations.area_import.readers.qgc_plan import ITEMS
from uas_coverage_env.operations.tables import Table


def area_roles() -> Table:
    """What a drawing may say of a thing, and what becomes of it by its shape."""
    rows = []
    for role, row in (*ROLES.items(), ("", UNSAID)):
        spellings = ", ".join(f"`{one}`" for one in row.spellings)
        rows.append(
            (
                f"`{role}`" if role else "nothing says it",
                (row.meaning if role else "")
                + (f". Also written {spellings}" if spellings else ""),
                row.polygon,
                "left out" if not role else row.polygon,
                row.line,
                row.point,
            )
        )
    head = ("`role`", "meaning", "polygon", "closed line", "open line", "point")
    return (head, rows)


def area_words() -> Table:
    """The words in names and folders that say a role."""
    rows = [(f"`{role}`", ", ".join(row.words)) for role, row in ROLES.items() if row.words]
    rows.insert(2, ("`obstacle`", ", ".join(SOLID_WORDS)))
    return (("role", "words"), rows)


def plan_items() -> Table:
    """What becomes of what a QGroundControl plan holds."""
    rows = [(f"`{kind}`", item.becomes) for kind, item in ITEMS.items()]
    return (("item of the mission", "becomes"), rows)


def town_kinds() -> Table:
    """What is an obstacle of a town, how high and how wide where no tag says it."""
    found: dict[tuple[str, float, float, bool], list[str]] = {}
    for (key, value), what in STANDING.items():
        tag = f"`{key}={value}`" if value != "*" else f"any other `{key}`"
        found.setdefault(tuple(what), []).append(tag)
    rows = [
        (
            ", ".join(tags),
            f"`{kind}`",
            f"{height_m:g}",
            f"{half_m:g}" if half_m else "its outline alone",
            "along its line" if along else "",
        )
        for (kind, half_m, height_m, along), tags in found.items()
    ]
    for height_m in sorted(set(GUESSED_M.values())):
        tags = (f"`building={value}`" for value, high in GUESSED_M.items() if high == height_m)
        rows.append((", ".join(tags), f"`{BUILDING}`", f"{height_m:g}", "10", ""))
    rows.append(
        ("any other `building`, `building:part`", f"`{BUILDING}`", f"{GUESSED_OTHER_M:g}", "10", "")
    )
    head = ("tag", "obstacle", "height, m", "half the width of a line, radius of a point, m", "")
    return (head, rows)


def town_not_read() -> Table:
    """Tall kinds that are named and not read, and low values of keys that are mostly tall."""
    met = ", ".join(f"`{key}={value}` ({high})" for (key, value), high in MET_TALL.items())
    rows = [
        ("tall, named, and no obstacles unless a height is tagged", met),
        ("the same", f"values of {', '.join(f'`{key}`' for key in LOW)} that no table lists"),
    ]
    for key, values in LOW.items():
        rows.append((f"`{key}`, taken to be low", ", ".join(f"`{value}`" for value in values)))
    return ("what is not read", "tags"), rows
