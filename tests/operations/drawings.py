"""What the tests of `import` draw, and the command."""

import json
from pathlib import Path

from uas_coverage_env.cli import main
from uas_coverage_env.scenario import load_scenario

HIGH = ("--height", "60")  # few waypoints
SQUARE = [[10.0, 50.0], [10.003, 50.0], [10.003, 50.002], [10.0, 50.002], [10.0, 50.0]]
HOME = ("--home", "50.0005,10.0005")


def imported(*arguments):
    """The scenario that a command writes."""
    assert main(["import", *map(str, arguments), *HIGH, "--out", "out.toml", "--overwrite"]) == 0
    return load_scenario("out.toml")


def refused(capsys, *arguments):
    assert main(["import", *map(str, arguments), "--out", "no.toml"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert not Path("no.toml").exists()
    return err


def collection(*features):
    text = json.dumps({"type": "FeatureCollection", "features": list(features)})
    Path("area.geojson").write_text(text)
    return Path("area.geojson")


def feature(ring, *holes, **properties):
    geometry = {"type": "Polygon", "coordinates": [ring, *holes]}
    return {"type": "Feature", "properties": properties, "geometry": geometry}
