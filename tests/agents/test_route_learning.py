"""The imitation of `trajectory` by a route policy: labels, the order, then the flights."""

import numpy as np
from uas_coverage_agents.training import curve, route_learning
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.rounds import TrainingJob, learner_of, train
from uas_coverage_agents.training.route_learning import town_of
from uas_coverage_agents.training.settings import settings_of

TINY = (
    *("rounds=3", "size.n_uas=[1, 1]", "size.n_waypoints=[5, 6]", "size.n_obstacles=[0, 1]"),
    *("learning.towns=2", "learning.validation=1", "learning.order_epochs=3"),
    *("learning.flight_rounds=1", "learning.flight_epochs=1"),
)


def test_a_training_labels_learns_and_leaves_a_policy_that_covers_a_town(tmp_path, monkeypatch):
    monkeypatch.setattr(curve, "write", curve.write_table)
    settings = settings_of("learned-route", changes=TINY)
    (policy,) = train({tmp_path: TrainingJob("tiny", settings, 0, missions=1)}).values()
    described = policy.description
    assert described.interface == "route"
    assert described.training.steps > 3, "the towns, and samples of flights"
    assert described.score.measures["coverage"].mean == 1.0
    assert (tmp_path / "policy" / "policy.safetensors").is_file()


def test_towns_are_labelled_in_turn_those_of_validation_first_and_kept(monkeypatch):
    asked = []

    def label_of(number, town):
        asked.append((number, town.name))
        return route_learning.Label(number, [[0]], [1])

    monkeypatch.setattr(route_learning, "label_of", label_of)
    settings = settings_of("learned-route", changes=[*TINY, "rounds=5"])
    missions = Missions.of(settings)
    state = None
    for number in range(3):
        learner = learner_of(settings, missions, number)
        if state is not None:
            learner.load_state_dict(state)
        learner.learn(number, Told())
        state = learner.state_dict()
        assert len(asked) == number + 1
    assert [number for number, _ in asked] == [-1, 0, 1]
    assert asked == [(number, town_of(number, missions).name) for number in (-1, 0, 1)]
    assert missions.unseen(0)[1].name == asked[0][1]
    other = learner_of(settings, missions, 9)
    other.load_state_dict(state)
    kept = other.state_dict()
    assert all(np.array_equal(kept[name], state[name]) for name in state)
