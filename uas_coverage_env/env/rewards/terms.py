"""The terms of the reward of this version."""

import math
from collections.abc import Sequence

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel
from uas_coverage_env.entities.commands import VELOCITY
from uas_coverage_env.entities.outcome import NONE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.rewards.term import RewardTerm
from uas_coverage_env.world.contacts import flew_judged_wrench


@inlined_kernel
def coverage(arena, state, tables, learners, scratch, i, parameters):
    """Weight of the waypoints that it covered first."""
    return scratch.outcome[i].newly_covered_weight


@inlined_kernel
def team_coverage(arena, state, tables, learners, scratch, i, parameters):
    """Weight of the waypoints that the others covered first."""
    covered_by_all = 0.0
    for j in range(state.uas.shape[0]):
        covered_by_all += scratch.outcome[j].newly_covered_weight
    return covered_by_all - scratch.outcome[i].newly_covered_weight


@inlined_kernel
def energy(arena, state, tables, learners, scratch, i, parameters):
    """Minus the energy drawn [Wh]."""
    return -scratch.outcome[i].energy_Wh


@inlined_kernel
def violation(arena, state, tables, learners, scratch, i, parameters):
    """-1 when it is lost, and in every step in which its wrench leaves the vehicle's limits."""
    event = scratch.outcome[i]
    if event.contact != NONE:
        return -1.0
    beyond = event.limits_exceeded != 0 and flew_judged_wrench(arena, event)
    return -1.0 if beyond else 0.0


@inlined_kernel
def home(arena, state, tables, learners, scratch, i, parameters):
    """What share of all weight is covered when it lands."""
    return covered_share(arena, state) if scratch.outcome[i].landed else 0.0


@inlined_kernel
def stranded(arena, state, tables, learners, scratch, i, parameters):
    """-1 when time ends and it still flies."""
    over = state.step[0] >= arena.rules[0].max_steps
    return -1.0 if over and state.uas[i].status == FLYING else 0.0


@inlined_kernel
def filter_change(arena, state, tables, learners, scratch, i, parameters):
    """Minus what the safety filter changed."""
    event = scratch.outcome[i]
    if event.filtered and not state.uas[i].returning:
        return -_change(arena, i, scratch.commands[i], event.applied_command)
    return 0.0


@inlined_kernel
def time(arena, state, tables, learners, scratch, i, parameters):
    """-1 where it flew."""
    return -1.0 if scratch.outcome[i].flew else 0.0


@rare_kernel
def covered_share(arena, state):
    """What share of all weight is covered."""
    total = 0.0
    covered = 0.0
    for w in range(state.uncovered.shape[0]):
        weight = arena.waypoints[w].weight
        total += weight
        if not state.uncovered[w]:
            covered += weight
    return covered / total


@rare_kernel
def _change(arena, i, asked, applied):
    """How far the velocity flown is from the one asked for, in units of the limit."""
    if asked.kind != VELOCITY:
        return 1.0
    limit_mps = arena.uas[i].speed_mps
    speed_mps = math.hypot(asked.values[0], asked.values[1])
    shorten = limit_mps / speed_mps if speed_mps > limit_mps else 1.0
    north_mps = applied.values[0] - shorten * asked.values[0]
    east_mps = applied.values[1] - shorten * asked.values[1]
    return math.hypot(north_mps, east_mps) / limit_mps


REWARD = (
    RewardTerm("coverage", 1.0, "weight of the waypoints that it covered first", coverage),
    RewardTerm(
        "team_coverage", 0.0, "weight of the waypoints that the others covered first", team_coverage
    ),
    RewardTerm("energy", 0.2, "minus the energy drawn from its battery [Wh]", energy),
    RewardTerm(
        "violation",
        10.0,
        "-1 when it is lost (contact, outside the fence, battery overdrawn, out of control), or "
        "its wrench leaves a limit of the vehicle by more than the tolerance",
        violation,
    ),
    RewardTerm(
        "home", 5.0, "when it lands, the share of the waypoints' weight covered by then", home
    ),
    RewardTerm(
        "stranded", 5.0, "-1 when `max_cycles` ends the episode and it still flies", stranded
    ),
    RewardTerm(
        "filter",
        0.1,
        "minus what the safety filter changed (1: the speed limit, or not a speed)",
        filter_change,
    ),
    RewardTerm("time", 0.01, "-1 while it flies", time),
)
"""The default terms, in their order. What the filter corrects has a price, so that a learner does
not come to lean on it; what it corrects in return mode has none."""

REWARD_TERMS = tuple(term.name for term in REWARD)
"""Names of the default terms, in their order."""


def rewards_table(terms: Sequence[RewardTerm] = REWARD) -> str:
    """Terms as a Markdown table."""
    lines = ["| term | weight | per UAS and step |", "|---|---|---|"]
    lines += [f"| {term.name} | {term.weight:g} | {term.meaning} |" for term in terms]
    return "\n".join(lines)
