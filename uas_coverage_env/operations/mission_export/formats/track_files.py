"""Tracks for maps and tables: KML, GeoJSON and CSV. One file for each UAS holds all its sorties."""

import csv
import io
import json
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.scheduling import FlightFiles

UasFiles = Sequence[tuple[FlightFiles, MissionFile]]
"""The sorties of one UAS in their order, each with the flight that it is part of."""


def kml_text(name: str, flown: UasFiles) -> str:
    """The flown samples and the legs, altitudes relative to the ground.

    Args:
        name: Of the UAS.
        flown: Its sorties.
    """
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<kml xmlns="http://www.opengis.net/kml/2.2"><Document>',
        f"<name>{escape(flown[0][0].flight.scenario.name)} {escape(name)}</name>",
    ]
    for line in _lines(flown):
        coordinates = " ".join(f"{b:.8f},{a:.8f},{c:.3f}" for a, b, c in line.places)
        title = line.kind if len(flown) == 1 else f"sortie {line.sortie}, {line.kind}"
        lines.append(
            f"<Placemark><name>{title}</name><LineString><altitudeMode>relativeToGround"
            f"</altitudeMode><coordinates>{coordinates}</coordinates></LineString></Placemark>"
        )
    return "\n".join([*lines, "</Document></kml>\n"])


def geojson_text(name: str, flown: UasFiles) -> str:
    """The same as lines whose third coordinate is the height above the ground of home [m].

    Args:
        name: Of the UAS.
        flown: Its sorties.
    """
    scenario = flown[0][0].flight.scenario.name
    features = [
        {
            "type": "Feature",
            "properties": {
                "scenario": scenario,
                "uas": name,
                "line": line.kind,
                "sortie": line.sortie,
            },
            "geometry": {
                "type": "LineString",
                "coordinates": [[round(b, 8), round(a, 8), round(c, 3)] for a, b, c in line.places],
            },
        }
        for line in _lines(flown)
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}) + "\n"


def csv_text(name: str, flown: UasFiles) -> str:
    """The flown samples: time, place in degrees, height above the ground of home, sortie, battery.

    Between two sorties of one flight a UAS stands where it has landed: these samples are there,
    too, as of the sortie that has ended.

    Args:
        name: Of the UAS.
        flown: Its sorties.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    places = ("latitude_deg", "longitude_deg", "height_m")
    writer.writerow(["t_s", "uas", *places, "sortie", "soc", "voltage_V", "current_A"])
    for n, (part, one) in enumerate(flown):
        first, last = one.track.sortie.first, one.track.sortie.landed
        if n + 1 < len(flown) and flown[n + 1][0] is part:
            last = flown[n + 1][1].track.sortie.first
        flight, i = part.flight, one.track.uas
        for k, (a, b, c) in enumerate(one.geodetic(flight.x[first:last, i, :3]).tolist(), first):
            at_s = part.flown_from_s + k * flight.scenario.dt_s
            place = f"{a:.8f}", f"{b:.8f}", f"{c:.3f}"
            volts_amperes = f"{flight.voltage_V[k, i]:.4f}", f"{flight.current_A[k, i]:.4f}"
            battery = f"{flight.soc[k, i]:.6f}", *volts_amperes
            writer.writerow([f"{at_s:g}", name, *place, one.track.number, *battery])
    return text.getvalue()


class _Line(NamedTuple):
    """One line of a map.

    Attributes:
        kind: What it shows.
        sortie: Of which sortie, from 1 on.
        places: (N,) of latitude, longitude [degrees], height [m].
    """

    kind: str
    sortie: int
    places: list[Any]


def _lines(flown: UasFiles) -> Iterator[_Line]:
    for _, one in flown:
        shown: tuple[tuple[str, NDArray[np.float64]], ...] = (
            ("flown", one.track.flown_m),
            ("legs", one.track.corners_m),
        )
        for kind, places_m in shown:
            yield _Line(kind, one.track.number, one.geodetic(places_m).tolist())
