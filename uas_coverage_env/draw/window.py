"""The window in which a person watches; needs the extra `human` (pygame-ce)."""

import os
import sys
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

_WITH_A_DISPLAY = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER")
# Where it finds no display, SDL takes these by itself: they show nothing to anybody.
_UNSEEN_DRIVERS = ("offscreen", "dummy", "evdev")
# A paused window looks up from its keys that often, so that Ctrl-C reaches Python.
_NAP_MS = 100


class NoDisplayError(RuntimeError):
    """There is no screen on which a window could be opened."""


def window_possible() -> bool:
    """Whether a window could be opened now: pygame-ce is installed, and there is a display."""
    return find_spec("pygame") is not None and _display_found()


def _display_found() -> bool:
    return sys.platform != "linux" or any(os.environ.get(name) for name in _WITH_A_DISPLAY)


class Window:
    """Shows pictures on the screen, no faster than a person can follow.

    The space bar pauses and goes on; the right arrow or the full stop pauses and shows one more
    picture. Escape, or the button of the window, ends watching: nothing is shown any more and
    nothing is waited for. `show` obeys the keys, and comes back from a pause when it is over.

    Args:
        title: Of the window.
        fps: Pictures per second.

    Attributes:
        dismissed: Whether a person has ended watching.

    Raises:
        ImportError: pygame-ce is not installed.
        NoDisplayError: There is no display.
    """

    def __init__(self, title: str, fps: float) -> None:
        # else it greets on stdout when it is imported
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError as error:
            raise ImportError(
                'a window needs pygame-ce: pip install "uas-coverage-env[human]"'
            ) from error
        if not _display_found():
            raise NoDisplayError("a window needs a display, and DISPLAY is not set")
        self.dismissed = False
        self._pygame = pygame
        self._fps = fps
        self._title = title
        self._paused = False
        self._clock = pygame.time.Clock()
        self._opened = False

    def open(self, size: tuple[int, int]) -> Any:
        """Open the window, before there is a picture; `show` does it by itself.

        Args:
            size: Width and height.

        Returns:
            What pygame draws on.

        Raises:
            NoDisplayError: It cannot be opened.
        """
        pygame = self._pygame
        try:
            pygame.display.init()
            driver = pygame.display.get_driver()
            chosen = os.environ.get("SDL_VIDEODRIVER") or os.environ.get("SDL_VIDEO_DRIVER")
            if driver in _UNSEEN_DRIVERS and not chosen:
                pygame.display.quit()
                raise NoDisplayError("a window needs a display, and there is none to be reached")
            surface = pygame.display.set_mode(size)
        except pygame.error as error:
            raise NoDisplayError(f"no window can be opened ({error})") from error
        self._opened = True
        self._name()
        return surface

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture, wait until it is time for the next, and longer while it is paused.

        Args:
            picture: (H, W, 3) red, green, blue.

        Raises:
            NoDisplayError: The window cannot be opened.
        """
        if self.dismissed:
            return
        pygame = self._pygame
        size = (picture.shape[1], picture.shape[0])
        # pygame has one window: another environment may have closed it, or given it another size
        surface = pygame.display.get_surface()
        if not self._opened or surface is None or surface.get_size() != size:
            surface = self.open(size)
        surface.blit(pygame.image.frombuffer(picture.tobytes(), size, "RGB"), (0, 0))
        pygame.display.flip()
        self._clock.tick(self._fps)
        self._obey()

    def stay(self) -> None:
        """Keep the last picture until a person closes the window, by any key or its button."""
        if not self._opened:
            return
        pygame = self._pygame
        pygame.display.set_caption(f"{self._title} - the end, any key: close")
        while not self.dismissed:
            event = pygame.event.wait(_NAP_MS)
            if event.type in (pygame.QUIT, pygame.KEYDOWN):
                self._dismiss()
            elif event.type == pygame.WINDOWEXPOSED:
                pygame.display.flip()

    def close(self) -> None:
        """Close the window; closing it twice does no harm."""
        if self._opened:
            self._pygame.display.quit()
            self._opened = False

    def _name(self) -> None:
        keys = "space: go on" if self._paused else "space: pause"
        self._pygame.display.set_caption(f"{self._title} - {keys}, right: step, escape: close")

    def _obey(self) -> None:
        """Take the keys, and more of them for as long as the window is paused."""
        pygame = self._pygame
        while not self.dismissed:
            event = pygame.event.wait(_NAP_MS) if self._paused else pygame.event.poll()
            if event.type == pygame.NOEVENT and not self._paused:
                return
            if event.type == pygame.QUIT:
                self._dismiss()
            elif event.type == pygame.WINDOWEXPOSED:
                pygame.display.flip()
            elif event.type == pygame.KEYDOWN:
                if event.key == pygame.K_ESCAPE:
                    self._dismiss()
                elif event.key == pygame.K_SPACE:
                    self._paused = not self._paused
                    self._name()
                elif event.key in (pygame.K_RIGHT, pygame.K_PERIOD):
                    self._paused = True
                    self._name()
                    return

    def _dismiss(self) -> None:
        self.dismissed = True
        self.close()
