"""One picture of one state, seen from above: what `render` returns, or shows in a window.

Pillow is imported when the first `Picture` is made, pygame when the first window opens.
"""

from uas_coverage_env.draw.state_picture import Picture, picture

__all__ = ["Picture", "picture"]
