"""Who flew: in the record of each decision, in the directory of a flight and in its figures."""

from small_worlds import meadow, waypoint

from uas_coverage_env import rollout
from uas_coverage_env.flight import Decision, Flight
from uas_coverage_env.flight.figures import computed, printed, rows_part, summary
from uas_coverage_env.flight.metrics import by_others_share
from uas_coverage_env.world import GoTo, Velocity

FIELD = meadow(waypoints=[waypoint((40.0, 60.0, -10.0))])


class Says:
    """Hovers, says who flew at which step, and sends UAS to a waypoint in others."""

    def __init__(self, by=(), guided=()):
        self.by, self.guided = by, guided

    def reset(self, brief, seed):
        self.last_decision = None

    def act(self, swarm):
        self.last_decision = Decision(flown_by=self.by[swarm.step : swarm.step + 1])
        if swarm.step in self.guided:
            return {name: GoTo(0) for name in swarm.active}
        return {name: Velocity(0.0, 0.0, 5.0) for name in swarm.active}


def flown(planner, steps=4, **settings):
    return rollout(FIELD, planner, max_steps=steps, **settings)


def test_what_a_planner_says_of_who_flew_is_kept_in_the_record_and_in_its_directory(tmp_path):
    flight = flown(Says(by=("tour", "tour", "other")))
    said = [decision.flown_by for decision in flight.decisions]
    assert said == [("tour",), ("tour",), ("other",), ()]
    flight.save(tmp_path)
    assert [decision.flown_by for decision in Flight.load(tmp_path).decisions] == said


def test_a_waypoint_that_is_named_is_flown_to_by_guidance_for_every_planner():
    flight = flown(Says(by=("tour",), guided=(0, 2)))
    assert [decision.flown_by for decision in flight.decisions] == [
        ("tour", "guidance"), (), ("guidance",), (),
    ]  # fmt: skip


def test_the_way_home_by_guidance_is_no_other_planner():
    class Home(Says):
        def act(self, swarm):
            return {name: GoTo(None) for name in swarm.active}

    assert not any(decision.flown_by for decision in flown(Home(), steps=2).decisions)


def test_the_share_flown_by_others_is_in_summary_show_and_rows():
    flight = flown(Says(by=("tour",), guided=(0, 2)))
    assert summary(flight)["flown_by"] == {"guidance": 0.5, "tour": 0.25}
    assert printed(flight)["flown by"] == "guidance 50%, tour 25%"
    assert by_others_share(flight) == 0.5
    assert rows_part(computed(flight)[0])["by_others_share"] == 0.5


def test_a_planner_that_flew_alone_has_no_such_entry():
    flight = flown(Says())
    assert "flown_by" not in summary(flight)
    assert by_others_share(flight) == 0.0
