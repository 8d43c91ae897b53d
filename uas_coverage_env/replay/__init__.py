"""Flights to look at: the replay page, films, and figures for print.

Everything is made from a `Flight`; nothing is simulated again. matplotlib and imageio-ffmpeg (extra
`view`) are imported when they are needed.
"""

from uas_coverage_env.replay.film import write_gif, write_video
from uas_coverage_env.replay.page import replay_page, write_replay

__all__ = ["replay_page", "write_gif", "write_replay", "write_video"]
