"""Steps between visits: taken away, moved and counted, with programs that are easily solved.

Each stretch asks for so many steps; each that is missing violates by 1, and its price says so.
"""

import numpy as np
import pytest
from uas_coverage_baselines.trajectory import retiming
from uas_coverage_baselines.trajectory.program import PlannedFlight
from uas_coverage_baselines.trajectory.retiming import draft, finished, repair, shorten, stretches
from uas_coverage_baselines.trajectory.work import done

START = np.zeros(10)


class Program:
    """Asks for so many steps of each stretch."""

    def __init__(self, *needed):
        self.needed, self.solved, self.tried = np.array(needed), 0, []

    def solve(self, start, route, visits, guess, inputs, rounds):
        self.solved += 1
        self.tried.append(len(guess) - 1)
        return self.flight(*np.diff([0, *visits, len(guess) - 1]))

    def flight(self, *lengths):
        """The flight whose stretches have so many steps, with what it costs to wait in each."""
        missing, steps = self.needed - lengths, sum(lengths)
        x, costate = np.zeros((steps + 1, 10)), np.zeros((steps, 10))
        x[:, 0] = np.arange(steps + 1)
        costate[:, 0] = -np.repeat(missing, lengths)
        violation, visits = float(np.maximum(missing, 0).sum()), np.cumsum(lengths)[:-1]
        return PlannedFlight(visits, x, np.zeros((steps, 3)), costate, violation, 0.0 * visits)


@pytest.fixture(autouse=True)
def visited_where_told(monkeypatch):
    monkeypatch.setattr(retiming, "deepest_visits", lambda program, flight, route: flight.visits)


def lengths_of(flight):
    return stretches(flight)[1].tolist()


ROUTE = np.arange(3)


@pytest.mark.parametrize(
    "begun", [(9, 9, 9, 9), (4, 6, 30, 5), (20, 6, 3, 5), (4, 7, 3, 25), (4, 6, 3, 5)]
)
def test_steps_are_taken_away_until_each_stretch_has_what_it_asks_for(begun):
    program = Program(4, 6, 3, 5)
    found = done(shorten(program, START, ROUTE, program.flight(*begun), 10**4))
    assert lengths_of(found) == [4, 6, 3, 5]
    assert found.is_clear


def test_a_stretch_that_is_short_gets_steps_of_one_that_has_some_to_spare():
    program = Program(4, 6, 3, 5)
    for begun in ((2, 8, 3, 5), (4, 6, 6, 2), (6, 4, 3, 5), (4, 9, 1, 4)):
        mended = done(repair(program, START, ROUTE, program.flight(*begun), 12))
        assert lengths_of(mended) == [4, 6, 3, 5]


def test_where_every_step_is_missing_somewhere_nothing_is_moved_and_few_are_tried():
    program = Program(5, 5, 5, 5)
    short = program.flight(4, 4, 4, 4)
    assert done(repair(program, START, ROUTE, short, 12)) is short
    assert 0 < program.solved <= 4
    assert set(program.tried) == {16}
    clear = program.flight(5, 5, 5, 5)
    before = program.solved
    assert done(repair(program, START, ROUTE, clear, 12)) is clear
    assert program.solved == before, "there is nothing to mend"


def test_no_step_is_taken_from_where_it_is_worth_more_than_where_it_goes():
    program = Program(5, 5)
    short = program.flight(4, 2)
    assert done(repair(program, START, ROUTE[:1], short, 12)) is short
    assert program.solved == 1, "from the first stretch to the second, which helps as much"


def test_a_repair_has_so_many_tries():
    program = Program(9, 1)
    begun = program.flight(4, 10)
    for tries in (0, 1, 3):
        mended = done(repair(program, START, ROUTE[:1], begun, tries))
        assert lengths_of(mended) == [4 + tries, 10 - tries]


def test_no_visit_is_moved_to_the_start():
    program = Program(0, 3)
    found = done(shorten(program, START, ROUTE[:1], program.flight(3, 3), 100))
    assert lengths_of(found) == [1, 3]


def test_a_search_ends_with_its_budget():
    program = Program(1, 1, 1, 1)
    begun = program.flight(9, 9, 9, 9)
    assert done(shorten(program, START, ROUTE, begun, 0)) is begun
    found = done(shorten(program, START, ROUTE, begun, 5))
    assert (program.solved, found.steps) == (5, 31)


@pytest.mark.parametrize(("steps", "share"), [(100, 1.0), (400, 1.0), (800, 0.5), (1600, 0.25)])
def test_a_long_flight_has_a_smaller_budget_in_programs(monkeypatch, steps, share):
    program = Program(0, 0)
    program.solved = 7  # of the first flight

    def first(*_):
        yield from ()
        return program.flight(steps // 2, steps // 2)

    monkeypatch.setattr(retiming, "first_flight", first)
    monkeypatch.setattr(retiming, "_LAST_SHARE", 1.0)  # nothing is done yet
    begun = done(draft(program, None, 0, START, ROUTE[:1], 40))
    assert begun.left == round(40 * share)
    finishing = done(finished(program, START, ROUTE[:1], begun))
    assert program.solved == 7 + begun.left
    assert finishing.steps == steps - begun.left


def test_a_first_flight_that_violates_something_is_not_made_shorter(monkeypatch):
    program = Program(9, 9)

    def first(*_):
        yield from ()
        return program.flight(8, 9)

    monkeypatch.setattr(retiming, "first_flight", first)
    assert done(draft(program, None, 0, START, ROUTE[:1], 40)).left == 0
    assert program.solved == 0


def test_all_stretches_are_made_shorter_at_once_down_to_what_each_asks_for(monkeypatch):
    program = Program(30, 41, 7, 55)

    def first(*_):
        yield from ()
        return program.flight(60, 60, 60, 60)

    monkeypatch.setattr(retiming, "first_flight", first)
    begun = done(draft(program, None, 0, START, ROUTE, 60))
    assert begun.flight.is_clear
    # a few steps are left to be taken away one by one; without it that would be 107
    assert begun.flight.steps <= 133 + 12
    assert (np.array(lengths_of(begun.flight)) >= program.needed).all()
    assert begun.left == 60 - program.solved


def test_a_stretch_in_which_time_is_dear_gets_its_steps_back_and_no_other_does(monkeypatch):
    program = Program(60, 1, 1, 1)

    def first(*_):
        yield from ()
        return program.flight(60, 60, 60, 60)

    monkeypatch.setattr(retiming, "first_flight", first)
    begun = done(draft(program, None, 0, START, ROUTE, 6))
    assert lengths_of(begun.flight) == [60, 45, 45, 45]
