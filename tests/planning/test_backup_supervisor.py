"""Two guarantees of a set of backups: each comes home, all keep apart; and what replaces it."""

import numpy as np
import pytest
from backup_worlds import BRAKING, World, straight, supervisor_of

from uas_coverage_env.planning.backup.course import are_apart, braked
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle import layout as S

HERE, BESIDE, BEYOND = (0.0, 0.0, -20.0), (0.0, 40.0, -20.0), (0.0, 80.0, -20.0)
STILL = (0.0, 0.0, 0.0)
NORTH, EAST, WEST = (6.0, 0.0, 0.0), (0.0, 6.0, 0.0), (0.0, -6.0, 0.0)


def north(place=HERE, steps=10, **known):
    return straight(place, NORTH, steps, **known)


def hover(place, steps=30):
    return straight(place, STILL, steps, lands=False)


def renewed(supervisor, world, wanted, step=0, landing=(), **states):
    """Which of the wanted courses are followed; states of the others by `x0=`."""
    x = {u: course.x[0] for u, course in wanted.items()}
    x |= {int(name[1:]): state for name, state in states.items()}
    x |= {u: course.x[0] for u, course in dict(landing).items()}
    return supervisor.renew(world, step, dict(sorted(x.items())), wanted, dict(landing))


def by_hand(course, followed, steps=BRAKING):
    return braked(compile_vehicle(load_vehicle("s500_v2"), 1.0)[()], course, followed, steps)


def longest_within(course, north_m, since=0):
    """For how many steps it may be followed and stay, from a sample on, within a distance."""
    reach_m = [by_hand(course, k).x[since:, 0].max() for k in range(1, len(course.u) + 1)]
    return int(np.flatnonzero(np.array(reach_m) <= north_m).max()) + 1


def same(one, other):
    return np.array_equal(one.x, other.x) and np.array_equal(one.u, other.u)


# what is left, and what is done without it


def test_what_is_left_of_a_backup_is_kept_where_it_begins_here_and_is_clear():
    supervisor, course = supervisor_of(), north()
    supervisor.backups = {0: course}
    assert renewed(supervisor, World(), {}, 3, x0=course.x[3]) == set()
    left = supervisor.backups[0]
    assert (left.begin, left.lands) == (3, True)
    assert same(left, course.rest(3))
    moved = course.x[4].copy()
    moved[1] += 0.1
    for world, x in ((World(), moved), (World(crossed_m=50.0), course.x[4])):
        supervisor.backups = {0: course}
        renewed(supervisor, world, {}, 4, x0=x)
        stop = supervisor.backups[0]
        assert (stop.begin, stop.lands, len(stop.u)) == (4, False, BRAKING)
        np.testing.assert_array_equal(stop.x[0], x)


def test_a_uas_that_cannot_even_stop_has_no_backup():
    supervisor, x = supervisor_of(), north().x[3]
    assert renewed(supervisor, World(wall_m=20.0), {}, x0=x) == set()
    assert supervisor.backups == {}
    world = World(wall_m=30.0)
    renewed(supervisor, world, {}, x0=x)
    assert supervisor.backups.keys() == {0}
    assert world.stops == [(0, 0, BRAKING)]


def test_one_that_wants_a_course_does_not_stop_for_want_of_a_backup():
    supervisor = supervisor_of()
    assert renewed(supervisor, World(crossed_m=-1.0), {0: north()}) == set()
    assert supervisor.backups == {}


def test_what_lands_where_it_is_takes_no_other_backup():
    supervisor = supervisor_of(2)
    supervisor.backups = {0: hover(HERE), 1: hover(BESIDE)}
    landing = straight(HERE, STILL, 1)
    assert renewed(supervisor, World(), {}, landing={0: landing}, x1=hover(BESIDE).x[0]) == set()
    assert supervisor.backups[0] is landing
    assert same(supervisor.backups[1], hover(BESIDE))


def test_backups_of_what_flies_no_more_are_forgotten():
    supervisor = supervisor_of(2)
    supervisor.backups = {0: hover(HERE), 1: hover(BESIDE)}
    renewed(supervisor, World(), {}, x0=hover(HERE).x[0])
    assert supervisor.backups.keys() == {0}


# comes home


def test_a_course_that_lands_is_its_own_backup():
    supervisor, course, world = supervisor_of(), north(), World(home_m=-1.0, wall_m=-1.0)
    assert renewed(supervisor, world, {0: course}) == {0}
    assert supervisor.backups[0] is course
    assert not world.hovers


def test_a_course_that_hovers_at_its_end_is_braked_and_has_to_come_home():
    supervisor, course = supervisor_of(), north(lands=False)
    assert renewed(supervisor, World(), {0: course}) == {0}
    assert same(supervisor.backups[0], by_hand(course, 10))
    supervisor = supervisor_of()
    assert renewed(supervisor, World(home_m=40.0), {0: course}) == {0}
    assert same(supervisor.backups[0], by_hand(course, longest_within(course, 40.0, -1)))


@pytest.mark.parametrize("limit", ["wall_m", "crossed_m", "home_m"])
def test_a_course_is_followed_as_long_as_its_hover_is_clear_and_has_charge(limit):
    supervisor, course = supervisor_of(), north()
    world = World(**({"crossed_m": 59.0} | {limit: 45.0}))
    assert renewed(supervisor, world, {0: course}) == {0}
    followed = longest_within(course, 45.0, -1 if limit == "home_m" else 0)
    assert 1 < followed < 8
    assert same(supervisor.backups[0], by_hand(course, followed))
    hovers = np.array([x for _, x in world.hovers])
    assert np.linalg.norm(hovers[:, S.VX : S.VZ + 1], axis=1).max() < 0.1


@pytest.mark.parametrize("limit", ["wall_m", "crossed_m"])
def test_one_step_is_followed_where_no_more_is_possible(limit):
    supervisor, course = supervisor_of(), north()
    world = World(**({"crossed_m": 59.0} | {limit: by_hand(course, 1).x[:, 0].max() + 0.1}))
    assert renewed(supervisor, world, {0: course}) == {0}
    assert same(supervisor.backups[0], by_hand(course, 1))


@pytest.mark.parametrize("limit", ["wall_m", "home_m"])
def test_a_course_whose_first_step_leads_too_far_is_not_followed(limit):
    supervisor, course = supervisor_of(), north()
    world = World(crossed_m=59.0, **{limit: course.x[1, 0]})
    supervisor.backups = {0: hover(HERE)}
    assert renewed(supervisor, world, {0: course}) == set()
    assert same(supervisor.backups[0], hover(HERE))


def test_a_course_is_followed_for_thirty_steps_at_most_and_an_empty_one_not_at_all():
    supervisor, course = supervisor_of(), straight(HERE, (2.0, 0.0, 0.0), 40)
    assert renewed(supervisor, World(crossed_m=79.0), {0: course}) == {0}
    assert same(supervisor.backups[0], by_hand(course, 30))
    assert renewed(supervisor, World(), {0: course.rest(40)}) == set()


# all apart


def apart(supervisor, keep_m=6.0):
    names = list(supervisor.backups)
    return all(
        are_apart(supervisor.backups[i], supervisor.backups[j], keep_m)
        for k, i in enumerate(names)
        for j in names[:k]
    )


def test_courses_that_keep_apart_replace_all_backups_at_once():
    supervisor, wanted = supervisor_of(3), {0: north(), 1: north(BESIDE), 2: north(BEYOND)}
    assert renewed(supervisor, World(), wanted) == {0, 1, 2}
    assert supervisor.backups == wanted


def test_a_file_of_uas_of_which_each_takes_the_next_one_s_place_moves_at_once():
    places = [(15.0 * k, 0.0, -20.0) for k in range(4)]
    supervisor = supervisor_of(4)
    supervisor.backups = {u: hover(place) for u, place in enumerate(places)}
    wanted = {u: straight(place, (5.0, 0.0, 0.0), 3) for u, place in enumerate(places)}
    assert renewed(supervisor, World(), wanted) == {0, 1, 2, 3}
    # one by one, where a fifth is in the way of the last
    supervisor = supervisor_of(5)
    supervisor.backups = {u: hover(place) for u, place in enumerate([*places, (60.0, 0.0, -20.0)])}
    assert renewed(supervisor, World(), wanted, x4=supervisor.backups[4].x[0]) == set()


def test_one_by_one_new_courses_are_tried_in_two_rounds():
    # in turn, each takes the next one's place, and two others, far off, are in their way
    places = [(15.0 * k, 0.0, -20.0) for k in range(4)] + [(0.0, 90.0, -20.0), (15.0, 90.0, -20.0)]
    supervisor = supervisor_of(6)
    supervisor.backups = {u: hover(place) for u, place in enumerate(places)}
    wanted = {u: straight(places[u], (5.0, 0.0, 0.0), 3) for u in range(5)}
    still = supervisor.backups[5].x[0]
    assert renewed(supervisor, World(), wanted, x5=still) == {3, 2}


@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (0, 2)])
def test_of_two_that_meet_the_first_that_is_asked_for_wins(pair):
    places = HERE, BESIDE, BEYOND
    first, second = pair
    n = 14 if pair == (0, 2) else 8
    courses = {
        first: straight(places[first], EAST, n),
        second: straight(places[second], WEST, n),
    }
    for order in (pair, pair[::-1]):
        supervisor = supervisor_of(3)
        assert renewed(supervisor, World(), {u: courses[u] for u in order}) == {order[0]}
        assert supervisor.backups == {order[0]: courses[order[0]]}


def test_a_course_is_not_flown_through_a_backup_that_is_kept():
    supervisor = supervisor_of(2)
    supervisor.backups = {1: hover(BESIDE)}
    assert (
        renewed(supervisor, World(), {0: straight(HERE, EAST, 12)}, x1=hover(BESIDE).x[0]) == set()
    )
    assert supervisor.backups.keys() == {1}


def test_one_that_was_in_the_way_and_leaves_it_lets_another_follow():
    supervisor = supervisor_of(2)
    supervisor.backups = {1: hover(BESIDE)}
    wanted = {0: straight(HERE, EAST, 12), 1: north(BESIDE, 12)}
    assert renewed(supervisor, World(), wanted) == {0, 1}
    # likewise where the set as a whole does not hold, since another is in the third's way
    supervisor = supervisor_of(4)
    supervisor.backups = {1: hover(BESIDE), 3: hover((0.0, 100.0, -20.0))}
    wanted[2] = straight(BEYOND, EAST, 5)
    still = supervisor.backups[3].x[0]
    assert renewed(supervisor, World(), wanted, x3=still) == {0, 1}
    assert apart(supervisor)


def test_whatever_is_wanted_the_set_keeps_apart_and_holds_what_was_held():
    draw = np.random.default_rng(3)
    places = HERE, BESIDE, BEYOND
    for _ in range(20):
        supervisor = supervisor_of(3)
        supervisor.backups = {u: hover(place) for u, place in enumerate(places)}
        ways = draw.uniform(-8.0, 8.0, (3, 3)) * (1.0, 1.0, 0.0)
        wanted = {u: straight(places[u], ways[u], int(draw.integers(3, 15))) for u in range(3)}
        order = draw.permutation(3).tolist()
        follow = renewed(supervisor, World(), {u: wanted[u] for u in order})
        assert supervisor.backups.keys() == {0, 1, 2}
        assert apart(supervisor)
        assert order[0] in follow or len(follow) < 3
        for u in range(3):
            assert same(supervisor.backups[u], wanted[u] if u in follow else hover(places[u]))


@pytest.mark.parametrize("seed", range(4))
def test_once_there_is_a_set_there_is_one_at_every_later_decision(seed):
    draw = np.random.default_rng(seed)
    supervisor, world = supervisor_of(3), World(wall_m=60.0, crossed_m=60.0, home_m=45.0)
    supervisor.backups = {u: hover(place) for u, place in enumerate((HERE, BESIDE, BEYOND))}
    followed = 0
    for step in range(60):
        x = {u: backup.rest(step).x[0] for u, backup in supervisor.backups.items()}
        wanted = {}
        for u in draw.permutation(3)[: draw.integers(0, 4)].tolist():
            way = draw.uniform(-8.0, 8.0, 3) * (1.0, 1.0, 0.0)
            wanted[u] = straight(x[u][:3], way, int(draw.integers(1, 15)), begin=step, lands=False)
        followed += len(supervisor.renew(world, step, x, wanted, {}))
        assert supervisor.backups.keys() == {0, 1, 2}
        assert apart(supervisor)
        for u, backup in supervisor.backups.items():
            np.testing.assert_allclose(backup.x[0, :3], x[u][:3])
            assert backup.x[-1, 0] <= 45.0
            assert backup.x[:, 0].max() <= 60.0
    assert followed > 20


# sets that are verified as a whole


def teams(world, *courses):
    supervisor = supervisor_of(len(courses))
    return list(supervisor.teams(world, dict(enumerate(courses))))


def test_the_first_set_is_each_as_long_as_it_is_clear_of_those_before_it():
    first, second = north(lands=False), straight((72.0, -66.0, -20.0), EAST, 10, lands=False)
    (followed, team), *others = teams(World(), first, second)
    assert followed[0] == 10
    assert 1 < followed[1] < 10
    assert are_apart(team[0], team[1], 6.0)
    longer = by_hand(second, followed[1] + 1, len(team[0].u) - followed[1] - 1)
    assert not are_apart(team[0], longer, 6.0)
    for uas, course in enumerate((first, second)):
        assert same(team[uas], by_hand(course, followed[uas], 24 - followed[uas]))
    assert [f for f, _ in others] == [{0: n, 1: n} for n in range(10, 0, -1)]
    assert [len(team[0].u) for _, team in others] == [n + BRAKING for n in range(10, 0, -1)]


def test_where_one_is_left_without_all_follow_theirs_equally_long():
    first, second = north(steps=4), hover((24.0, 0.0, -20.0), 4)
    found = teams(World(), first, second)
    assert [f for f, _ in found] == [{0: n, 1: n} for n in range(4, 0, -1)]


def test_each_of_a_set_comes_home_from_its_hover_and_from_the_end_of_it():
    world = World(home_m=40.0)
    first, second = north(steps=8), straight(BESIDE, STILL, 8)
    (followed, team), *others = teams(world, first, second)
    assert followed == {0: longest_within(first, 40.0, -1), 1: 8}
    assert {len(course.u) for course in team.values()} == {8 + BRAKING}
    assert [f[0] for f, _ in others] == list(range(followed[0], 0, -1))
    asked = {uas for uas, _ in world.hovers}
    assert asked == {0, 1}


@pytest.mark.parametrize("hovers", [3 + BRAKING, 8 + BRAKING - 1])
def test_a_set_in_which_one_hovers_until_its_charge_is_gone_is_left_out(hovers):
    class Draining(World):
        """Each second of hovering takes charge; it is the states that say how long."""

        def comes_home(self, uas, x):
            return uas == 1 or x[S.DOD] <= self.most

    first, second = north(steps=8, lands=False), straight(BESIDE, STILL, 8, lands=False)
    first.x[:, S.DOD] = 2e-2 * np.arange(9)
    world = Draining()
    ends = [by_hand(first, n, 22 - n).x[:, S.DOD] for n in range(1, 9)]
    world.most = ends[2][hovers] + 1e-9  # enough for three steps, and to hover until then
    found = teams(world, first, second)
    assert found[0][0] == {0: 3, 1: 3}
    assert ends[2][-1] > world.most


def test_a_stop_is_asked_about_with_how_long_the_course_was_followed():
    world = World(wall_m=30.0)
    teams(world, north(steps=5, lands=False))
    assert [followed for _, followed, _ in world.stops] == list(range(5, 5 - len(world.stops), -1))
    assert {steps for *_, steps in world.stops} == {5 + BRAKING}
