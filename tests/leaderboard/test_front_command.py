"""`uas-coverage front`: which options of a planner are worth flying."""

import json

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.front import choices_of, front_cells, front_figure, varied_specs


def flown(settings, steps, energy_Wh, **changes):
    return row(
        "yard",
        settings,
        options=json.dumps({"w": settings}),
        steps=steps,
        energy_Wh=energy_Wh,
        **changes,
    )


def test_on_the_front_is_what_no_other_flight_beats():
    rows = [
        *(flown("slow", 120, 9.0), flown("quick", 100, 11.0), flown("between", 110, 10.0)),
        *(flown("worse", 112, 10.5), flown("as good as quick", 100, 11.0)),
        *(flown("cheap", 90, 1.0, accomplished=False), failed_row("yard", "none")),
    ]
    found = choices_of(rows, ["w"], 0.5, {"slow": 1}, {("yard", 120): 8.0})
    assert [one.time_s for one in found] == sorted(one.time_s for one in found)
    front = {one.settings.removeprefix("w ") for one in found if one.on_front}
    assert front == {"as good as quick", "between", "slow"}
    assert {one.row.label for one in found} & {"cheap", "none"} == set()
    assert front_cells(found)[1][-1] == ["w slow", "1", "60", "9.00", "12.5", "yes"]


def test_the_picture_has_a_panel_for_each_mission():
    found = choices_of([flown("a", 100, 10.0), flown("b", 120, 9.0)], ["w"], 1.0, {"a": 2}, {})
    figure = front_figure({"one": found, "two": found})
    assert [axes.get_title() for axes in figure.axes if axes.axison] == ["one", "two"]


def test_all_combinations_of_values_are_flown():
    specs = varied_specs("lawnmower", ["filter=true,false", "return_mode=true,false,true"])
    assert len(specs) == 4
    options = [(s.options["filter"], s.options["return_mode"]) for s in specs.values()]
    assert sorted(options) == [(False, False), (False, True), (True, False), (True, True)]


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        (["filter"], "KEY=VALUE"),
        (["filter="], "KEY=VALUE"),
        (["filter=true", "filter=false"], "given twice"),
        (["filtr=true"], "filter"),
        (["filter=perhaps"], "filter"),
    ],
)
def test_what_cannot_be_varied_is_refused_in_one_line(vary, said):
    with pytest.raises(InputError, match=said) as error:
        varied_specs("lawnmower", vary)
    assert "\n" not in str(error.value)


def test_a_front_is_flown_once_drawn_and_kept(yard, tmp_path, capsys):
    words = ["front", str(yard), "--planner", "lawnmower", "--vary", "filter=true,false"]
    words += ["--jobs", "1", "--out", str(tmp_path / "front")]
    assert main(words) == 0
    out = capsys.readouterr().out
    assert "2 flights to fly" in out
    assert (tmp_path / "front" / "front.png").stat().st_size > 1000
    table = (tmp_path / "front" / "front.md").read_text()
    assert "uas-coverage front" in table
    assert table.count("| yes |") == 1
    assert main(["show", str(tmp_path / "front/flights/yard-filter-true-0")]) == 0
    assert main(words) == 0
    assert "2 of 2 flights are there" in capsys.readouterr().out


def test_a_planner_without_a_usual_option_needs_one_named(yard, tmp_path, capsys):
    assert main(["front", str(yard), "--planner", "hover", "--out", str(tmp_path / "f")]) == 2
    assert "--vary" in capsys.readouterr().err
