"""Whoever waits for a compilation is told so, once."""

import logging
from types import SimpleNamespace

import numpy as np
import pytest

from uas_coverage_env.compiled import progress
from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.progress import (
    NOTICE,
    Compilations,
    listening,
)
from uas_coverage_env.compiled.purpose import compiling_for

LINE = f"uas_coverage_env: {NOTICE}\n".format(purpose="this program")


@kernel
def third(x):
    return x / 3.0


@kernel
def second(x):
    return third(x) + 2.0


@kernel
def first(x):
    return second(x) + third(x)


def fresh():
    """A kernel that is in no cache: what it adds is a cell that no other process has."""
    offset = float(np.random.default_rng().uniform())

    @kernel
    def part(x):
        return second(x) + offset

    @kernel
    def new(x):
        return part(x)

    return new


@pytest.fixture
def impatient(monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE_S", 0.0)
    monkeypatch.setattr(progress.COMPILATIONS, "told", set())


@pytest.mark.usefixtures("impatient")
def test_a_user_who_has_to_wait_is_told_why_on_stderr_and_once(capfd):
    fresh()(1.0)
    fresh()(1.0)
    out, err = capfd.readouterr()
    assert out == ""
    assert err == LINE


@pytest.mark.usefixtures("impatient")
def test_what_is_compiled_for_is_said_once_for_each_purpose(capfd):
    for purpose in ("planner tour", "planner hover", "planner tour"):
        with compiling_for(purpose):
            fresh()(1.0)
    said = [NOTICE.format(purpose=purpose) for purpose in ("planner tour", "planner hover")]
    assert capfd.readouterr().err == "".join(f"uas_coverage_env: {line}\n" for line in said)


def test_a_user_who_does_not_have_to_wait_is_told_nothing(capfd, monkeypatch):
    monkeypatch.setattr(progress, "PATIENCE_S", 1e9)
    monkeypatch.setattr(progress.COMPILATIONS, "told", set())
    fresh()(1.0)
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("impatient")
def test_what_is_on_the_disk_is_not_announced(capfd):
    new = fresh()
    new(1.0)
    capfd.readouterr()
    progress.COMPILATIONS.told.clear()
    assert new(2.0) == new(2.0)
    first(1.0)
    n_compiled = progress.COMPILATIONS.n_compiled
    progress.COMPILATIONS.told.clear()
    capfd.readouterr()

    again = kernel(new.py_func)
    assert again(1.0) == new(1.0)
    assert progress.COMPILATIONS.n_compiled == n_compiled
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("impatient")
def test_whoever_has_set_up_logging_is_told_there(capfd, caplog):
    with caplog.at_level(logging.INFO, logger="uas_coverage_env"):
        fresh()(1.0)
    assert [record.getMessage() for record in caplog.records] == [
        NOTICE.format(purpose="this program")
    ]
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("impatient")
def test_a_level_above_info_silences_it(capfd, caplog):
    with caplog.at_level(logging.WARNING, logger="uas_coverage_env"):
        fresh()(1.0)
    assert not caplog.records
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("impatient")
def test_a_listener_hears_a_share_that_grows_and_the_end():
    shares = []
    with listening(shares.append):
        fresh()(1.0)
    assert shares.pop() is None
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert 0.0 < shares[-1] <= 1.0
    fresh()(1.0)
    assert None not in shares


@pytest.mark.usefixtures("impatient")
def test_one_listener_hears_one_share_of_several_compilations():
    shares = []
    with listening(shares.append):
        fresh()(1.0)
        fresh()(1.0)
    heard = [share for share in shares if share is not None]
    assert heard == sorted(heard)
    assert shares.count(None) == 2
    assert shares[shares.index(None) + 1] > 0.0


@pytest.mark.usefixtures("impatient")
def test_what_a_bar_has_shown_is_not_said_once_more(capfd):
    with compiling_for("planner tour"):
        with listening(lambda share: None):
            fresh()(1.0)
        fresh()(1.0)
    assert capfd.readouterr().err == ""
    with compiling_for("planner hover"):
        fresh()(1.0)
    assert "planner hover" in capfd.readouterr().err


@pytest.mark.usefixtures("impatient")
def test_a_compilation_that_fails_has_an_end_too():
    shares = []

    @kernel
    def wrong(x):
        return second(x).nothing

    with listening(shares.append), pytest.raises(Exception, match="nothing"):
        wrong(1.0)
    assert shares[-1] is None


def test_patience_counts_what_earlier_compilations_took(monkeypatch):
    times = iter([0.0, 0.4, 0.6, 0.6, 0.6, 1.1, 1.3, 1.3])
    monkeypatch.setattr(progress.time, "perf_counter", lambda: next(times))
    told = []
    compilations = Compilations()
    compilations.listener = told.append
    for _ in range(2):
        happening = SimpleNamespace(data={"dispatcher": first})
        compilations.on_start(happening)
        compilations.on_end(happening)
    assert told == [pytest.approx(0.02), None]
