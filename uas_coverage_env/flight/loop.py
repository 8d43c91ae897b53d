"""Fly one mission: planner and world in turn, sample by sample, until no UAS is flying."""

import contextlib
import dataclasses
import platform
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.entities.commands import pack
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.env.rewards import REWARD, RewardTerm
from uas_coverage_env.features import MissionFeature
from uas_coverage_env.features.of_scenario import features_of
from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.left_open import left_open
from uas_coverage_env.flight.log import FlightLog, Taken
from uas_coverage_env.flight.metrics import open_waypoints
from uas_coverage_env.flight.planner import Assistants, Planner, check_planner
from uas_coverage_env.flight.registry import load_planner, name_of, options_of
from uas_coverage_env.interruptions import signals_noted
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.around.around import Around
from uas_coverage_env.planning.around.relaunch import Relaunch
from uas_coverage_env.plugins.installed import version_of
from uas_coverage_env.plugins.users_code import described, place_of
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import Z
from uas_coverage_env.world import Command, GoTo, SwarmState, Velocity
from uas_coverage_env.world.packs import swaps_alone

_RECORDED_PACKAGES = (
    "uas-coverage-env", "numpy", "scipy", "numba", "highspy", "pyscipopt", "gurobipy",
)  # fmt: skip


@dataclass(frozen=True)
class Progress:
    """Where a flight stands: told before the first decision and after every step.

    Attributes:
        swarm: As it is now.
        max_steps: After which the flight ends.
        covered: Waypoints so far.
        decision_time_s: Of the last decision [s]; None before the first.
        flown: Makes a `Flight` of what has been flown so far.
        scenario: As events have left it.
    """

    swarm: SwarmState
    max_steps: int
    covered: int
    decision_time_s: float | None
    flown: Callable[[], Flight]
    scenario: Scenario


def rollout(
    scenario: Scenario | str | Path,
    planner: Planner | str,
    seed: int = 0,
    *,
    dynamics: DynamicsName = "lpv",
    return_mode: bool | None = None,
    safety_filter: bool | None = None,
    max_steps: int | None = None,
    disturbances: Sequence[MissionFeature] | None = None,
    reward: Sequence[RewardTerm] = REWARD,
    reward_weights: Mapping[str, float] | None = None,
    on_step: Callable[[Progress], object] | None = None,
    should_stop: Callable[[], bool] | None = None,
) -> Flight:
    """Fly one mission and keep its record.

    Ctrl-C ends the flight as `should_stop` does, after the step that is being flown; a second one
    at once. What was flown so far is returned.

    Args:
        scenario: A scenario, the name of a shipped one, or the path of a scenario file.
        planner: A planner, or the name of an installed one (flown with its default options).
        seed: The seed of the planner and of what disturbances draw.
        dynamics: `lpv` or `nonlinear`.
        return_mode: Let the world bring UAS home in time; None: as the planner asks, and unless it
            refuses, where something pushes back (wind, wrong models, sensors, events), or UAS swap
            packs while the others fly on and the planner does not plan so far ahead (`is_idle`).
        safety_filter: Let the world keep commands clear of harm; None: likewise.
        max_steps: Stop after so many steps; None, or more than the scenario's: the scenario's.
        disturbances: What pushes back; None: what the scenario says. Others than those of the
            scenario are named in the record, but no flight directory holds what they do.
        reward: Terms of the reward that is recorded, see `RewardTerm`; empty: none is.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        on_step: Called with a `Progress` once all is compiled and after every step.
        should_stop: Asked before every decision.

    Raises:
        InputError: Unknown scenario or planner, no planner, or it refuses the scenario.
        ValueError: Unknown dynamics, a number of steps below one, or a wrong reward.
        PlannerError: The planner raised an exception, or gave commands that cannot be flown.
    """
    if not isinstance(scenario, Scenario):
        scenario = load_scenario(scenario)
    if isinstance(planner, str):
        planner = load_planner(planner)
    check_planner(planner)
    if max_steps is not None and not (isinstance(max_steps, int | np.integer) and max_steps > 0):
        raise ValueError(f"max_steps is {max_steps!r}; give a whole number from 1 on, or None")
    assistants: Assistants = getattr(planner, "assistants", Assistants())
    # no plan is verified against what pushes back, nor one of legs against what moves
    by_legs = scenario.execution is not None
    # a planner that looks no farther than the next waypoint is called home for a fresh pack
    called = swaps_alone(scenario) and not hasattr(planner, "is_idle")
    uncertain = _is_uncertain(scenario, disturbances) or called
    if return_mode is None:
        return_mode = assistants.return_mode
        # return mode would fly home another way than the file
        sends = getattr(planner, "goes_to", False) or hasattr(planner, "routes")
        if return_mode is None or (return_mode and by_legs and sends):
            return_mode = uncertain
    if safety_filter is None:
        safety_filter = assistants.safety_filter
        if safety_filter is None:
            safety_filter = uncertain or by_legs
    with compiling_for(f"planner {name_of(planner)}"):
        world = World(
            scenario,
            dynamics=dynamics,
            return_mode=return_mode,
            safety_filter=safety_filter,
            disturbances=disturbances,
            judges_wrenches=getattr(planner, "is_learner", False),
            seed=seed,
        )
        meter = None
        if reward or reward_weights:
            paid = MissionSettings(reward=tuple(reward), reward_weights=reward_weights)
            meter = MissionInterface(world, paid)
        flown_by = _Seat(planner)
        _make_ready(world, meter, flown_by, MissionBrief.of(scenario), seed)

    limit = scenario.max_steps if max_steps is None else min(max_steps, scenario.max_steps)
    log = FlightLog(world, scenario, meter)
    started_s = _worked_s()

    def flown(ended: str = "stopped") -> Flight:
        return Flight(
            scenario=scenario,
            planner=name_of(planner),
            planner_options=options_of(planner),
            # as Python's own, which a file holds: NumPy's come from a range of seeds
            seed=int(seed),
            dynamics=dynamics,
            return_mode=bool(return_mode),
            safety_filter=bool(safety_filter),
            disturbances=tuple(each.name for each in world.features if each.disturbs),
            ended=ended,
            wall_time_s=_worked_s() - started_s,
            versions=recorded_versions(),
            **log.series(),
        )

    def tell(swarm: SwarmState, decision_time_s: float | None) -> None:
        if on_step is not None:
            on_step(Progress(swarm, limit, log.covered, decision_time_s, flown, world.known))

    ended = "stopped"
    # the flight up to there is valid
    with contextlib.suppress(KeyboardInterrupt), signals_noted() as interrupted:

        def stops() -> bool:
            return interrupted() or (should_stop is not None and should_stop())

        try:
            ended = _fly(world, flown_by, log, limit, seed, tell, stops)
        except PlannerError as error:
            error.flight = flown() if log.steps else None
            raise
    return _with_reasons(flown(ended), flown_by.around.given_up)


def _with_reasons(flight: Flight, said: Mapping[int, str]) -> Flight:
    """The flight with why it has left waypoints open."""
    if not open_waypoints(flight):
        return flight
    return dataclasses.replace(flight, left_open=left_open(flight, said))


class _Seat:
    """A planner, by which errors are named, and the same with what is done round it."""

    def __init__(self, planner: Planner) -> None:
        self.planner, self.around = planner, Around(planner)


def _is_uncertain(scenario: Scenario, disturbances: Sequence[MissionFeature] | None) -> bool:
    """Whether anything may push back."""
    if disturbances is not None:
        return bool(features_of(scenario, disturbances))
    return bool(scenario.feature_tables or scenario.events)


def _make_ready(
    world: World, meter: MissionInterface | None, seat: _Seat, brief: MissionBrief, seed: int
) -> None:
    """Compile what world and planner begin with, then put both at the start."""
    state, planner = world.swarm_state(), seat.planner
    stay: dict[str, Command] = dict.fromkeys(state.names, GoTo(None))
    if not getattr(planner, "goes_to", False):
        stay = {name: Velocity(0.0, 0.0, -state.x[i, Z]) for i, name in enumerate(state.names)}
    packed = pack(stay, state.names, state.active, len(state.uncovered))
    outcome = _stepped(world, packed)
    if meter is not None:
        meter.reward_terms(packed, outcome)
    world.reset()
    try:
        seat.around.warm_up(brief)
        seat.around.reset(brief, seed)
    except ValueError as error:
        where = "" if isinstance(error, InputError) else place_of(error)
        reason = f"planner {name_of(planner)!r} refuses scenario {brief.name!r}: {error}{where}"
        raise InputError(reason) from error
    except Exception as error:
        raise _failed(planner, f"cannot begin scenario {brief.name!r}", error) from error


def _fly(
    world: World,
    seat: _Seat,
    log: FlightLog,
    limit: int,
    seed: int,
    tell: Callable[[SwarmState, float | None], None],
    should_stop: Callable[[], bool],
) -> str:
    """Fly until the end; returns how it came about, see `Flight.ended`."""
    swarm, revisions, relaunch = world.swarm_state(), 0, _relaunch(world)
    tell(swarm, None)
    while not world.done or (relaunch and world.waits):
        if log.steps >= limit:
            return "steps"
        if should_stop():
            return "stopped"
        commands, packed, took = _decide(seat, swarm)
        outcome = _stepped(world, packed)
        found = seat.around.last_decision if swarm.active else None
        log.add(commands, packed, took, found, outcome)
        before, swarm = swarm, world.swarm_state()
        changed = world.revisions != revisions
        if changed:
            revisions = world.revisions
            relaunch = _relaunch(world)
        more = world.known.asks_again and len(swarm.uncovered) > len(before.uncovered)
        again = None
        if relaunch and log.steps < limit:
            again = relaunch.due(swarm, asked_again=more)
        if again is not None and again.any():
            world.take_off(again)
            swarm, changed = world.swarm_state(), True
        if changed:
            with _blamed(seat.planner, swarm):
                seat.around.reset(MissionBrief.of(world.known), seed)
        tell(swarm, took.wall_s)
    return "complete"


def _worked_s() -> float:
    """A clock that stands while kernels are compiled [s]: no decision pays for that."""
    return time.perf_counter() - COMPILATIONS.spent_s


def _busy_s() -> float:
    """The same of processor time, of all threads [s]: a solver may have several."""
    return time.process_time() - COMPILATIONS.processor_s


def _relaunch(world: World) -> Relaunch | None:
    return Relaunch(MissionBrief.of(world.known)) if world.known.relaunch else None


def _decide(
    seat: _Seat, swarm: SwarmState
) -> tuple[Mapping[str, Command], NDArray[np.void], Taken]:
    """One decision, checked and timed; none is asked for while all swap packs."""
    if not swarm.active:
        return {}, pack({}, swarm.names, (), len(swarm.uncovered)), Taken()
    planner = seat.planner
    with _blamed(planner, swarm):
        started_s, busy_s = _worked_s(), _busy_s()
        commands = seat.around.act(swarm)
        took = Taken(_worked_s() - started_s, max(_busy_s() - busy_s, 0.0))
    try:
        return commands, pack(commands, swarm.names, swarm.active, len(swarm.uncovered)), took
    except ValueError as error:
        reason = f"planner {name_of(planner)!r} {_when(swarm)}: {error}"
        raise PlannerError(reason) from error


def _stepped(world: World, packed: NDArray[np.void]) -> NDArray[np.void]:
    try:
        return world.step(packed)
    except InputError:
        raise
    except ValueError as error:  # the commands are checked: it is what a kernel does
        names = ", ".join(each.name for each in world.features if each.disturbs)
        raise InputError(f"disturbances of the mission ({names}): {error}") from error


@contextlib.contextmanager
def _blamed(planner: Planner, swarm: SwarmState) -> Iterator[None]:
    """Whatever a planner raises is one line about it, with the place in its code."""
    try:
        yield
    except Exception as error:
        raise _failed(planner, _when(swarm), error) from error


def _failed(planner: Planner, when: str, error: Exception) -> PlannerError:
    package = type(planner).__module__.partition(".")[0]
    # what was written for a person needs no place
    what = str(error) if isinstance(error, InputError) else described(error, package)
    return PlannerError(f"planner {name_of(planner)!r} {when}: {what}")


def _when(swarm: SwarmState) -> str:
    return f"at step {swarm.step} (t = {swarm.time_s:g} s)"


def recorded_versions() -> dict[str, str]:
    """Package -> version of what decides how a flight comes out."""
    found = {name: version_of(name) for name in _RECORDED_PACKAGES}
    installed = {name: version for name, version in found.items() if version is not None}
    return {**installed, "python": platform.python_version()}
