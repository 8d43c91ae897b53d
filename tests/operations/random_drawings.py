"""Random drawings of zones, structures and harmless things, and files of each format of them."""

import json
import zipfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapefile
from hypothesis import strategies as st

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations import ImportOptions, LocalFrame, make_scenario, read_drawings

WEST, SOUTH, WIDE, HIGH = 8.0, 50.0, 0.004, 0.003
HALF_X, HALF_Y = 0.0003, 0.0002  # of a thing
CELLS = [
    (WEST + WIDE * (c + 1) / 4, SOUTH + HIGH * (r + 1) / 4) for c in range(3) for r in range(3)
]
AREA = [[8.0, 50.0], [8.004, 50.0], [8.004, 50.003], [8.0, 50.003], [8.0, 50.0]]
HOME = (49.9995, 7.9995)
WGS_84 = (
    'GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],'
    'PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]'
)

ROLES = ["no_fly", "nofly", "no-fly", "NFZ", "No Fly Zone", "keep_out", "exclusion", "restricted"]
NAMES = ["no fly", "no fly zone", "nfz", "keep out", "restricted", "prohibited", "do not enter"]
TALL = {  # a tag of a kind -> its least height, where no tag says it
    ("man_made", "chimney"): 100.0,
    ("man_made", "communications_tower"): 250.0,
    ("man_made", "storage_tank"): 30.0,
    ("power", "tower"): 60.0,
    ("generator:source", "wind"): 250.0,
    ("aerialway", "pylon"): 60.0,
    ("building", "church"): 35.0,
    ("building:part", "yes"): 10.0,
    ("man_made", "not_in_the_table"): None,
}


@dataclass(frozen=True)
class Thing:
    """A thing that is drawn.

    Attributes:
        means: `zone`, `solid` or `harmless`.
        shape: Of its geometry.
        cell: Where it is.
        attributes: What the file says of it.
        folder: In which it lies.
        deep: In how many more folders, or collections, within that.
        height_m: Up to which it is solid; of a zone, any.
    """

    means: str
    shape: str
    cell: int
    attributes: dict
    folder: str = ""
    deep: int = 0
    height_m: float = 0.0

    @property
    def middle(self):
        return CELLS[self.cell]

    def ring(self, west=-1.0, east=1.0):
        x, y = self.middle
        corners = [(west, -1), (east, -1), (east, 1), (west, 1), (west, -1)]
        return [[x + HALF_X * a, y + HALF_Y * b] for a, b in corners]

    def geometry(self):
        """As in GeoJSON."""
        ring = self.ring()
        return {
            "polygon": {"type": "Polygon", "coordinates": [ring]},
            "multi": {
                "type": "MultiPolygon",
                "coordinates": [[self.ring(-1, 0.2)], [self.ring(-0.2, 1)]],
            },
            "collection": {
                "type": "GeometryCollection",
                "geometries": [{"type": "Polygon", "coordinates": [ring]}],
            },
            "closed line": {"type": "LineString", "coordinates": ring},
            "nearly closed line": {
                "type": "LineString",
                "coordinates": [*ring[:-1], [ring[0][0] + 1e-6, ring[0][1]]],
            },
            "line": {"type": "LineString", "coordinates": ring[:3]},
            "point": {"type": "Point", "coordinates": list(self.middle)},
            "empty": None,
        }[self.shape]


@st.composite
def written(draw, texts):
    """A text in any case, its words joined in any way."""
    words = draw(st.sampled_from(texts)).replace("-", " ").replace("_", " ").split()
    text = draw(st.sampled_from([" ", "-", "_", "  "])).join(words)
    return draw(st.sampled_from([str, str.upper, str.title, str.lower]))(text)


@st.composite
def keyed(draw, key):
    return draw(st.sampled_from([str, str.upper, str.title]))(key)


@st.composite
def named(draw, texts):
    """A name with a word of some meaning in it."""
    before = draw(st.sampled_from(["", "Schule ", "2 ", "(", "old school: "]))
    after = draw(st.sampled_from(["", " 1", " Süd", ")", ", hospital"]))
    return before + draw(written(texts)) + after


@st.composite
def zones(draw, cell, folders, shapes):
    shape = draw(st.sampled_from(shapes))
    how = draw(st.sampled_from(["role", "name", *(["folder"] if folders else [])]))
    name = {draw(keyed("name")): f"thing {cell}"}
    if how == "role":
        said = {draw(keyed("role")): draw(written(ROLES)), **name}
    elif how == "name":
        said = {draw(keyed("name")): draw(named(NAMES))}
    else:
        return Thing("zone", shape, cell, name, draw(named(NAMES)), draw(st.integers(0, 3)))
    return Thing("zone", shape, cell, said, deep=draw(st.integers(0, 3)))


@st.composite
def solids(draw, cell, shapes):
    shape = draw(st.sampled_from(shapes))
    height = draw(st.integers(20, 70))
    (key, value), guess = draw(st.sampled_from(list(TALL.items())))
    text = draw(
        st.sampled_from(
            [
                *(f"{height}", f"{height} m", f"{height},0", f"ca. {height} m", f"5;{height}"),
                f"{height / 0.3048:.2f} ft",
                f"{height / 0.3048:.2f}'",
            ]
        )
    )
    said = {draw(keyed(key)): value, draw(keyed("height")): text}
    if draw(st.booleans()) and guess is not None and height:
        said = {key: value}
        height = guess
    elif draw(st.booleans()):
        said = {
            draw(keyed("role")): draw(written(["obstacle", "tower", "building"])),
            "height": text,
        }
    elif draw(st.booleans()):
        said = {"name": draw(named(["tower", "radio mast", "building", "chimney"])), "height": text}
    return Thing("solid", shape, cell, said, deep=draw(st.integers(0, 3)), height_m=height)


@st.composite
def harmless(draw, cell):
    shape = draw(st.sampled_from(["line", "closed line", "empty", "gcp"]))
    name = f"GCP {cell}" if shape == "gcp" else f"path {cell}"
    return Thing("harmless", {"gcp": "point"}.get(shape, shape), cell, {"name": name})


@st.composite
def drawings(draw, folders=False, shapes=None, solid_shapes=None):
    """One to five things in different places."""
    shapes = shapes or [
        *("polygon", "polygon", "multi", "collection", "closed line", "nearly closed line"),
        *("line", "point", "empty"),
    ]
    cells = draw(st.lists(st.sampled_from(range(9)), min_size=1, max_size=5, unique=True))
    things = []
    for cell in cells:
        kind = draw(st.sampled_from(["zone", "solid", "harmless"]))
        if kind == "zone":
            things.append(draw(zones(cell, folders, shapes)))
        elif kind == "solid":
            things.append(draw(solids(cell, solid_shapes or shapes)))
        else:
            things.append(draw(harmless(cell)))
    return things


def collected(things):
    """A collection of GeoJSON; what lies deep is in collections within it."""
    found = [feature_of({"type": "Polygon", "coordinates": [AREA]}, {"name": "field"})]
    for thing in things:
        one = feature_of(thing.geometry(), thing.attributes)
        for _ in range(thing.deep):
            one = {"type": "FeatureCollection", "features": [one]}
        found.append(one)
    point = {"type": "Point", "coordinates": HOME[::-1]}
    found.append(feature_of(point, {"role": "home", "name": "here"}))
    return {"type": "FeatureCollection", "features": found}


def feature_of(geometry, attributes):
    return {"type": "Feature", "properties": attributes, "geometry": geometry}


def write_geojson(things, path="area.geojson"):
    Path(path).write_text(json.dumps(collected(things)), encoding="utf-8")
    return [path]


def kml_of(things):
    marks = [_placemark({"type": "Polygon", "coordinates": [AREA]}, {"name": "field"})]
    for thing in things:
        one = _placemark(thing.geometry(), thing.attributes)
        for _ in range(thing.deep):
            one = f"<Folder><name>more</name>{one}</Folder>"
        one = f"<Folder><name>{thing.folder}</name>{one}</Folder>" if thing.folder else one
        marks.append(one)
    marks.append(_placemark({"type": "Point", "coordinates": HOME[::-1]}, {"role": "home"}))
    return (
        f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{"".join(marks)}</Document></kml>'
    )


def _placemark(geometry, attributes):
    data = dict(attributes)
    name = data.pop("name", "")
    simple = "".join(f'<SimpleData name="{k}">{v}</SimpleData>' for k, v in data.items())
    plain = "".join(f'<Data name="{k}"><value>{v}</value></Data>' for k, v in data.items())
    extended = plain if len(name) % 2 else f"<SchemaData>{simple}</SchemaData>"
    return (
        f"<Placemark><name>{name}</name><ExtendedData>{extended}</ExtendedData>"
        f"{_kml_geometry(geometry)}</Placemark>"
    )


def _kml_geometry(geometry):
    if geometry is None:
        return "<Point><coordinates/></Point>"
    kind, given = geometry["type"], geometry.get("coordinates")
    if kind in ("GeometryCollection", "MultiPolygon"):
        parts = geometry.get("geometries") or [
            {"type": "Polygon", "coordinates": rings} for rings in given
        ]
        return f"<MultiGeometry>{''.join(map(_kml_geometry, parts))}</MultiGeometry>"
    places = given[0] if kind == "Polygon" else given if kind == "LineString" else [given]
    text = " ".join(f"{x!r},{y!r},0" for x, y in places)
    inner = f"<coordinates>{text}</coordinates>"
    if kind == "Polygon":
        inner = f"<outerBoundaryIs><LinearRing>{inner}</LinearRing></outerBoundaryIs>"
    return f"<{kind}>{inner}</{kind}>"


def write_kml(things):
    Path("area.kml").write_text(kml_of(things), encoding="utf-8")
    return ["area.kml"]


def write_kmz(things):
    with zipfile.ZipFile("area.kmz", "w") as archive:
        archive.writestr("__MACOSX/._doc.kml", b"\x00\x05\x16\x07")
        archive.writestr("doc.kml", kml_of(things))
    return ["area.kmz"]


_KINDS = (shapefile.POLYGON, shapefile.POLYLINE, shapefile.POINT)
LINES = ("closed line", "nearly closed line", "line")


def write_shapefiles(things, upper=False):
    """A layer of polygons, one of lines and one of points; what is empty is a NULL of the first."""
    for old in Path().glob("*.*"):
        old.unlink()
    layers = {"areas": [], "lines": [], "points": []}
    for thing in things:
        layer = "lines" if thing.shape in LINES else "points" if thing.shape == "point" else "areas"
        layers[layer].append(thing)
    paths = []
    for layer, kind in zip(layers, _KINDS, strict=True):
        keys = sorted({key for thing in layers[layer] for key in thing.attributes} | {"name"})
        with closing(shapefile.Writer(layer, shapeType=kind, encoding="cp1252")) as writer:
            for key in keys:
                writer.field(key[:10], "C", 60)  # as programs cut them
            for thing in layers[layer]:
                geometry = thing.geometry()
                if geometry is None:
                    writer.null()
                elif geometry["type"] == "GeometryCollection":
                    writer.shape(_clockwise(geometry["geometries"][0]))
                else:
                    writer.shape(_clockwise(geometry))
                writer.record(*(thing.attributes.get(key, "") for key in keys))
            if layer == "areas":
                writer.poly([AREA[::-1]])
                writer.record(*("field" if key == "name" else "" for key in keys))
            if layer == "points":
                writer.point(*HOME[::-1])
                writer.record(*("home" if key == "name" else "" for key in keys))
        Path(f"{layer}.prj").write_text(WGS_84)
        Path(f"{layer}.cpg").write_text("1252")
        endings = ["shp", "shx", "dbf", "prj", "cpg"]
        for ending in endings if upper else []:
            Path(f"{layer}.{ending}").rename(f"{layer}.{ending.upper()}")
        if layers[layer] or layer != "lines":
            paths.append(f"{layer}.{'SHP' if upper else 'shp'}")
    return paths


def _clockwise(geometry):
    if geometry["type"] == "Polygon":
        return {**geometry, "coordinates": [ring[::-1] for ring in geometry["coordinates"]]}
    return geometry


def mission(paths, **options):
    """The scenario of some files and what is said of it, or the line of the refusal."""
    chosen = ImportOptions(fleet="s500_v2:1", height_m=80.0, **options)
    try:
        made = make_scenario(read_drawings([Path(path) for path in paths]), "area", chosen)
    except InputError as error:
        return None, str(error)
    return made.scenario, "\n".join(made.notes)


def depth_m(scenario, longitude, latitude, height_m):
    """How deep a place is within what no UAS may enter; negative: it is free [m]."""
    place = LocalFrame(scenario.place).to_ned(latitude, longitude, height_m)
    bodies = [hull.signed_distance(place) for hull in scenario.hulls]
    return -min([*bodies, np.inf])
