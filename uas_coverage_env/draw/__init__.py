"""One picture of one state, seen from above: what `render_mode="rgb_array"` returns.

Pillow is imported when the first picture is drawn, pygame when the first window opens.
"""

from uas_coverage_env.draw.picture import Picture, picture
from uas_coverage_env.draw.window import Window

__all__ = ["Picture", "Window", "picture"]
