"""Which waypoints a moving obstacle blocks now."""

import math

from uas_coverage_env.compiled.kernels import kernel


@kernel
def find_blocked(arena, step, level_share, up_share, margin_m, blocked):
    """Mark the waypoints that one moving obstacle keeps all UAS from covering, where it is now.

    A UAS keeps out of the upright cylinder that is the obstacle grown on all sides by its safe
    distance, the largest radius of a UAS, and a margin. A waypoint is blocked while this keep-out
    holds all places from which a planner would cover it, which are taken as another upright
    cylinder, around the waypoint. Both shares 0: while it holds the waypoint itself.

    Args:
        arena: The arena.
        step: Row of its `moving_path_m`; the last one beyond its end.
        level_share: From how far beside a waypoint a planner covers it, over its radius [-].
        up_share: From how far above and below it, over its radius [-].
        margin_m: Kept in addition to the safe distance [m].
        blocked: (W,) bool; written.
    """
    sample = min(step, arena.moving_path_m.shape[0] - 1)
    uas_m = 0.0
    for i in range(arena.uas.shape[0]):
        uas_m = max(uas_m, arena.uas[i].radius_m)
    for w in range(blocked.shape[0]):
        blocked[w] = False
        waypoint = arena.waypoints[w]
        for m in range(arena.moving.shape[0]):
            moving = arena.moving[m]
            keep_m = moving.safe_distance_m + uas_m + margin_m
            north_m = waypoint.position_m[0] - arena.moving_path_m[sample, m, 0]
            east_m = waypoint.position_m[1] - arena.moving_path_m[sample, m, 1]
            down_m = waypoint.position_m[2] - arena.moving_path_m[sample, m, 2]
            beside_m = math.hypot(north_m, east_m) + level_share * waypoint.radius_m
            above_m = abs(down_m) + up_share * waypoint.radius_m
            if beside_m < moving.radius_m + keep_m and above_m < moving.half_height_m + keep_m:
                blocked[w] = True
