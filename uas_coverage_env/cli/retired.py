"""What was typed once, and what follows it: each is answered, none works twice."""

from collections.abc import Mapping

from uas_coverage_env.interruptions import PROGRAM

FOLLOWERS: Mapping[str, str] = {
    "front": "compare --vary KEY=A,B",
    "demonstrate": "planner demonstrate",
    "warm-up": "planner warm-up",
    "planners": "planner list",
    "scenarios": "scenario list",
    "scenarios list": "scenario list",
    "scenarios check": "scenario check",
    "vehicles": "vehicle list",
    "resume": "scenario resume",
    "import-log": "log",
    "export --autopilot": "export --firmware",
    "train --minutes": "train --steps",
    "score --players": "score --planners",
    "compare --players": "compare --planners",
}
"""A command, alone or with a sub-command or an option -> the same as it is typed now."""


def follower(*words: str) -> str:
    """What follows the longest of the words that are typed no more, in a line; or nothing."""
    for n in range(len(words), 0, -1):
        old = " ".join(words[:n])
        new = FOLLOWERS.get(old)
        if new:
            command = new.partition(" -")[0]
            return f"`{PROGRAM} {old}` is `{PROGRAM} {new}` now; see `{PROGRAM} {command} --help`"
    return ""
