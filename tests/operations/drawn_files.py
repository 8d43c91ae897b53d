"""Small files with an area and what else a test draws, in each format."""

from contextlib import closing
from pathlib import Path

import shapefile
from drawings import collection, feature
from random_drawings import AREA, HOME, WGS_84, depth_m, mission

ZONE = [[8.0015, 50.001], [8.0025, 50.001], [8.0025, 50.002], [8.0015, 50.002], [8.0015, 50.001]]
MIDDLE = (8.002, 50.0015)
OPTIONS = {"homes": (HOME,)}


def placemark(name="", geometry="", **data):
    extended = "".join(f'<Data name="{k}"><value>{v}</value></Data>' for k, v in data.items())
    return (
        f"<Placemark><name>{name}</name><ExtendedData>{extended}</ExtendedData>{geometry}"
        f"</Placemark>"
    )


def ring(corners, *more):
    return f"<coordinates>{' '.join(f'{x},{y},0' for x, y in corners)}</coordinates>"


def polygon(corners, *more):
    outer = f"<outerBoundaryIs><LinearRing>{ring(corners)}</LinearRing></outerBoundaryIs>"
    return f"<Polygon>{''.join(more)}{outer}</Polygon>"


def kml(*marks, path="area.kml"):
    inner = placemark("field", polygon(AREA)) + "".join(marks)
    Path(path).write_text(
        f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{inner}</Document></kml>',
        encoding="utf-8",
    )
    return [path]


def drawn(*features):
    return [collection(feature(AREA, name="field"), *features)]


def of(kind, coordinates, **properties):
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def kept(paths, height_m=50.0, **options):
    """How deep the middle of the zone is in what no UAS enters [m], and what is said."""
    scenario, said = mission(paths, **{**OPTIONS, **options})
    assert scenario is not None, said
    return depth_m(scenario, *MIDDLE, height_m), said


def refusal(paths, **options):
    scenario, said = mission(paths, **{**OPTIONS, **options})
    assert scenario is None
    return said


def line(places, tag="LineString"):
    return f"<{tag}>{ring(places)}</{tag}>"


def layer(name, kind, rows, encoding="utf-8", page=None, language=None):
    keys = sorted({key for fields, _ in rows for key in fields})
    with closing(shapefile.Writer(name, shapeType=kind, encoding=encoding)) as writer:
        for key in keys:
            writer.field(key, "C", 40)
        for fields, parts in rows:
            if parts is None:
                writer.null()
            elif kind == shapefile.POLYGON:
                writer.poly([part[::-1] for part in parts])
            elif kind == shapefile.POLYLINE:
                writer.line(parts)
            else:
                writer.point(*parts)
            writer.record(*(fields.get(key, "") for key in keys))
    Path(f"{name}.prj").write_text(WGS_84)
    if page:
        Path(f"{name}.cpg").write_text(page)
    if language is not None:
        table = bytearray(Path(f"{name}.dbf").read_bytes())
        table[29] = language
        Path(f"{name}.dbf").write_bytes(table)
    return f"{name}.shp"
