"""One picture of one state, seen from above: what `render` returns, or shows in a window.

Pillow is imported when the first `Picture` is made, pygame when the first window opens.
"""

from uas_coverage_env.draw.signs import legend
from uas_coverage_env.draw.state_picture import Picture, picture
from uas_coverage_env.draw.window import NoDisplayError, Window, window_possible

__all__ = ["NoDisplayError", "Picture", "Window", "legend", "picture", "window_possible"]
