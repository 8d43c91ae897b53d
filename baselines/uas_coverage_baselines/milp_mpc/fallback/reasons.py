"""Why a decision was flown on a fallback."""

from enum import StrEnum


class Reason(StrEnum):
    """Why there is no new plan to fly; what a decision's record says.

    Where a decision fails for several reasons it is the one that came last: a plan without a
    backup trajectory was found in time.
    """

    NO_TIME = "no time"
    """The time was up before a program had a solution."""
    CUT_SHORT = "cut short"
    """No fallback: there is a new plan, but the time limit has ended the search for it."""
    NO_PLAN = "no plan"
    """No program has a solution, or none that may be flown."""
    NO_TEAM = "no joint plan"
    """There are plans, but none holds together with what the other UAS can fly."""
    WAITING_IS_CHEAPER = "waiting was cheaper"
    """Of all teams that hold the cheapest goes on with what it has."""
    NO_BACKUP = "no backup trajectory"
    """From no step of the plan could the UAS stop clear of everything."""
    STANDSTILL = "no progress"
    """There is a plan, but a UAS comes no nearer to its target: it follows a route."""
    CHARGE = "charge for the way home"
    """There is a plan, but what a UAS has left is what its way home takes: it flies that."""
