"""The paper's figures beside those of flights that are known, and what leaves its tolerance."""

import dataclasses

import numpy as np
import pytest
from told_flights import as_told, flight
from uas_coverage_baselines.reproduction.comparison import ReproducedPaper
from uas_coverage_baselines.reproduction.figures import UasFigures, figures_of
from uas_coverage_baselines.reproduction.published import (
    Curves,
    Paper,
    paper_named,
    published_curves,
)
from uas_coverage_baselines.reproduction.settings import FLOWN

from uas_coverage_env import simulate_battery
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import energy_Wh
from uas_coverage_env.replay.figures import published_battery
from uas_coverage_env.scenario.families.flood_village import flood_village
from uas_coverage_env.vehicle import load_vehicle

PAPER = paper_named("gasche2025")
TABLE_I = {
    "horizon": 18,
    "obstacle_sides": 8,
    "limit_sides": 8,
    "waypoint_sides": 4,
}


def told(**changed):
    return dataclasses.replace(as_told(), planner_options=TABLE_I, **changed)


def reproduced(main=None, *drawn) -> ReproducedPaper:
    flights = {PAPER.scenario: main or told()}
    return ReproducedPaper.of(PAPER, flights | {f"drawn-{k}": some for k, some in enumerate(drawn)})


def line(done, name, uas):
    (found,) = [one for one in done.figures if (one.figure.name, one.uas) == (name, uas)]
    return found


def test_an_unknown_paper_is_refused_with_the_names_there_are():
    with pytest.raises(InputError, match="gasche2025"):
        paper_named("gasche1905")


def test_every_figure_and_setting_of_the_paper_can_be_read_and_says_why_it_may_differ():
    fields = {field.name for field in dataclasses.fields(UasFigures)}
    assert {figure.name for figure in PAPER.figures} <= fields
    assert all(figure.reason and figure.tolerance > 0.0 for figure in PAPER.figures)
    assert {setting.symbol for setting in PAPER.settings} == set(FLOWN)
    assert all(bool(setting.reason) == (setting.tolerance > 0.0) for setting in PAPER.settings)


def test_figures_follow_from_curves_by_their_definitions():
    curves = Curves(np.array([1.0, 0.9, 0.7]), np.array([10.0, 8.0]), np.array([2.0, 5.0]))
    figures = UasFigures.of(curves, dt_s=36.0)
    assert figures.steps == 2
    assert figures.energy_Wh == pytest.approx((20.0 + 40.0) * 36.0 / 3600.0)
    assert figures.final_charge == 0.7
    assert (figures.least_power_W, figures.largest_power_W) == (20.0, 40.0)
    assert (figures.mean_power_W, figures.mean_current_A) == (30.0, 3.5)
    assert (figures.least_voltage_V, figures.mean_voltage_V) == (8.0, 9.0)


def test_figures_of_a_flight_agree_with_its_summary_and_leave_the_landed_out():
    some = flight({}, steps=(90, 40), power=(200.0, 150.0), voltage=(16.0, 15.0))
    one, two = figures_of(some)
    assert (one.steps, two.steps) == (90, 40)
    assert (one.mean_power_W, two.least_power_W) == (pytest.approx(200.0), pytest.approx(150.0))
    assert [one.energy_Wh, two.energy_Wh] == pytest.approx(list(energy_Wh(some)))
    assert one.energy_Wh + two.energy_Wh == pytest.approx(summary(some)["energy_Wh"])


def test_the_papers_curves_agree_with_themselves():
    # charge and current are drawn independently: what was taken is what is missing
    for curves, uas in zip(published_curves(), ("uas1", "uas2"), strict=True):
        table = published_battery()
        assert (table[f"current_{uas}_A"][len(curves.current_A) :] == 0.0).all()
        assert (curves.current_A > 0.0).all()
        taken = curves.current_A.sum() / 3600.0 / load_vehicle("s500_v2").battery.capacity_Ah
        assert curves.soc[0] - curves.soc[-1] == pytest.approx(taken, abs=1e-3)
        soc, _ = simulate_battery(load_vehicle("s500_v2"), curves.current_A, curves.soc[0])
        assert soc[-1] == pytest.approx(curves.soc[len(soc) - 1], abs=1e-3)


def test_a_figure_is_kept_up_to_its_tolerance_and_not_beyond():
    paper = line(reproduced(), "mean_power_W", "uas_1").paper
    tolerance = line(reproduced(), "mean_power_W", "uas_1").figure.tolerance
    for share, kept in ((0.9, True), (-0.9, True), (1.1, False), (-1.1, False)):
        power = paper * (1.0 + share * tolerance)
        main = flight({}, power=(power, 180.0), planner_options=TABLE_I)
        done = reproduced(main)
        found = line(done, "mean_power_W", "uas_1")
        assert found.ours == pytest.approx(power)
        assert found.difference == pytest.approx(share * tolerance)
        assert found.within == kept
        named = any(text.startswith("mean power of uas_1") for text in done.failures())
        assert named != kept


def test_intervals_are_over_the_drawn_maps():
    drawn = [flight({}, steps=(n, 100)) for n in (200, 220, 240, 260)]
    found = line(reproduced(None, *drawn), "steps", "uas_1")
    assert found.drawn == (200, 220, 240, 260)
    assert 200 <= found.mean.low < found.mean.value < found.mean.high <= 260
    alone = line(reproduced(), "steps", "uas_1")
    assert alone.drawn == ()
    assert alone.mean.value is None


def test_table_one_is_read_back_from_the_flight():
    assert all(one.within for one in reproduced().settings)
    other = told()
    short = other.scenario.model_copy(update={"max_steps": 400})
    done = reproduced(
        dataclasses.replace(other, scenario=short, planner_options=TABLE_I | {"horizon": 12})
    )
    wrong = {one.setting.symbol for one in done.settings if not one.within}
    assert wrong == {"N", "N_step,max"}
    assert any("N: flown with 12, the paper has 18" in text for text in done.failures())


def test_a_drawn_map_keeps_table_one():
    main = dataclasses.replace(told(), scenario=flood_village(3))
    assert all(one.within for one in reproduced(main).settings)


def test_what_did_not_happen_and_what_went_wrong_is_a_failure():
    assert not any("did not happen" in text for text in reproduced().failures())
    done = reproduced(flight({}, planner_options=TABLE_I), told(breaches=3))
    text = "\n".join(done.failures())
    assert "did not happen on gasche2025: the forest area is covered first" in text
    assert "gasche2025: the mission was not accomplished" in text
    assert "drawn-0: 3 breaches" in text


def test_a_paper_with_an_unknown_key_is_refused():
    with pytest.raises(ValueError, match="extra"):
        Paper.model_validate({**PAPER.model_dump(), "extra": 1})
