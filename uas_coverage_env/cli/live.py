"""What `run --live` shows: the replay page of the flight, fed while it is planned."""

from rich.console import Console

from uas_coverage_env.flight import Progress
from uas_coverage_env.replay.live import LivePage


class LiveView:
    """Serves the flight from before the first decision until it ends, and says where.

    Args:
        out: Where to write.
    """

    def __init__(self, out: Console) -> None:
        self._out = out
        self._page: LivePage | None = None
        self._last: Progress | None = None

    def __call__(self, progress: Progress) -> None:
        """Show where the flight stands, if somebody looks."""
        self._last = progress
        if self._page is None:
            self._page = LivePage(progress.flown())
            self._out.print(f"live at {self._page.address}", markup=False)
        elif self._page.due:
            self._page.update(progress.flown())

    def close(self) -> None:
        """Show the rest of the flight to whoever looks, and end the server."""
        if self._page is not None and self._last is not None:
            self._page.close(self._last.flown())
