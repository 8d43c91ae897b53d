"""How the site is built: python -m sphinx -W -b html docs docs/_build/html, without a network."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "uas-coverage-env"
author = "The uas-coverage-env authors"
release = version = version_of("uas-coverage-env")

extensions = ["myst_parser", "repository_links", "mathml"]
exclude_patterns = ["_build", "_extensions"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
nitpicky = True
highlight_language = "text"

html_theme = "furo"
html_title = project
html_copy_source = False
html_show_copyright = False
html_extra_path = ["scenario.schema.json"]
html_math_renderer = "mathml"
