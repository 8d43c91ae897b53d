import re
from typing import Any

import numba
import pytest
from changing_missions import EVENTS, EVERYTHING
from own_actions_on_gpu import CHOICES
from practice_grounds import box
from small_worlds import meadow

from uas_coverage_env import ContactKind, uas_coverage_v0
from uas_coverage_env.entities.state import SWAPPING
from uas_coverage_env.env.gpu.refused import REFUSED
from uas_coverage_env.scenario import GeneratedScenarios, Obstacle
from uas_coverage_env.scenario.events import EVENT_KINDS

vector_env: Any = uas_coverage_v0.vector_env


def test_missions_on_a_simulated_gpu_are_bit_for_bit_those_of_a_batch(flown_on_gpu):
    flown = dict(flown_on_gpu["missions"])
    swapped = flown.pop("packs")
    assert swapped["different"] == []
    assert SWAPPING in swapped["statuses"]
    for result in flown.values():
        assert result["different"] == []
        assert result["restarts"] >= 2
        assert result["acted"] > 20
    assert flown["still"]["apart"]
    assert flown["windy"]["x"] != flown["still"]["x"]
    assert ContactKind.LIMITS in flown["wrenches"]["contacts"]
    assert flown_on_gpu["limits_exceeded"] == [*[[]] * 4, ["tilt"], ["speed", "tilt"]]


def test_what_goes_to_places_is_guided_on_a_simulated_gpu_as_in_a_batch(flown_on_gpu):
    guided = flown_on_gpu["guided"]
    for name, result in guided.items():
        assert result["different"] == [], name
        assert result["restarts"] >= 2
    # as each has a thread of its own, each has a room of its own
    assert guided["places"]["guided"] == guided["with v1"]["guided"] == [True] * 4
    assert guided["with v1"]["observation"] != guided["places"]["observation"]
    for name in ("called home", "sent home"):
        assert guided[name]["returned"]


def test_threads_of_a_simulated_gpu_come_to_the_same_in_any_order(flown_on_gpu):
    for result in flown_on_gpu["orders"].values():
        assert result["different"] == []
        assert result["acted"] > 60


def test_lanes_draw_their_missions_on_a_simulated_gpu_as_in_a_batch(flown_on_gpu):
    result = flown_on_gpu["drawn"]
    assert result["different"] == []
    assert len({tuple(scenarios) for scenarios in result["scenarios"]}) > 1
    assert {each for scenarios in result["scenarios"] for each in scenarios} == {0, 1, 2}


def test_own_blocks_and_terms_run_on_a_simulated_gpu_as_in_a_batch(flown_on_gpu):
    assert flown_on_gpu["blocks"].keys() >= {"behind", "alone", "weighed", "local", "picture"}
    for result in flown_on_gpu["blocks"].values():
        assert result["different"] == []
        assert result["restarts"] >= 2


def test_scenes_change_on_a_simulated_gpu_as_in_a_batch(flown_on_gpu):
    everything, again = (flown_on_gpu["scenes"][name] for name in ("all", "again"))
    for result in (everything, again):
        assert result["different"] == []
        assert result["restarts"] == 2
    n_events = len(EVENTS)
    assert len(EVENT_KINDS) == n_events
    change = {e for e, event in enumerate(EVERYTHING.events) if event.changes_scene}
    assert change <= set(everything["changes"])
    assert max(everything["changes"]) >= n_events  # a waypoint is asked for again
    assert again["changes"]


def test_missions_on_a_gpu_that_are_put_aside_go_on_there_or_in_a_batch(flown_on_gpu):
    result = flown_on_gpu["scenes"]["checkpoint"]
    assert result["different"] == []
    assert min(result["changes"]) > 2
    assert "changes[0] is" in result["refused"]
    assert "which no mission here can have" in result["refused"]


def test_torch_reads_and_writes_the_arrays_in_place(flown_on_gpu):
    result = flown_on_gpu["arrays"]["in place"]
    assert result["equal"]
    assert result["spaces"]
    n, n_uas = 3, 2
    assert result["shapes"]["observation"] == [n, n_uas * 234]
    assert result["shapes"]["asked"] == [n, n_uas * 3]
    assert result["shapes"]["rewards"] == [n, n_uas]
    assert result["shapes"]["report"][:2] == [n, n_uas]
    each = ("reward", "terminated", "truncated", "ended", "refused", "acted")
    assert all(result["shapes"][name] == [n] for name in each)


def test_actions_that_lie_on_the_gpu_are_those_of_the_host(flown_on_gpu):
    result = flown_on_gpu["arrays"]["taken"]
    assert result["equal"]
    assert result["refused"] == "actions have shape (1, 6); give (2, 6)"


def test_lanes_are_seeded_and_counted_as_those_of_a_batch(flown_on_gpu):
    last = [2**64 - 1, 0]
    counted = [[[5, 6], [0, 0]], [[5, 6], [1, 1]], [[5, 8], [2, 0]], [last, [0, 0]]]
    assert flown_on_gpu["arrays"]["seeded"] == [[*each, True] for each in counted]


def test_a_wrong_call_is_answered_in_one_line(flown_on_gpu):
    refused = flown_on_gpu["arrays"]["refused"]
    assert refused.pop("step") == "step() before reset(): call reset() first"
    said = {
        "shape": "actions have shape (2, 7)", "letters": "give real numbers",
        "seed": "seed of environment 0 is -1", "seeds": "1 seeds for 2 environments",
    }  # fmt: skip
    assert refused.keys() == said.keys()
    assert all(said[name] in line and "\n" not in line for name, line in refused.items())


SLAB = Obstacle(
    name="slab",
    safe_distance_m=2.0,
    vertices_m=box((80.0, 120.0, -14.0), (120.0, 150.0, -10.0)),
)
OVERHUNG = meadow(obstacles=[SLAB])
ASKED_FOR = {
    "overhang": (OVERHUNG, {"action": "waypoint"}),
    "return_mode": (["open_field", OVERHUNG], {"return_mode": True}),
    "safety_filter": ("village", {"safety_filter": True}),
    "drawn one by one: a family": ("generated-light", {}),
    "a generator": (GeneratedScenarios(), {}),
    "autoreset_mode": ("village", {"autoreset_mode": "SameStep"}),
    "mask_in_observation": ("village", {"mask_in_observation": True, "action": CHOICES}),
    "images_apart": ("village", {"images_apart": True, "observation": "grid"}),
    "flat_infos": ("village", {"flat_infos": True}),
    "render_mode": ("village", {"render_mode": "rgb_array"}),
    "threads": ("village", {"threads": 2}),
}


@pytest.mark.parametrize("name", ASKED_FOR)
def test_what_does_not_run_on_a_gpu_is_refused_in_one_line(name):
    scenario, settings = ASKED_FOR[name]
    with pytest.raises(ValueError, match=r"not on a GPU: .*") as error:
        vector_env(2, scenario, device="cuda", **settings)
    (row,) = (row for row in REFUSED if row.what.replace("`", "") in str(error.value))
    assert name in str(error.value)
    assert row.instead.replace("`", "") in str(error.value)
    assert "\n" not in str(error.value)


def test_each_row_of_the_table_is_asked_for_above():
    for row in REFUSED:
        assert any(name in row.what.replace("`", "") for name in ASKED_FOR)


def test_without_a_gpu_it_is_said_what_to_install(monkeypatch):
    from uas_coverage_env.env.gpu import device

    monkeypatch.setattr(device, "find_spec", lambda name: None)
    with pytest.raises(ImportError, match=re.escape('pip install "uas-coverage-env[gpu]"')):
        vector_env(2, device="cuda")
    monkeypatch.setattr(device, "find_spec", lambda name: name)
    if numba.cuda.is_available():
        pytest.skip("there is a GPU")
    with pytest.raises(RuntimeError, match="needs an NVIDIA GPU"):
        vector_env(2, device="cuda")


def test_there_are_two_devices():
    with pytest.raises(ValueError, match="device is 'gpu'; it is one of cpu, cuda"):
        vector_env(2, device="gpu")
