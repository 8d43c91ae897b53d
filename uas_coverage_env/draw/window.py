"""The window of `render_mode="human"`; needs the extra `human` (pygame-ce)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class Window:
    """Shows pictures on the screen, no faster than a person can follow.

    Args:
        title: Of the window.
        fps: Pictures per second.

    Raises:
        ImportError: pygame-ce is not installed.
    """

    def __init__(self, title: str, fps: float) -> None:
        try:
            import pygame
        except ImportError as error:
            raise ImportError(
                'render_mode="human" needs pygame-ce: pip install "uas-coverage-env[human]"'
            ) from error
        self._pygame = pygame
        self._fps = fps
        self._title = title
        self._screen: Any = None
        self._clock: Any = None

    def show(self, picture: NDArray[np.uint8]) -> None:
        """Show a picture and wait until it is time for the next.

        Args:
            picture: (H, W, 3) red, green, blue.
        """
        pygame = self._pygame
        size = (picture.shape[1], picture.shape[0])
        if self._screen is None:
            pygame.display.init()
            pygame.display.set_caption(self._title)
            self._screen = pygame.display.set_mode(size)
            self._clock = pygame.time.Clock()
        pygame.event.pump()
        surface = pygame.image.frombuffer(picture.tobytes(), size, "RGB")
        self._screen.blit(surface, (0, 0))
        pygame.display.flip()
        self._clock.tick(self._fps)

    def close(self) -> None:
        """Close the window; closing it twice does no harm."""
        if self._screen is not None:
            self._pygame.display.quit()
            self._screen = None
