"""`uas-coverage compare --vary`: which options of a planner are worth flying."""

import json

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.front import choices_of, front_cells, front_figure
from uas_coverage_env.leaderboard.planner_specs import planner_specs_of


def flown(settings, steps, energy_Wh, **changes):
    given = {"planner": "p", "options": json.dumps({"w": settings}), "flew": 2, **changes}
    return row("yard", settings, steps=steps, energy_Wh=energy_Wh, **given)


def test_on_the_front_is_what_no_other_flight_beats():
    rows = [
        *(flown("slow", 120, 9.0, flew=1), flown("quick", 100, 11.0), flown("between", 110, 10.0)),
        *(flown("worse", 112, 10.5), flown("as good as quick", 100, 11.0)),
        *(flown("cheap", 90, 1.0, accomplished=False), failed_row("yard", "none", planner="p")),
    ]
    found = choices_of(rows, ["w"], 0.5, {("yard", 120): 8.0})
    assert [one.time_s for one in found] == sorted(one.time_s for one in found)
    front = {one.settings.removeprefix("w ") for one in found if one.on_front}
    assert front == {"as good as quick", "between", "slow"}
    assert {one.settings for one in found} & {"w cheap", "w none"} == set()
    assert front_cells(found)[1][-1] == ["w slow", "1", "60", "9.00", "12.5", "yes"]


def test_of_several_seeds_a_choice_has_the_means_and_counts_where_all_accomplish():
    rows = [
        *(flown("a", 100, 10.0), flown("a", 120, 12.0, seed=1)),
        *(flown("b", 90, 9.0), flown("b", 1, 1.0, seed=1, accomplished=False)),
    ]
    b, a = choices_of(rows, ["w"], 1.0, {})
    assert (a.time_s, a.energy_Wh, a.accomplished, a.flown) == (110.0, 11.0, 2, 2)
    assert (b.settings, b.accomplished, b.flown, b.on_front) == ("w b", 1, 2, False)
    assert a.on_front
    headings, cells = front_cells([b, a])
    assert cells[0][headings.index("accomplished")] == "1/2"


def test_of_several_planners_a_choice_names_its_own():
    found = choices_of([flown("a", 100, 10.0), flown("b", 90, 11.0, planner="q")], ["w"], 1.0, {})
    assert [one.settings for one in found] == ["q, w b", "p, w a"]


def test_the_picture_has_a_panel_for_each_mission():
    found = choices_of([flown("a", 100, 10.0), flown("b", 120, 9.0)], ["w"], 1.0, {})
    figure = front_figure({"one": found, "two": found})
    assert [axes.get_title() for axes in figure.axes if axes.axison] == ["one", "two"]


def test_all_combinations_of_values_are_flown():
    vary = ["filter=true,false", "return_mode=true,false,true"]
    specs = planner_specs_of(["lawnmower"], [], vary)
    assert len(specs) == 4
    options = [(s.options["filter"], s.options["return_mode"]) for s in specs.values()]
    assert sorted(options) == [(False, False), (False, True), (True, False), (True, True)]
    assert next(iter(specs)) == "lawnmower+filter-true+return_mode-true"


def test_what_is_varied_of_one_planner_leaves_the_others_as_they_are():
    specs = planner_specs_of(["hover,lawnmower"], [], ["lawnmower:filter=true,false"])
    assert list(specs) == ["hover", "lawnmower+filter-true", "lawnmower+filter-false"]


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        (["filter"], "KEY=VALUE"),
        (["filter="], "KEY=VALUE"),
        (["=true"], "KEY=VALUE"),
        (["filter=true", "filter=false"], "given twice"),
        (["filter=true", "lawnmower:filter=false"], "given twice"),
        (["hover:filter=true"], "no 'hover' in --planners lawnmower"),
        (["return_mode=true"], "--option lawnmower:return_mode gives it, too"),
        (["filtr=true"], "filter"),
        (["filter=perhaps"], "filter"),
    ],
)
def test_what_cannot_be_varied_is_refused_in_one_line(vary, said):
    with pytest.raises(InputError, match=said) as error:
        planner_specs_of(["lawnmower"], ["lawnmower:return_mode=true"], vary)
    assert "\n" not in str(error.value)


def test_a_front_is_flown_once_drawn_and_kept(yard, tmp_path, capsys):
    words = ["compare", "--scenarios", str(yard), "--planners", "lawnmower", "--seeds", "0:1"]
    words += ["--vary", "filter=true,false", "--jobs", "1", "--out", str(tmp_path / "front")]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "2 flights to fly" in out
    assert "yard: time against energy" in out
    assert (tmp_path / "front" / "front.png").stat().st_size > 1000
    table = (tmp_path / "front" / "front.md").read_text()
    assert "--vary filter=true,false" in table
    assert table.count("| yes |") == 1
    assert main(["show", str(tmp_path / "front/flights/yard-lawnmower+filter-true-0")]) == 0
    assert main(words) == 0
    assert "2 of 2 flights are there" in capsys.readouterr().out
