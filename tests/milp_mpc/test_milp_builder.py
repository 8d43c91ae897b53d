"""Families of rows and columns become one program, and the program judges its solutions."""

import highspy
import numpy as np
import pytest
from uas_coverage_baselines.milp_mpc.model.milp import ABSENT, Milp


def dense(built):
    """(R, C) the matrix of a program."""
    matrix = np.zeros((len(built.row_lower), len(built.lower)))
    for row in range(len(matrix)):
        span = slice(built.row_start[row], built.row_start[row + 1])
        np.add.at(matrix[row], built.column[span], built.coefficient[span])
    return matrix


def test_columns_keep_the_shape_of_the_mathematics():
    milp = Milp()
    first = milp.variables("first", (2, 3), lower=[[0.0], [1.0]], upper=9.0)
    second = milp.variables("second", (2,), lower=0.0, upper=1.0, integer=True)
    built = milp.build()
    assert first.shape == (2, 3)
    assert np.concatenate([first.ravel(), second]).tolist() == list(range(8))
    assert built.lower.tolist() == [0, 0, 0, 1, 1, 1, 0, 0]
    assert built.integer.tolist() == [False] * 6 + [True] * 2
    assert milp.column_names()[4] == "first(1,1)"
    assert milp.columns("second") is second
    with pytest.raises(ValueError, match="'third' are not there"):
        milp.columns("third")


def test_a_column_that_is_not_made_is_zero_wherever_it_is_used():
    milp = Milp()
    x = milp.variables("x", (3,), where=np.array([True, False, True]))
    milp.subject_to("sum", (np.array([1.0, 5.0, 2.0]), x), upper=4.0)
    milp.minimize([1.0, 7.0, 3.0], x)
    built = milp.build()
    assert x.tolist() == [0, ABSENT, 1]
    assert dense(built).tolist() == [[1.0, 2.0]]
    assert built.cost.tolist() == [1.0, 3.0]


def test_a_family_of_rows_sums_the_last_axis_and_broadcasts_the_others():
    milp = Milp()
    x, y = milp.variables("x", (2, 3)), milp.variables("y", (2,))
    A = np.arange(12.0).reshape(4, 3)
    milp.subject_to("rows", (A, x[:, None, :]), (-1.0, y[:, None, None]), upper=A[:, 0])
    built = milp.build()
    expected = np.zeros((2, 4, 8))
    for uas in range(2):
        expected[uas][:, x[uas]] = A
        expected[uas][:, y[uas]] = -1.0
    assert dense(built).tolist() == expected.reshape(8, 8).tolist()
    assert built.row_upper.tolist() == [0.0, 3.0, 6.0, 9.0] * 2
    assert milp.row_names()[5] == "rows(1,1)"


def test_rows_are_made_only_where_they_are_asked_for():
    milp = Milp()
    x = milp.variables("x", (4,))
    milp.subject_to("some", (1.0, x[:, None]), lower=np.arange(4.0), where=np.arange(4) > 1)
    milp.subject_to("none", (1.0, x[:, None]), lower=0.0, where=np.zeros(4, bool))
    built = milp.build()
    assert milp.row_names() == ["some(2)", "some(3)"]
    assert built.row_lower.tolist() == [2.0, 3.0]
    assert dense(built).tolist() == [[0, 0, 1, 0], [0, 0, 0, 1]]


def test_terms_of_the_same_column_add_up():
    milp = Milp()
    x = milp.variables("x", (1,))
    milp.subject_to("twice", (1.0, x), (2.5, x), upper=7.0)
    milp.minimize(1.0, x)
    milp.minimize(0.5, x)
    built = milp.build()
    assert dense(built).tolist() == [[3.5]]
    assert built.cost.tolist() == [1.5]
    assert built.violation(np.array([2.0])) == 0.0
    assert built.violation(np.array([3.0])) == pytest.approx(3.5)


def test_columns_whose_integrality_follows_may_take_any_value():
    milp = Milp()
    b = milp.variables("b", (3,), lower=0.0, upper=1.0, integer=True)
    milp.drop_integrality(np.array([b[1], ABSENT]))
    assert milp.build().integer.tolist() == [True, False, True]


@pytest.mark.parametrize(
    ("values", "worst"),
    [
        ([1.0, 2.0], 0.0),
        ([-0.25, 2.0], 0.25),
        ([1.0, 4.5], 0.5),
        ([3.0, 3.0], 1.0),
        ([1.0, 2.4], 0.4),
        ([np.nan, 2.0], np.inf),
        ([np.inf, 2.0], np.inf),
    ],
)
def test_a_solution_is_judged_by_its_worst_violation(values, worst):
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=4.0, integer=True)
    milp.drop_integrality(x[:1])
    milp.subject_to("sum", (1.0, x), upper=5.0)
    if values == [1.0, 4.5]:
        values = [0.5, 4.5]
    assert milp.build().violation(np.array(values)) == pytest.approx(worst)


def test_the_objective_has_its_constant():
    milp = Milp()
    x = milp.variables("x", (2,))
    milp.minimize([2.0, -1.0], x)
    milp.add_constant(3.0)
    milp.add_constant(-0.5)
    assert milp.build().objective(np.array([1.0, 4.0])) == pytest.approx(0.5)


def test_mistakes_in_a_formulation_are_named():
    milp = Milp()
    milp.variables("x", (2,))
    with pytest.raises(ValueError, match="'x' exist already"):
        milp.variables("x", (1,))
    with pytest.raises(ValueError, match="'y': a lower bound exceeds"):
        milp.variables("y", (2,), lower=[0.0, 2.0], upper=1.0)


def test_an_empty_program_can_be_built():
    built = Milp().build()
    assert built.violation(np.zeros(0)) == 0.0
    assert built.objective(np.zeros(0)) == 0.0


def test_the_text_says_what_the_program_is(tmp_path):
    milp = Milp()
    x = milp.variables("x", (2,), lower=0.0, upper=4.0)
    k = milp.variables("k", (1,), lower=0.0, upper=7.0, integer=True)
    b = milp.variables("b", (1,), lower=0.0, upper=1.0, integer=True)
    milp.subject_to("range", (np.array([1.0, -2.5]), x), (1.0, k), lower=-1.0, upper=3.0)
    milp.subject_to("equal", (1.0, x[:1]), (-1.0, b), lower=0.0, upper=0.0)
    milp.minimize([1.0, 0.0], x)
    text = milp.lp_text().splitlines()
    assert text[0:3] == ["minimize", " cost: + x(0)", "subject to"]
    assert text[3] == " range(): -1 <= + x(0) - 2.5 x(1) + k(0) <= 3"
    assert text[4] == " equal(): + x(0) - b(0) = 0"
    assert text[-5:] == ["binary", " b(0)", "general", " k(0)", "end"]
    milp.write_lp(tmp_path / "program.lp")
    assert (tmp_path / "program.lp").read_text(encoding="utf-8") == milp.lp_text()


@pytest.mark.parametrize("constant", [12.5, -3.0])
def test_a_program_written_as_text_keeps_its_constant(tmp_path, constant):
    milp = Milp()
    x = milp.variables("x", (1,), lower=2.0, upper=4.0)
    milp.minimize(1.0, x)
    milp.add_constant(constant)
    path = tmp_path / "program.lp"
    milp.write_lp(path)
    solver = highspy.Highs()
    solver.setOptionValue("output_flag", False)
    solver.readModel(str(path))
    solver.run()
    assert solver.getInfo().objective_function_value == pytest.approx(2.0 + constant)
