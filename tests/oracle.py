"""The step of the world once more, in plain NumPy, written from `docs/rules.md`.

It shares no kernel with the package: `linear_model` gives the matrices, `ConvexPolytope` the
planes, and everything else is done here in the most literal way, whatever it costs. The inner loop
is not part of it: of a step it takes the wrench that was flown.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from uas_coverage_env.vehicle import linear_model

FLYING, LANDED, LOST = 0, 1, 2
ROUNDING_M = 1e-9


def thrust_correction(vehicle, x, lift_N):
    """ΔT of the LPV world: the affine lower bounds with one plane per face of an octagon."""
    fit = vehicle.thrust_correction
    weight_N = vehicle.airframe.mass_kg * vehicle.airframe.gravity_mps2
    trim = vehicle.airframe.drag_kgps / weight_N
    vx, vy, vz = x[3:6]
    phi, theta = x[6:8]
    angles = 2 * np.pi * np.arange(8) / 8
    octagon = np.column_stack([np.cos(angles), np.sin(angles)])
    speed = max(0.0, fit.speed_N_per_mps * (octagon @ [vx, vy]).max())
    excess = max(0.0, fit.tilt_N_per_rad * (octagon @ [phi - trim * vy, theta + trim * vx]).max())
    climb = max(-fit.climb_N_per_mps * vz, -fit.descent_N_per_mps * vz)
    return max(lift_N + climb + speed + excess, vehicle.limits.delta_thrust_min_N)


def clearance_of_segment(hull, start, end):
    """Smallest signed distance: at an end, or where two of the face lines cross."""
    at_start = hull.face_distances(start)
    slope = hull.face_distances(end) - at_start
    with np.errstate(divide="ignore", invalid="ignore"):
        crossings = (at_start[:, None] - at_start) / (slope - slope[:, None])
    crossings = crossings[np.isfinite(crossings) & (crossings > 0) & (crossings < 1)]
    fractions = np.concatenate([[0.0, 1.0], crossings])
    return (at_start[:, None] + slope[:, None] * fractions).max(axis=0).min()


def clearance_of_cylinder(radius_m, half_height_m, start, end):
    """Smallest distance of a relative segment from an upright cylinder, searched in thirds."""

    def distance(fraction):
        x, y, z = start + fraction * (end - start)
        return max(math.hypot(x, y) - radius_m, abs(z) - half_height_m)

    low, high = 0.0, 1.0
    for _ in range(100):
        third = (high - low) / 3
        if distance(low + third) < distance(high - third):
            high -= third
        else:
            low += third
    return min(distance(0.0), distance(1.0), distance((low + high) / 2))


@dataclass
class Expected:
    """What the oracle expects of one UAS in one step."""

    x: np.ndarray
    status: int
    u: np.ndarray = field(default_factory=lambda: np.zeros(5))
    voltage_V: float = 0.0
    current_A: float = 0.0
    covered: list[int] = field(default_factory=list)
    contacts: set[str] = field(default_factory=set)
    breaches: int = 0
    too_low: bool = False
    limits: set[str] = field(default_factory=set)
    obstacle_clearance_m: float = math.inf
    separation_m: float = math.inf


def expected_step(scenario, state, wrenches, returning, judged=()):
    """Everything that should come out of one step.

    Args:
        scenario: The scenario.
        state: The world's state before the step.
        wrenches: (U, 4) the lift and torques flown.
        returning: (U,) whether each UAS returns.
        judged: Indices of UAS that are flown by the wrench of a learner.

    Returns:
        (list of Expected, (W,) uncovered, (U,) departed) at the new sample.
    """
    step = int(state.step[0])
    start = state.x[:, :3]
    flying = [i for i, status in enumerate(state.uas["status"]) if status == FLYING]
    results = [
        Expected(x=x.copy(), status=int(s))
        for x, s in zip(state.x, state.uas["status"], strict=True)
    ]
    for i in flying:
        _fly(scenario.vehicles[i], scenario.dt_s, wrenches[i], results[i])
    end = np.array([result.x[:3] for result in results])
    _judge(scenario, step, flying, start, end, results)
    for i in set(flying) & set(judged):
        limits, x = scenario.vehicles[i].limits, results[i].x
        too_fast = math.hypot(x[3], x[4]) > 1.5 * limits.v_xy_max_mps
        if too_fast or math.hypot(x[6], x[7]) > 1.5 * limits.tilt_max_rad:
            results[i].contacts.add("limits")
    whole = [i for i in flying if not results[i].contacts]
    _count_breaches(scenario, step, whole, end, results)
    uncovered = state.uncovered.copy()
    for w, waypoint in enumerate(scenario.waypoints):
        for i in whole:
            near = np.linalg.norm(end[i] - waypoint.position_m) <= waypoint.radius_m
            if uncovered[w] and near:
                uncovered[w] = False
                results[i].covered.append(w)
    departed = state.uas["departed"].copy()
    for i in flying:
        home = np.array(scenario.uas[i].start_m)
        if i not in whole:
            results[i].status = LOST
        elif np.linalg.norm(end[i] - home) > scenario.landing_distance_m:
            departed[i] = True
        elif np.linalg.norm(results[i].x[3:6]) < scenario.landing_speed_mps and (
            departed[i] or returning[i]
        ):
            results[i].status = LANDED
            results[i].x[3:12] = 0.0
        results[i].limits = limits_exceeded(scenario.vehicles[i], results[i])
    return results, uncovered, departed


def limits_exceeded(vehicle, result):
    """The limits of the paper's X that a sample exceeds by more than 1 %."""
    limits, battery, x = vehicle.limits, vehicle.battery, result.x
    used = {
        "speed": math.hypot(x[3], x[4]) / limits.v_xy_max_mps,
        "climb": -x[5] / limits.v_up_max_mps,
        "descent": x[5] / limits.v_down_max_mps,
        "tilt": math.hypot(x[6], x[7]) / limits.tilt_max_rad,
        "tilt_rate": math.hypot(x[9], x[10]) / limits.rate_max_radps,
        "yaw_rate": abs(x[11]) / limits.yaw_rate_max_radps,
        "current": result.current_A / battery.current_max_A,
        "voltage": 2.0 - result.voltage_V / battery.voltage_min_V,
    }
    return {name for name, share in used.items() if share > 1.01}


def _fly(vehicle, dt_s, wrench, result):
    x = result.x
    result.u = np.append(wrench, thrust_correction(vehicle, x, wrench[0]))
    model = linear_model(vehicle, x[12], dt_s)
    _, result.voltage_V, result.current_A = model.C @ x + model.D @ result.u + model.F
    result.x = model.A @ x + model.B @ result.u + model.E


def _judge(scenario, step, flying, start, end, results):
    now = scenario.moving_positions(step * scenario.dt_s)
    after = scenario.moving_positions((step + 1) * scenario.dt_s)
    for i in flying:
        uas = scenario.uas[i]
        distances = []
        for hull in scenario.hulls:
            distances.append(clearance_of_segment(hull, start[i], end[i]))
            if distances[-1] < uas.radius_m:
                results[i].contacts.add("obstacle")
        for m, moving in enumerate(scenario.moving_obstacles):
            distance = clearance_of_cylinder(
                moving.radius_m, moving.height_m / 2, start[i] - now[m], end[i] - after[m]
            )
            distances.append(distance)
            if distance < uas.radius_m:
                results[i].contacts.add("moving_obstacle")
        results[i].obstacle_clearance_m = min(distances, default=math.inf)
        for j in flying:
            if j != i:
                apart = clearance_of_cylinder(0.0, 0.0, start[i] - start[j], end[i] - end[j])
                results[i].separation_m = min(results[i].separation_m, apart)
                if apart < uas.radius_m + scenario.uas[j].radius_m:
                    results[i].contacts.add("uas")
        if scenario.fence.signed_distance(end[i]) > 0:
            results[i].contacts.add("geofence")
        if results[i].x[12] > uas.dod_max:
            results[i].contacts.add("battery")


def _count_breaches(scenario, step, whole, end, results):
    after = scenario.moving_positions((step + 1) * scenario.dt_s)
    for i in whole:
        uas = scenario.uas[i]
        kept = [
            (float(hull.signed_distance(end[i])), uas.radius_m + obstacle.safe_distance_m)
            for hull, obstacle in zip(scenario.hulls, scenario.obstacles, strict=True)
        ]
        for m, moving in enumerate(scenario.moving_obstacles):
            x, y, z = end[i] - after[m]
            distance = max(math.hypot(x, y) - moving.radius_m, abs(z) - moving.height_m / 2)
            kept.append((distance, uas.radius_m + moving.safe_distance_m))
        for j in whole:
            if j != i:
                x, y, z = end[i] - end[j]
                both = uas.radius_m + scenario.uas[j].radius_m
                kept.append((max(math.hypot(x, y), abs(z)), both + scenario.uas_safe_distance_m))
        kept.append((-float(scenario.fence.signed_distance(end[i])), scenario.geofence.margin_m))
        results[i].too_low = too_low(scenario, i, end[i])
        near = sum(distance < required - ROUNDING_M for distance, required in kept)
        results[i].breaches = near + results[i].too_low


def too_low(scenario, i, position):
    """Whether UAS i is below the least height, and not near its start."""
    x, y = (position - np.array(scenario.uas[i].start_m))[:2]
    least = scenario.min_height_m
    if not least or math.hypot(x, y) <= scenario.landing_distance_m + 2.0 * least:
        return False
    # over a roof: inside of all of its faces once they are pushed up
    over_roofs = [
        (
            hull.face_distances(position)
            < least * np.maximum(0.0, -hull.normals[:, 2]) - ROUNDING_M
        ).all()
        for hull in scenario.hulls
    ]
    return bool(-position[2] < least - ROUNDING_M or any(over_roofs))
