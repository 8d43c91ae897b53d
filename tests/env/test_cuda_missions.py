from changing_missions import EVENTS, EVERYTHING
from scenes_on_gpu import EVERY_KIND

from uas_coverage_env import ContactKind
from uas_coverage_env.entities.state import SWAPPING
from uas_coverage_env.scenario.events import EVENT_KINDS


def test_missions_on_a_simulated_gpu_are_bit_for_bit_those_of_episodes(flown_on_gpu):
    flown = dict(flown_on_gpu["missions"])
    swapped = flown.pop("packs")
    assert swapped["different"] == 0
    assert SWAPPING in swapped["statuses"]
    for result in flown.values():
        assert result["different"] == 0
        assert result["restarts"] >= 2
        assert result["refused"] == [True, False]
        assert result["changed"] == [False, True]
        assert result["acted"] > 20
    assert flown["windy"]["x"] != flown["still"]["x"]
    assert flown["still"]["limits_exceeded"] == [*[[]] * 4, ["tilt"], ["speed", "tilt"]]
    assert ContactKind.LIMITS in flown["wrenches"]["contacts"]


def test_scenes_change_on_a_simulated_gpu_as_in_episodes(flown_on_gpu):
    everything, again = (flown_on_gpu["scenes"][name] for name in ("all", "again"))
    for result in (everything, again):
        assert result["different"] == 0
        assert result["restarts"] == 2
    n_events = len(EVENTS)
    assert len(EVERY_KIND) == len(EVENT_KINDS) == n_events
    change = {e for e, event in enumerate(EVERYTHING.events) if event.changes_scene}
    assert change <= set(everything["changes"])
    assert max(everything["changes"]) >= n_events  # a waypoint is asked for again
    assert again["changes"]


def test_missions_on_a_gpu_that_are_put_aside_go_on_in_their_scenes(flown_on_gpu):
    result = flown_on_gpu["scenes"]["checkpoint"]
    assert result["different"] == 0
    assert min(result["changes"]) > 2
    assert "changes[0] is" in result["refused"]
    assert "which no mission here can have" in result["refused"]


def test_what_does_not_run_on_a_gpu_is_refused_in_one_line(flown_on_gpu):
    refusals = flown_on_gpu["scenes"]["refusals"]
    assert len(refusals) == 4
    for kind in ("radio_lost", "planner_lost"):
        assert 'then = "hover"' in refusals[kind]
    for given in ("family", "drawn"):
        assert "give one scenario" in refusals[given]
    assert not any("\n" in line for line in refusals.values())
