"""What is in a replay page, read without a browser."""

import base64
import dataclasses
import hashlib
import html
import json
import re

import numpy as np
import pytest

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import load_planner, rollout
from uas_coverage_env.flight.record import PLAN_DTYPE
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.replay import replay_page, write_replay
from uas_coverage_env.replay.flight_data import flight_data
from uas_coverage_env.replay.scene_data import scene_data
from uas_coverage_env.scenario import generate_scenario, load_scenario


def embedded(page: str) -> list[dict]:
    (text,) = re.findall(r'<script type="application/json" id="flights">(.*?)</script>', page)
    return json.loads(text)


def decoded(series: dict, *shape: int) -> np.ndarray:
    return np.array(series["values"]).reshape(shape) * series["unit"]


def test_the_page_holds_the_flight_as_it_was_flown(flight):
    (data,) = embedded(replay_page([flight]))
    samples, uas = flight.mode.shape
    assert data["samples"] == samples
    np.testing.assert_allclose(
        decoded(data["position"], samples, uas, 3), flight.x[..., :3], atol=0.006
    )
    np.testing.assert_allclose(decoded(data["soc"], samples, uas), flight.soc, atol=6e-5)
    np.testing.assert_allclose(decoded(data["voltage"], samples, uas), flight.voltage_V, atol=6e-4)
    np.testing.assert_allclose(decoded(data["current"], samples, uas), flight.current_A, atol=6e-3)
    np.testing.assert_allclose(
        decoded(data["moving"], samples, -1, 3), flight.moving_position_m, atol=0.006
    )
    assert data["covered"] == flight.covered.tolist()
    for k in (0, samples // 2, samples - 1):
        assert sum(at <= k for at in data["covered_at"]) == flight.covered[k]
    assert data["violations"] == [
        {"t_s": 30.0, "uas": "uas_1", "kind": "obstacle", "with": "church"}
    ]


def test_the_page_holds_each_prediction_at_its_step(flight):
    plan = flight_data(flight, "here")["plan"]
    assert len(plan["steps"]) == flight.steps + 1
    assert plan["steps"][-1] == [], "nothing was decided at the last sample"
    rows = flight.plan[(flight.plan["step"] == 12) & (flight.plan["uas"] == 1)]
    predicted = np.array(plan["steps"][12][1]).reshape(-1, 3) * plan["unit"]
    np.testing.assert_allclose(predicted, rows["position_m"], atol=0.06)


def test_rows_of_a_plan_may_come_in_any_order(flight):
    shuffled = np.random.default_rng(5).permutation(flight.plan)
    other = dataclasses.replace(flight, plan=shuffled)
    assert flight_data(other, "here")["plan"] == flight_data(flight, "here")["plan"]


def test_a_planner_that_predicts_nothing_has_no_predictions(plain):
    assert flight_data(plain, "here")["plan"]["steps"] == [[]] * (plain.steps + 1)


def test_a_page_is_self_contained_and_small(flight):
    page = replay_page([flight])
    assert len(page.encode()) < 1_000_000
    assert not re.search(r"""(?:src|href)\s*=\s*["']""", page.split("<script>")[0])
    assert "@import" not in page
    assert "url(" not in page.split("</style>")[0]


def test_a_village_flight_of_usual_length_stays_below_a_megabyte(plain):
    """247 steps, as in the paper, with all predictions: what the paper's planner writes."""
    steps = 247
    samples = np.arange(steps + 1) % (plain.steps + 1)
    rows = [
        (k, i, n, (np.arange(3) * 101.7 + n * 11.3 + k) % 500)
        for k in range(steps)
        for i in range(2)
        for n in range(19)
    ]
    long = dataclasses.replace(
        plain,
        **{
            name: getattr(plain, name)[samples]
            for name in (
                *("x", "u", "voltage_V", "current_A", "mode", "covered"),
                "moving_position_m",
            )
        },
        plan=np.array(rows, PLAN_DTYPE),
        decisions=tuple(plain.decisions[k % plain.steps] for k in range(steps)),
    )
    assert len(replay_page([long]).encode()) < 1_000_000


def test_the_policy_allows_this_script_and_this_style_and_nothing_else(flight):
    page = replay_page([flight])
    (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="(.*?)"', page)
    script = page.split("<script>")[1].split("</script>")[0]
    style = page.split("<style>")[1].split("</style>")[0]
    sums = [
        base64.b64encode(hashlib.sha256(part.encode()).digest()).decode()
        for part in (script, style)
    ]
    assert html.unescape(policy) == (
        f"default-src 'none'; script-src 'sha256-{sums[0]}'; style-src 'sha256-{sums[1]}'; "
        "base-uri 'none'; form-action 'none'"
    )
    assert "unsafe" not in policy


def test_names_are_data_and_stay_data(flight, tmp_path):
    hostile = "</script><script>hacked = 1</script>&amp;<!--\u2028\ud800"
    water = flight.scenario.decorations[0].model_copy(update={"kind": hostile[:-1]})
    scenario = flight.scenario.model_copy(update={"decorations": (water,)})
    evil = dataclasses.replace(flight, scenario=scenario, planner=hostile)
    page = write_replay([evil], tmp_path / "replay.html").read_text(encoding="utf-8")
    assert page.count("</script>") == 2
    assert "<script>hacked" not in page
    (data,) = embedded(page)
    assert data["planner"] == hostile
    assert data["scene"]["decorations"][0]["kind"] == hostile[:-1]


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_a_value_that_is_no_number_is_refused_and_named(flight, value):
    x = flight.x.copy()
    x[3, 0, 1] = value
    with pytest.raises(InputError, match=r"mine: position .* not finite"):
        replay_page([dataclasses.replace(flight, x=x)], sources=["mine"])


def test_a_prediction_at_a_time_that_was_not_flown_is_refused(flight):
    plan = flight.plan.copy()
    plan["step"][-1] = flight.steps + 7
    with pytest.raises(InputError, match=r"plan\.csv predicts"):
        flight_data(dataclasses.replace(flight, plan=plan), "mine")


def test_one_or_two_flights_make_a_page(flight, plain):
    assert [entry["planner"] for entry in embedded(replay_page([flight, plain]))] == [
        "nearest-waypoint"
    ] * 2
    with pytest.raises(ValueError, match="0 flights"):
        replay_page([])
    with pytest.raises(ValueError, match="3 flights"):
        replay_page([plain] * 3)


@pytest.mark.parametrize(
    "scenario", [load_scenario("village"), generate_scenario(4)], ids=lambda s: s.name
)
def test_bodies_are_closed_and_seen_from_outside(scenario):
    flight = rollout(scenario, load_planner("hover"), max_steps=1)
    scene = scene_data(SceneHistory.of(flight))
    for body in (scene["fence"], *scene["obstacles"]):
        corners = np.array(body["corners"])
        triangles = corners[np.array(body["triangles"])]
        crosses = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        outwards = triangles.mean(axis=1) - corners.mean(axis=0)
        assert (np.einsum("ij,ij->i", crosses, outwards) > 0).all()
        # the areas of a closed body, as vectors, sum to nothing
        np.testing.assert_allclose(crosses.sum(axis=0), 0.0, atol=1e-6 * np.abs(crosses).sum())
        outline = np.array(body["outline"])
        assert (outline.min(axis=0) == corners[:, :2].min(axis=0)).all()
        assert (outline.max(axis=0) == corners[:, :2].max(axis=0)).all()
