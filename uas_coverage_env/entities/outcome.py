"""What happened to each UAS in one step."""

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.entities.codes import ContactKind
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.vehicle.layout import N_INPUTS

NONE, OBSTACLE, MOVING_OBSTACLE, UAS, FENCE, BATTERY, FAULT, LIMITS = map(int, ContactKind)

CONTACT_NAMES = tuple(kind.name.lower() for kind in ContactKind)

BREACH_TOLERANCE_M = 1e-9
"""Only what is nearer than a safe distance, or lower than the least height, by more than this is a
breach: a UAS held exactly there is to the last digit on either side [m]."""

OUTCOME_DTYPE = record_dtype(
    [
        # it flew, and from where [m]
        ("flew", "?"),
        ("before_m", "f8", (3,)),
        # (lift, three torques, thrust correction) [N, N m, N] that acted over the step
        ("u", "f8", (N_INPUTS,)),
        # what disturbances did over the step: velocity of the air, and another force, NED
        ("wind_mps", "f8", (3,)),
        ("force_N", "f8", (3,)),
        # share of the capacity that the battery lost besides what the motors drew
        ("dod_lost", "f8"),
        ("voltage_V", "f8"),
        ("current_A", "f8"),
        ("energy_Wh", "f8"),
        # waypoints that this UAS covered first, at the new sample
        ("newly_covered", "i8"),
        ("newly_covered_weight", "f8"),
        # a code of this module, and the index of the obstacle or UAS, or -1
        ("contact", "i8"),
        ("contact_with", "i8"),
        # how many obstacles and UAS are too near at the new sample; the fence, the least height
        # and a landing with less than the reserve count too
        ("breaches", "i8"),
        # one of these: below the least height
        ("too_low", "?"),
        # another: it has landed with less charge than the reserve
        ("below_reserve", "?"),
        # the vehicle's limits exceeded at the new sample: bit k for `vehicle.LIMITS[k]`
        ("limits_exceeded", "i8"),
        # smallest over the segment flown; inf where there is nothing to be clear of, or
        # nothing as near as `rules.measured_m`
        ("obstacle_clearance_m", "f8"),
        ("separation_m", "f8"),
        # how far inside the geofence it is at the new sample
        ("fence_clearance_m", "f8"),
        # what was flown, after guidance, return mode and filter
        ("applied_command", COMMAND_DTYPE),
        # the safety filter changed the command
        ("filtered", "?"),
        # the planner returns it, or return mode took over
        ("returning", "?"),
        ("landed", "?"),
        # it waits at its start with its motors off
        ("grounded", "?"),
    ]
)
"""One UAS and one step; of a UAS that did not fly, all but the distances is zero."""
