"""The benchmark of packed samples: its table."""

import sys
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import packed_samples


def test_every_learner_is_compared_with_itself_on_the_same_missions(monkeypatch, capsys):
    asked = ["--seeds", "1", "--seconds", "0.01", "--missions", "1"]
    quick = {
        name: (partial(learner, n_epochs=1), *said)
        for name, (learner, *said) in packed_samples.LEARNERS.items()
    }
    monkeypatch.setattr(packed_samples, "LEARNERS", quick)
    monkeypatch.setattr(packed_samples, "N_MISSIONS", 4)
    monkeypatch.setattr(sys, "argv", ["packed_samples.py", *asked])
    packed_samples.main()
    head, _, *rows = (
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in capsys.readouterr().out.splitlines()
        if line.startswith("|")
    )
    assert tuple(head) == packed_samples.HEAD
    assert [row[2] for row in rows] == ["decisions", "every row"] * len(packed_samples.LEARNERS)
    for row in rows:
        assert 0.0 < float(row[3]) < 100.0
        assert int(row[4].replace(",", "")) > 0
        assert row[6].split(" of ")[1] == rows[0][6].split(" of ")[1]
