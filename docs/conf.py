"""How the site is built: python -m sphinx -W -b html docs docs/_build/html, without a network."""

import gc
import sys
from importlib.metadata import version as version_of
from importlib.util import find_spec
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

# documents are large trees that stay: to look through them for garbage took a third of the time
gc.set_threshold(50_000, 20, 100)

project = "uas-coverage-env"
author = "The uas-coverage-env authors"
release = version = version_of("uas-coverage-env")

extensions = ["myst_nb", "repository_links", "mathml", "public_names"]
exclude_patterns = ["_build", "_extensions"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
nb_execution_mode = "off"  # the published site runs the lessons: .github/workflows/docs.yml
nb_execution_timeout = 3600
nb_execution_raise_on_error = True
nitpicky = True
highlight_language = "text"

# signatures name types of other packages, whose sites are not looked up
nitpick_ignore_regex = [("py:.*", ".*")]
suppress_warnings = ["ref.python"]  # a type of which two modules have one of the same name
python_maximum_signature_line_length = 88
python_use_unqualified_type_names = True
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_mock_imports = [
    name
    for name in (
        *("torch", "stable_baselines3", "sb3_contrib", "matplotlib", "imageio_ffmpeg"),
        *("pyproj", "shapely", "shapefile", "defusedxml"),
    )
    if find_spec(name) is None  # extras that a site is built without
]
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

html_theme = "furo"
html_title = f"{project} {release}"
html_copy_source = False
html_show_copyright = False
html_extra_path = ["scenario.schema.json"]
html_math_renderer = "mathml"
