"""Options of the whole test suite, its quick part, and who runs what where several processes do."""

import gc
import os
import signal
from importlib.util import find_spec
from pathlib import Path

import pytest
from distribution import rank_of, scope_of, write_seconds
from quick_files import QUICK, is_quick

TESTS = Path(__file__).parent
ROOT = TESTS.parent
PATH_BEFORE = "PYTHONPATH_BEFORE_TESTS"


def pytest_configure():
    """Programs that tests start run the sources that are tested, and share their kernels.

    `python -m pytest` tests this folder; a program that is started elsewhere would import, and
    compile, what is installed.
    """
    tested = find_spec("uas_coverage_env")
    path = os.environ.get("PYTHONPATH", "")
    os.environ.setdefault(PATH_BEFORE, path)  # by the process that starts the others of `-n`
    if tested is not None and tested.origin and Path(tested.origin).parents[1] == ROOT:
        folders = [str(ROOT), *(each for each in path.split(os.pathsep) if each)]
        os.environ["PYTHONPATH"] = os.pathsep.join(dict.fromkeys(folders))


@pytest.fixture
def elsewhere(tmp_path, monkeypatch):
    """A command runs in a folder of its own, on a terminal of a known width."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    return tmp_path


@pytest.fixture
def python_handles_interrupts():
    """Ctrl-C raises: also where the tests run in the background of a shell, which ignores it, and
    where a solver, flown before in this process, has taken the signal for itself."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before or signal.default_int_handler)


@pytest.fixture
def bounds_found_soon(monkeypatch):
    """Valid but looser lower bounds: prices are sought once instead of in a dozen rounds."""
    from uas_coverage_env.bound import bound_of, carried

    monkeypatch.setattr(carried, "_SEARCH", ((2, 1),))
    monkeypatch.setattr(carried, "_AGAIN", ())
    yield
    bound_of.cache_clear()


@pytest.fixture
def user_environment():
    """The environment variables with which a user starts what is installed."""
    return {**os.environ, "PYTHONPATH": os.environ[PATH_BEFORE]}


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files of tests/golden anew instead of comparing with them",
    )
    parser.addoption(
        "--write-seconds",
        action="store_true",
        help="with -n: write the processor time of what stays together (tests/scope_seconds.json)",
    )


_seconds: dict[str, float] = {}
_BEFORE_S = pytest.StashKey[float]()


def _processor_s():
    """Of this process and of those that it has waited for."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Modules stay: to look for garbage among them takes a quarter of the time, and goes on to."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_finish(session):
    session.stash[_BEFORE_S] = _processor_s()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item):
    report = yield
    now_s = _processor_s()
    # an attribute of the report gets from the worker to the process that writes the file
    report.processor_s = now_s - item.session.stash[_BEFORE_S]
    item.session.stash[_BEFORE_S] = now_s
    return report


def pytest_runtest_logreport(report):
    _seconds[report.nodeid] = _seconds.get(report.nodeid, 0.0) + report.processor_s


def pytest_sessionfinish(session):
    if session.config.option.write_seconds and not hasattr(session.config, "workerinput"):
        write_seconds(_seconds)


def pytest_terminal_summary(terminalreporter, config):
    if config.option.write_seconds:
        terminalreporter.section("most processor time")
        for nodeid in sorted(_seconds, key=_seconds.__getitem__, reverse=True)[:50]:
            terminalreporter.write_line(f"{_seconds[nodeid]:6.1f} s  {nodeid}")


def pytest_ignore_collect(collection_path, config):
    """Files without quick tests are not even imported for `-m quick`."""
    if config.option.markexpr == "quick" and collection_path.name.startswith("test_"):
        return True if _name(collection_path) not in QUICK else None
    return None


def pytest_collection_modifyitems(config, items):
    for item in items:
        slow = item.get_closest_marker("slow") is not None
        if not slow and is_quick(_name(item.path), getattr(item, "originalname", item.name)):
            item.add_marker(pytest.mark.quick)
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: rank_of(item.nodeid))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """With `-n`, and no other `--dist` asked for: by `distribution`."""
    if config.getvalue("dist") != "load":
        return None
    from xdist.scheduler import LoadScopeScheduling

    class ByScope(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return scope_of(nodeid)

    config.option.loadscopereorder = False  # in the order of the items: longest first
    return ByScope(config, log)


def _name(path):
    return path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else ""
