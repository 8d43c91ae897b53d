"""Tracks for maps and tables: KML, GeoJSON and CSV."""

import csv
import io
import json
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from uas_coverage_env.operations.exported import Exported
from uas_coverage_env.scenario import Scenario


def kml_text(scenario: Scenario, one: Exported) -> str:
    """The flown samples and the legs, altitudes relative to the ground.

    Args:
        scenario: The mission.
        one: The UAS.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document>',
        f"<name>{escape(scenario.name)} {escape(one.track.name)}</name>",
    ]
    for name, places in _lines(one):
        coordinates = " ".join(f"{b:.8f},{a:.8f},{c:.3f}" for a, b, c in places)
        lines.append(
            f"<Placemark><name>{name}</name><LineString><altitudeMode>relativeToGround"
            f"</altitudeMode><coordinates>{coordinates}</coordinates></LineString></Placemark>"
        )
    return "\n".join([*lines, "</Document></kml>\n"])


def geojson_text(scenario: Scenario, one: Exported) -> str:
    """The same as lines whose third coordinate is the height above the ground of home [m].

    Args:
        scenario: The mission.
        one: The UAS.
    """
    features = [
        {
            "type": "Feature",
            "properties": {"scenario": scenario.name, "uas": one.track.name, "line": name},
            "geometry": {
                "type": "LineString",
                "coordinates": [[round(b, 8), round(a, 8), round(c, 3)] for a, b, c in places],
            },
        }
        for name, places in _lines(one)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}) + "\n"


def csv_text(scenario: Scenario, one: Exported) -> str:
    """The flown samples: time, place in degrees, height above the ground of home.

    Args:
        scenario: The mission.
        one: The UAS.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["t_s", "uas", "latitude_deg", "longitude_deg", "height_m"])
    for sample, (a, b, c) in enumerate(one.geodetic(one.track.flown_m).tolist()):
        row = [f"{sample * scenario.dt_s:g}", one.track.name, f"{a:.8f}", f"{b:.8f}", f"{c:.3f}"]
        writer.writerow(row)
    return text.getvalue()


def _lines(one: Exported) -> list[tuple[str, list[Any]]]:
    legs_m = np.vstack([one.track.corners_m])
    return [
        ("flown", one.geodetic(one.track.flown_m).tolist()),
        ("legs", one.geodetic(legs_m).tolist()),
    ]
