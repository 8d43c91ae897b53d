"""The replay page of a flight that is still flown, given out by this machine to itself alone."""

import json
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, urlsplit

from uas_coverage_env.flight import Flight
from uas_coverage_env.replay.flight_data import flight_data
from uas_coverage_env.replay.page import replay_page

LOOPBACK = "127.0.0.1"
_DATA = "/flight.json"
_SOURCE = "the flight"
_PAUSE_S = 0.4
_COST = 4.0
"""So many times as long as the last picture took to make passes until the next one is made."""

_WATCHED_S = 3.0
"""A page that has not asked for so long has gone; at the end the others are waited for so long."""


class LivePage:
    """Serves a flight while it is flown: read only, on a free port of the loopback interface.

    Args:
        flight: What has been flown when it begins.

    Raises:
        InputError: The flight holds a value that is not finite.
    """

    def __init__(self, flight: Flight) -> None:
        self._lock = threading.Lock()
        self._asked_s = -_WATCHED_S
        self._told = -1
        self._due_s = 0.0
        self._keep(flight, over=False)
        self._server = ThreadingHTTPServer((LOOPBACK, 0), _handler(self))
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Of the page, for a browser on this machine."""
        return f"http://{LOOPBACK}:{self._server.server_port}/"

    @property
    def due(self) -> bool:
        """Whether somebody looks, and it is time to show more.

        A page that nobody looks at, and flights that are over in seconds, cost next to nothing.
        """
        now_s = time.monotonic()
        return now_s >= self._due_s and now_s - self._asked_s < _WATCHED_S

    def update(self, flight: Flight) -> None:
        """The flight has gone on."""
        self._keep(flight, over=False)

    def close(self, flight: Flight | None = None) -> None:
        """The flight is over: whoever looks gets the rest of it, then the server ends."""
        if flight is not None and time.monotonic() - self._asked_s < _WATCHED_S:
            self._keep(flight, over=True)
            until_s = time.monotonic() + _WATCHED_S
            while self._told < len(flight.x) and time.monotonic() < until_s:
                time.sleep(0.02)
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def page(self) -> str:
        """The page with what has been flown."""
        self._asked_s = time.monotonic()
        return replay_page([self._flight], sources=[_SOURCE], live=_DATA)

    def news(self, known: int) -> str | None:
        """What has been flown, as JSON; None: no more than so many samples.

        Args:
            known: Samples that the page has.
        """
        self._asked_s = time.monotonic()
        with self._lock:
            samples, over, text = self._samples, self._over, self._text
        if samples == known and not over:
            return None
        if over:
            self._told = samples
        return text

    def _keep(self, flight: Flight, *, over: bool) -> None:
        begun_s = time.monotonic()
        samples = len(flight.x)
        data = {"samples": samples, "over": over, "flight": flight_data(flight, _SOURCE)}
        text = json.dumps(data, allow_nan=False, separators=(",", ":"))
        with self._lock:
            self._flight, self._samples, self._over, self._text = flight, samples, over, text
        now_s = time.monotonic()
        self._due_s = now_s + max(_PAUSE_S, _COST * (now_s - begun_s))


def _handler(live: LivePage) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        """Answers GET for the page and its data, and nothing else."""

        def do_GET(self) -> None:
            host = self.headers.get("Host", "").rsplit(":", 1)[0]
            asked = urlsplit(self.path)
            if host not in (LOOPBACK, "localhost"):
                # a page from elsewhere that calls this machine by a name of its own
                self.send_error(HTTPStatus.FORBIDDEN)
            elif asked.path == "/":
                self._answer(live.page(), "text/html; charset=utf-8")
            elif asked.path == _DATA:
                known = parse_qs(asked.query).get("known", ["-1"])[0]
                self._answer(live.news(int(known) if known.isdecimal() else -1), "application/json")
            else:
                self.send_error(HTTPStatus.NOT_FOUND)

        def _answer(self, text: str | None, kind: str) -> None:
            body = b"" if text is None else text.encode("utf-8", errors="xmlcharrefreplace")
            self.send_response(HTTPStatus.NO_CONTENT if text is None else HTTPStatus.OK)
            self.send_header("Content-Type", kind)
            self.send_header("Content-Length", str(len(body)))
            self.send_header("Cache-Control", "no-store")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:
            """Say nothing: the terminal shows the flight."""

    return Handler
