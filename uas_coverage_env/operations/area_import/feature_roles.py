"""The one table that decides what a feature of a file means: its role, and what becomes of it.

All readers use it. The attribute `role`, then name, kind and height, then the folders that a
feature lies in say what it is; what says nothing is an area to search, a take-off place or left
out, by its shape.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from typing import Literal, NamedTuple

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.geo_features import GeoFeature, Shape
from uas_coverage_env.operations.area_import.length_texts import length_m
from uas_coverage_env.operations.area_import.osm_tags import (
    BUILDING,
    GUESSED_OTHER_M,
    OTHER,
    STANDING,
    Tagged,
    standing_of,
)

Role = Literal["no_fly", "fence", "obstacle", "home", "search", "ignore"]
Becomes = Literal["area", "zone", "fence", "obstacle", "take-off place", "left out", "refused"]


class Row(NamedTuple):
    """A role.

    Attributes:
        meaning: For pages.
        spellings: Of the attribute `role`, besides its name; `-` and spaces are read as `_`.
        words: In a name or folder, as whole words, with or without spaces and a plural's s; `*`
            stands for the rest of a word.
        polygon: What becomes of polygons and closed lines.
        line: Of open lines.
        point: Of points.
        nothing: Of what has the role but no place.
    """

    meaning: str
    spellings: tuple[str, ...]
    words: tuple[str, ...]
    polygon: Becomes
    line: Becomes
    point: Becomes
    nothing: Becomes


FLIGHT_WORDS = (
    *("no fly", "no fly zone", "no fly area", "nfz", "no flying", "no flight", "no flight zone"),
    *("no drone", "no drone zone", "no uas", "no uav", "no overflight", "non flying"),
    *("do not fly", "don't fly", "never fly", "fly ban", "flight ban", "drone ban"),
    *("flight prohibited", "flying prohibited", "flight forbidden", "flying forbidden"),
    *("flugverbot*", "überflugverbot*", "survol interdit*", "vol interdit*", "vuelo prohibido"),
)
"""Of no-fly zones; on a map, where names are those of shops and streets, only these count."""

ROLES: Mapping[Role, Row] = {
    "no_fly": Row(
        "no UAS flies there, at any height; it may lie inside an area",
        ("nofly", "no_fly_zone", "nfz", "keep_out", "exclusion"),
        (
            *FLIGHT_WORDS,
            *("keep out", "keep away", "keep clear", "stay out", "stay away", "stay clear"),
            *("do not enter", "avoid", "exclusion", "exclude", "excluded", "restricted"),
            *("restriction", "prohibited", "prohibition", "forbidden", "danger", "sperr*"),
            *("zone interdite", "zona prohibida"),
        ),
        "zone",
        "refused",
        "refused",
        "refused",
    ),
    "fence": Row(
        "no UAS leaves it, nor any of several; it need not be convex. Without one, the fence runs "
        "25 m around areas and take-off places",
        ("geofence", "keep_in", "stay_in", "inclusion"),
        ("fence", "geo fence", "keep in", "keep inside", "stay in", "stay inside", "stay within"),
        "fence",
        "refused",
        "refused",
        "refused",
    ),
    "obstacle": Row(
        "something solid, from the ground to its height (below)",
        (),  # and the words of `SOLID_WORDS`
        (),
        "obstacle",
        "obstacle",
        "obstacle",
        "refused",
    ),
    "home": Row(
        "a UAS takes off and lands there",
        ("takeoff", "launch", "landing", "start"),
        ("home", "take off", "launch", "landing", "start", "pad", "heli pad"),
        "refused",
        "refused",
        "take-off place",
        "left out",
    ),
    "search": Row(
        "it is covered, except its holes. Its waypoints have its `weight` (default 1); where two "
        "areas overlap, the larger weight counts",
        ("survey", "area"),
        ("search", "survey", "aoi", "area of interest", "area"),
        "area",
        "refused",
        "refused",
        "left out",
    ),
    "ignore": Row(
        "it is passed over",
        ("none", "label", "note"),
        (
            *("gcp", "ground control", "ground control point", "check point", "tie point"),
            *("label", "note", "photo", "picture", "image", "way point", "marker"),
        ),
        "left out",
        "left out",
        "left out",
        "left out",
    ),
}
"""What a role means, and what becomes of what has it."""

UNSAID = Row("(nothing says it)", (), (), "area", "left out", "take-off place", "left out")
"""What says nothing; of lines, closed ones too are left out."""

_BUILDING = Tagged(BUILDING, 10.0, GUESSED_OTHER_M)
SOLID_WORDS: Mapping[str, Tagged] = {
    "wind turbine": STANDING["generator:source", "wind"],
    "wind mill": STANDING["generator:source", "wind"],
    "water tower": STANDING["man_made", "water_tower"],
    "cooling tower": STANDING["man_made", "cooling_tower"],
    "communications tower": STANDING["man_made", "communications_tower"],
    "communication tower": STANDING["man_made", "communications_tower"],
    "radio tower": STANDING["man_made", "communications_tower"],
    "tv tower": STANDING["man_made", "communications_tower"],
    "light house": STANDING["man_made", "lighthouse"],
    "tower": STANDING["man_made", "tower"],
    "mast": STANDING["man_made", "mast"],
    "antenna": STANDING["man_made", "antenna"],
    "chimney": STANDING["man_made", "chimney"],
    "smoke stack": STANDING["man_made", "chimney"],
    "crane": STANDING["man_made", "crane"],
    "silo": STANDING["man_made", "silo"],
    "storage tank": STANDING["man_made", "storage_tank"],
    "flag pole": STANDING["man_made", "flagpole"],
    "pylon": STANDING["power", "tower"],
    "power line": STANDING["power", "line"],
    "transmission line": STANDING["power", "line"],
    "overhead line": STANDING["power", "line"],
    "cable car": STANDING["aerialway", "cable_car"],
    "cable way": STANDING["aerialway", "cable_car"],
    "gondola": STANDING["aerialway", "gondola"],
    "ski lift": STANDING["aerialway", "gondola"],
    "building": _BUILDING,
    "high rise": _BUILDING,
    "skyscraper": _BUILDING._replace(guessed_m=300.0),
    "hangar": _BUILDING._replace(half_width_m=40.0, guessed_m=30.0),
    "obstacle": OTHER,
    "obstruction": OTHER,
    "structure": OTHER,
}
"""Words of something solid, in a name or as a role -> what stands there; the first one counts."""

NAMES, KINDS = ("name", "title", "label"), ("kind", "type", "category", "class", "layer", "status")
"""Attributes of which the words count."""

_FIRM = ("no_fly", "fence", "obstacle")


class Meaning(NamedTuple):
    """What a feature means.

    Attributes:
        role: None: nothing says it.
        becomes: What becomes of it.
        said_by: What says so: `the name 'NFZ 2'`; empty: nothing does.
        solid: What stands there, of an obstacle.
        sure: Whether it is more than a word in a name that makes an obstacle of it.
        against: What says otherwise, where a role was given against it.
    """

    role: Role | None
    becomes: Becomes
    said_by: str = ""
    solid: Tagged | None = None
    sure: bool = True
    against: str = ""


def meaning_of(feature: GeoFeature, shape: Shape, *, on_map: bool = False) -> Meaning:
    """What a feature means.

    Args:
        feature: As a reader hands it on.
        shape: That of its part.
        on_map: It is from a map of what stands there (`--town`), where names are those of shops
            and streets: they tell no-fly zones alone, and only by words of flying.

    Raises:
        InputError: Its role is unknown, or its name says several that contradict each other.
    """
    given = feature.attributes.get("role")
    if given is None or (on_map and not _known(str(given))):
        told = _told(feature, shape, on_map=on_map)
        return told or Meaning(None, getattr(UNSAID, shape.replace("closed ", "")))
    text = str(given)
    role, solid = _given(feature, text)
    found = _meaning(role, shape, "the role", text, solid)
    if role not in _FIRM:
        told = _told(feature, shape, on_map=on_map)
        if told is not None and told.role in _FIRM:
            return found._replace(against=told.said_by)
    elif role == "obstacle" and solid in (None, OTHER):
        kind = _standing(feature, shape)
        word = next(chain.from_iterable(map(_solids, _texts(feature, NAMES))), OTHER)
        return found._replace(solid=kind.solid if kind and kind.solid != OTHER else word)
    return found


def _told(feature: GeoFeature, shape: Shape, *, on_map: bool) -> Meaning | None:
    """What name, kind, height and folders say; None: nothing."""
    names, kinds = _texts(feature, NAMES), _texts(feature, KINDS)
    if on_map:
        flying = (text for text in (*names, *kinds) if speaks_of_flying(text))
        found = [_meaning("no_fly", shape, "the name", text) for text in flying]
        return next(iter(found), None) or _plainly(feature, shape) or _standing(feature, shape)
    said = [_worded(feature, text, shape, "the name") for text in names]
    said += [_worded(feature, text, shape, "the kind", sure=True) for text in kinds]
    told = [each for each in said if each is not None]
    for each in told:
        if each.role not in ("obstacle", "search"):
            return each
    plainly = _plainly(feature, shape)
    if plainly is not None:
        return plainly
    standing, words = _standing(feature, shape), [each for each in told if each.role == "obstacle"]
    if words and (standing is None or standing.solid == OTHER):
        return words[0]._replace(sure=words[0].sure or standing is not None)
    if standing is not None:
        return standing
    if told:  # it is called an area to search, or is the label of one
        return None if shape == "polygon" else Meaning(None, "left out", told[0].said_by)
    folders = [_worded(feature, text, shape, "the folder", only=False) for text in feature.folders]
    layers = [_layer(text, shape) for text in feature.layers]
    within = next((each for each in (*folders, *layers) if each is not None), None)
    return None if within is None or within.role == "search" else within


def _plainly(feature: GeoFeature, shape: Shape) -> Meaning | None:
    """What any attribute says that is nothing but no-fly: `remark = "NFZ"`, `no_fly = true`."""
    for key, value in feature.attributes.items():
        words = _ALONE["no_fly"] if key == "description" else _FLYING
        if isinstance(value, str) and words.fullmatch(_plain(value[:200])):
            return _meaning("no_fly", shape, f"its {key}", value)
        if _FLYING.fullmatch(_plain(key)) and str(value).strip().lower() not in _NO:
            return _meaning("no_fly", shape, f"its {key}", str(value))
    return None


def _worded(
    feature: GeoFeature,
    text: str,
    shape: Shape,
    where: str,
    *,
    only: bool = True,
    sure: bool = False,
) -> Meaning | None:
    """What the words of a name or folder say; only: several that contradict each other may not."""
    plain = _plain(text)
    found = [role for role, words in _WORDS.items() if words.search(plain) and _counts(role, shape)]
    solid = next(_solids(text), None)
    if "no_fly" in found:
        if not only and _SURVEY.search(plain):  # "Survey with no-fly zones": which are meant?
            raise InputError(
                f"{feature.source}: {where} {text[:40]!r} says no_fly and search; name it itself, "
                f"or give it a role"
            )
        return _meaning("no_fly", shape, where, text)
    for weak in ("search", "ignore"):
        if len(found) > 1 and weak in found:
            found.remove(weak)
    if solid is not None and found != ["ignore"]:  # a picture of a tower is none
        found.append("obstacle")
    if len(found) > 1:
        if only and "role" not in feature.attributes:
            raise InputError(
                f"{feature.source}: its name says {' and '.join(found)}; give it one of the roles "
                f"{', '.join(ROLES)}"
            )
        return None
    if not found:
        return None
    return _meaning(found[0], shape, where, text, solid)._replace(sure=sure)


def _layer(text: str, shape: Shape) -> Meaning | None:
    """What the name of a file or layer says that is nothing but a role: `no_fly`, `buildings`."""
    for role, words in _ALONE.items():
        if words.fullmatch(_plain(text)) and _counts(role, shape):
            solid = next(_solids(text), None) if role == "obstacle" else None
            return _meaning(role, shape, "the layer", text, solid)._replace(sure=False)
    return None


def _standing(feature: GeoFeature, shape: Shape) -> Meaning | None:
    """What tags of a kind or a height say."""
    tags = {k: v for k, v in feature.attributes.items() if k != "height_m"}
    solid = standing_of(tags)
    if solid is None and math.isnan(length_m(tags.get("height", 0.0))):
        solid = OTHER  # that its height cannot be read is said where it is missed
    if solid is None:
        return None
    said = f"its height {str(tags.get('height'))[:40]!r}" if solid == OTHER else "its kind"
    return Meaning("obstacle", _becomes("obstacle", shape), said, solid)


def speaks_of_flying(text: str) -> bool:
    """Whether a name on a map is that of a no-fly zone."""
    return bool(_FLIGHT.search(_plain(text)))


def _given(feature: GeoFeature, text: str) -> tuple[Role, Tagged | None]:
    """The role that an attribute gives, and what stands there."""
    known = _known(text)
    if known is None:
        raise InputError(f"{feature.source}: unknown role {text[:40]!r}; take {', '.join(ROLES)}")
    return known


def _known(text: str) -> tuple[Role, Tagged | None] | None:
    plain = _plain(text)
    for role, row in ROLES.items():
        if plain.replace(" ", "_") in (role, *row.spellings):
            return role, None
    found = [role for role, words in _WORDS.items() if words.search(plain)]
    solid = next(_solids(text), None)
    if "no_fly" in found or (len(found) == 1 and solid is None):
        return found[0], None
    return ("obstacle", solid) if solid is not None and not found else None


def _texts(feature: GeoFeature, keys: tuple[str, ...]) -> list[str]:
    return [str(feature.attributes[key]) for key in keys if key in feature.attributes]


def _counts(role: Role, shape: Shape) -> bool:
    """Whether words of a role say anything of such a shape: an area may be called `home`."""
    return role not in ("home", "ignore") or shape in ("point", "nothing")


def _meaning(
    role: Role, shape: Shape, where: str, text: str, solid: Tagged | None = None
) -> Meaning:
    said = f"{where} {' '.join(text.split())[:40]!r}"
    return Meaning(role, _becomes(role, shape), said, solid)


def _becomes(role: Role, shape: Shape) -> Becomes:
    return getattr(ROLES[role], "polygon" if shape == "closed line" else shape)


def _solids(text: str) -> Iterator[Tagged]:
    plain = _plain(text)
    return (what for words, what in _SOLIDS if words.search(plain))


def _plain(text: str) -> str:
    """Small letters, with spaces between words however they are joined: `NoFly_zone-2`."""
    spaced = re.sub(r"(?<=[a-zäöüß])(?=[A-Z])", " ", text)
    return " ".join(re.sub(r"[\s_\-‐-―./:,;()\[\]#&+|]+", " ", spaced).lower().split())


def _any_of(words: Iterable[str]) -> str:
    plain = (re.escape(word).replace(r"\ ", " ?").replace(r"\*", r"\w*") for word in words)
    return f"(?:{'|'.join(plain)})s?"


def _whole(words: Iterable[str]) -> re.Pattern[str]:
    return re.compile(rf"(?<![^\W\d_]){_any_of(words)}(?![^\W\d_])")


_WORDS = {role: _whole(row.words) for role, row in ROLES.items() if row.words}
_FLIGHT = _whole(FLIGHT_WORDS)
_SURVEY = _whole(("survey", "search"))
_SOLIDS = [(_whole([word]), what) for word, what in SOLID_WORDS.items()]
_AFTER = r"(?: ?(?:zones?|areas?|layers?|\d+))*"
_FLYING = re.compile(_any_of(FLIGHT_WORDS) + _AFTER)
_ALONE: Mapping[Role, re.Pattern[str]] = {
    role: re.compile(_any_of((*row.words, *words)) + _AFTER)
    for role, row in ROLES.items()
    for words in [tuple(SOLID_WORDS) if role == "obstacle" else ()]
    if role != "search"
}
_NO = ("no", "false", "0", "f", "n", "none")
