"""The window: keys, pauses, and that nothing hangs or breaks when a person closes it."""

import signal
import sys

import numpy as np
import pytest

from uas_coverage_env.draw.window import NoDisplayError, Window

pygame = pytest.importorskip("pygame")

GREY = np.full((128, 160, 3), 90, np.uint8)


@pytest.fixture
def window(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    window = Window("a flight", fps=1000)
    window.show(GREY)
    yield window
    window.close()


def press(*keys):
    for key in keys:
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))


def nothing():
    pass


def escape():
    press(pygame.K_ESCAPE)


def button():
    pygame.event.post(pygame.event.Event(pygame.QUIT))


@pytest.fixture
def naps(monkeypatch):
    """What a person does in each nap of a paused window; a nap after the last would be endless."""
    acts = []

    def nap(_):
        if not pygame.event.peek():
            acts.pop(0)()
        return pygame.event.poll()

    monkeypatch.setattr(pygame.event, "wait", nap)
    return acts


def test_a_window_shows_the_picture_as_it_is(window):
    picture = np.random.default_rng(0).integers(0, 256, (128, 160, 3), dtype=np.uint8)
    window.show(picture)
    surface = pygame.display.get_surface()
    assert surface.get_size() == (160, 128)
    np.testing.assert_array_equal(pygame.surfarray.array3d(surface).swapaxes(0, 1), picture)


def test_space_pauses_and_space_goes_on(window, naps):
    captions = []
    naps += [
        lambda: captions.append(pygame.display.get_caption()[0]),
        lambda: press(pygame.K_SPACE),
    ]
    press(pygame.K_SPACE)
    window.show(GREY)
    assert not naps, "it waited until the second press"
    assert "space: go on" in captions[0]
    assert "space: pause" in pygame.display.get_caption()[0]
    window.show(GREY)


@pytest.mark.parametrize("key", [pygame.K_RIGHT, pygame.K_PERIOD])
def test_each_press_of_a_step_key_shows_one_picture_more(window, naps, key):
    press(key)
    window.show(GREY)
    assert "go on" in pygame.display.get_caption()[0], "it is paused before the next picture"
    naps += [nothing, lambda: press(key, key)]
    window.show(GREY)
    assert not naps
    naps += [nothing, nothing, lambda: press(pygame.K_SPACE)]
    window.show(GREY)
    assert len(naps) == 3, "the second press was still to be obeyed"
    window.show(GREY)
    assert not naps


@pytest.mark.parametrize("how", [escape, button, lambda: press(pygame.K_SPACE)])
def test_the_last_picture_stays_until_a_person_closes_the_window(window, naps, how):
    naps += [nothing, nothing, how]
    window.stay()
    assert not naps
    assert window.dismissed
    assert pygame.display.get_surface() is None
    window.stay()


@pytest.mark.parametrize("paused", [False, True])
@pytest.mark.parametrize("how", [escape, button])
def test_a_window_that_a_person_closes_never_waits_again(window, naps, how, paused):
    if paused:
        naps += [nothing, how]
        press(pygame.K_SPACE)
    else:
        how()
    window.show(GREY)
    assert not naps
    assert window.dismissed
    assert pygame.display.get_surface() is None
    window.show(GREY)
    assert pygame.display.get_surface() is None
    window.close()


@pytest.mark.usefixtures("python_handles_interrupts")
def test_ctrl_c_ends_a_pause(window, naps):
    naps += [nothing, lambda: signal.raise_signal(signal.SIGINT)]
    press(pygame.K_SPACE)
    with pytest.raises(KeyboardInterrupt):
        window.show(GREY)
    assert not window.dismissed


def test_two_windows_take_turns_on_the_one_that_there_is(window):
    other = Window("another flight", fps=1000)
    other.show(np.zeros((200, 200, 3), np.uint8))
    window.show(GREY)
    assert pygame.display.get_surface().get_size() == (160, 128)
    other.close()
    window.show(GREY)
    assert pygame.display.get_surface().get_size() == (160, 128)


def test_other_keys_and_clicks_do_nothing(window):
    press(pygame.K_a)
    pygame.event.post(pygame.event.Event(pygame.MOUSEBUTTONDOWN, button=1, pos=(3, 3)))
    window.show(GREY)
    assert not window.dismissed
    assert "space: pause" in pygame.display.get_caption()[0]


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere there is a display")
def test_without_a_display_a_window_says_so(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(NoDisplayError, match="DISPLAY is not set"):
        Window("a flight", fps=20)


def test_a_display_that_cannot_be_reached_is_named(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "no-such-driver")
    with pytest.raises(NoDisplayError, match="no window can be opened"):
        Window("a flight", fps=20).show(GREY)
