"""What the network reads that commands velocities along a route: tables, and the kernel.

Horizontal directions are told along and across the direction of the first place, with the second
place on the positive side: nothing depends on where north or the left is.
"""

import math

import numpy as np
from numpy.typing import NDArray

from uas_coverage_agents.policy.networks import Mlp
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.layout import order_groups, route_networks
from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    EAST,
    IS_HOME,
    MOST_HELD,
    NORTH,
    RADIUS,
    aim_ahead,
    places_ahead,
    spare_distance,
)
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.lookahead import PLENTY_M
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.env.observation import Feature
from uas_coverage_env.env.observation.block import Group
from uas_coverage_env.env.observation.surroundings import free_way
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world.height import lowest_altitude

LAYOUT = "route_velocity_v2"
ALONG_NORTH, ALONG_EAST, ACROSS_NORTH, ACROSS_EAST, AIMED_M = range(5)
"""Columns of a frame: unit vectors along and across the way, and the altitude aimed at [m]."""

N_FRAME = AIMED_M + 1
_ALONG, _ACROSS = slice(ALONG_NORTH, ACROSS_NORTH), slice(ACROSS_NORTH, AIMED_M)
OUTPUTS = 3
"""Velocity along and across over top speed, and altitude above the place aimed at over 10 m."""

_LENGTH_M, _SPEED_MPS, _TILT_RAD, _CLIMB_MPS, _RADIUS_M, _RISE_M = 50.0, 12.0, 0.44, 3.0, 15.0, 10.0
_NEAR_M, _RAY_M, _MOST = 10.0, 60.0, 3.0
_AHEAD_RAD = np.radians([-60.0, -30.0, 0.0, 30.0, 60.0])
_FLIGHT_RAD = np.radians([-40.0, -20.0, -10.0, 0.0, 10.0, 20.0, 40.0])
_BRAKED_AFTER = np.array([0, 1, 2, MOST_HELD])
_AHEAD_AFTER = np.array([1, 2])
_STILL_MPS = 0.5
_PLACES = AHEAD - 1


def _scaled(name: str, size: int, meaning: str) -> Feature:
    return Feature(name, size, -_MOST, _MOST, meaning)


OWN = Group(
    "own",
    1,
    (
        _scaled("velocity", 3, "along, across / 12 m/s, down / 3 m/s"),
        _scaled("tilt", 2, "along, across / 0.44 rad"),
        _scaled("reference", 2, "velocity of the inner loop, along, across / 12 m/s"),
        Feature("closeness", 1, 0.0, 1.0, "1/(1 + way to the first place / 10 m)"),
    ),
)
PLACES = Group(
    "places",
    _PLACES,
    (
        _scaled("way", 2, "to where the place is aimed at, from the one before, / 50 m"),
        _scaled("below", 1, "how far it is below the one before / 10 m"),
        _scaled("centre", 2, "of the place, from where it is aimed at, / 15 m"),
        _scaled("radius", 1, "radius of the place / 15 m"),
        Feature("home", 1, 0.0, 1.0, "1 where it is home"),
    ),
)
SURROUNDINGS = Group(
    "surroundings",
    1,
    (
        Feature("ahead", len(_AHEAD_RAD), 0.0, 1.0, "1 - free way / 60 m, -60° to 60° off along"),
        Feature("flight", len(_FLIGHT_RAD), 0.0, 1.0, "likewise, -40° to 40° off the velocity"),
        _scaled("rise", 1, "how far above is the least altitude on the way / 10 m"),
        Feature("pace", 1, 0.0, 1.0, "speed that leaves time to climb there / top speed"),
        Feature(
            "spare", len(_BRAKED_AFTER), -_MOST, 1.0,
            "distance to spare from fixed obstacles and fence / 2 m if it brakes now, or flies on "
            "for 1, 2 or 4 steps and brakes then",
        ),
        Feature(
            "spare_ahead", len(_AHEAD_AFTER), -_MOST, 1.0,
            "likewise if it flies along at top speed for 1 or 2 steps and brakes then",
        ),
    ),
)  # fmt: skip
GROUPS = (OWN, PLACES, SURROUNDINGS)
N_VELOCITY = sum(group.size for group in GROUPS)
SPARE = slice(N_VELOCITY - len(_BRAKED_AFTER) - len(_AHEAD_AFTER), N_VELOCITY)
"""Columns that say whether it is still time to brake."""

_OWN, _PLACE, _AROUND = OWN.columns, PLACES.columns, SURROUNDINGS.columns
_WIDTH, _FIRST_PLACE, _FIRST_AROUND = PLACES.width, OWN.size, OWN.size + PLACES.size


def velocity_groups() -> tuple[Group, ...]:
    """The numbers in their order: those of the order networks, then these."""
    return (*order_groups(), *GROUPS)


def velocity_networks(order: Mlp, hidden: tuple[int, ...]) -> RouteNetworks:
    """The networks that read them."""
    networks = route_networks(order.hidden[0])
    flight = Mlp(inputs=N_VELOCITY, hidden=hidden, outputs=OUTPUTS, activation="relu")
    return networks.model_copy(update={"flight": flight})


def commanded(
    outputs: NDArray[np.float64], frames: NDArray[np.float64], speeds_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """What outputs of the network mean.

    Args:
        outputs: (N, OUTPUTS).
        frames: (N, N_FRAME), see `observe_route`.
        speeds_mps: (N,) top speeds.

    Returns:
        (N, 3) velocity north and east [m/s], altitude [m].
    """
    along, across = outputs[:, :1], outputs[:, 1:2]
    level_mps = speeds_mps[:, None] * (along * frames[:, _ALONG] + across * frames[:, _ACROSS])
    return np.column_stack([level_mps, frames[:, AIMED_M] + _RISE_M * outputs[:, 2]])


def outputs_of(
    values: NDArray[np.float64], frames: NDArray[np.float64], speeds_mps: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The outputs that mean some commands: the inverse of `commanded`."""
    level = values[:, :2] / speeds_mps[:, None]
    along = (level * frames[:, _ALONG]).sum(axis=1)
    across = (level * frames[:, _ACROSS]).sum(axis=1)
    return np.column_stack([along, across, (values[:, 2] - frames[:, AIMED_M]) / _RISE_M])


@allocating_kernel
def _cast_rays(arena, x, north, east, side, angles_rad, row):
    """Write how little is free in directions off one, the positive ones on the positive side."""
    for k in range(angles_rad.shape[0]):
        along, across = math.cos(angles_rad[k]), side * math.sin(angles_rad[k])
        dx, dy = along * north - across * east, along * east + across * north
        row[k] = 1.0 - free_way(arena, x[S.X], x[S.Y], x[S.Z], dx, dy, 0.0, _RAY_M) / _RAY_M


@allocating_kernel
def _observe_braking(arena, i, x, reference, north_mps, east_mps, altitude_m, after, row):
    """Write how much distance is to spare if it brakes after so many steps at a velocity."""
    path_m = np.empty((arena.rules[0].lookahead_steps + MOST_HELD, 3))
    command = np.zeros(1, COMMAND_DTYPE)[0]
    write_command(command, VELOCITY, north_mps, east_mps, altitude_m)
    for k in range(after.shape[0]):
        spare_m = spare_distance(arena, i, x, reference, command, after[k], -math.inf, path_m)
        row[k] = spare_m / PLENTY_M


@allocating_kernel
def observe_route(arena, i, x, reference, targets, n_targets, row, frame):
    """Write the observation of UAS i along its route.

    Args:
        arena: The arena.
        i: Index of the UAS.
        x: (14,) its state.
        reference: (2,) [m/s] of its inner loop.
        targets: (AHEAD,) the next waypoints of its route.
        n_targets: How many of them; after them comes home.
        row: (N_VELOCITY,) written.
        frame: (N_FRAME,) written, see `ALONG_NORTH`.

    Returns:
        Kind of the first leg, see `route`.
    """
    ahead, aims_m = np.empty((AHEAD, 5)), np.empty((AHEAD, 3))
    leg, needed_m, speed_mps = places_ahead(arena, i, x, targets, n_targets, ahead)
    aim_ahead(arena.vehicles[i], x, ahead, aims_m)
    dx, dy = aims_m[0, 0] - x[S.X], aims_m[0, 1] - x[S.Y]
    way_m = math.hypot(dx, dy)
    ex, ey = 1.0, 0.0
    if way_m > 1e-3:
        ex, ey = dx / way_m, dy / way_m
    on_x, on_y = aims_m[1, 0] - aims_m[0, 0], aims_m[1, 1] - aims_m[0, 1]
    side = 1.0 if ex * on_y - ey * on_x >= 0.0 else -1.0
    px, py = -side * ey, side * ex
    aim_m, floor_m = -aims_m[0, 2], max(lowest_altitude(arena, i, x[S.X], x[S.Y]), needed_m)
    aimed_m = min(max(aim_m, floor_m), max(arena.rules[0].ceiling_m, aim_m))
    frame[ALONG_NORTH], frame[ALONG_EAST] = ex, ey
    frame[ACROSS_NORTH], frame[ACROSS_EAST] = px, py
    frame[AIMED_M] = aimed_m

    row[_OWN.velocity] = (x[S.VX] * ex + x[S.VY] * ey) / _SPEED_MPS
    row[_OWN.velocity + 1] = (x[S.VX] * px + x[S.VY] * py) / _SPEED_MPS
    row[_OWN.velocity + 2] = x[S.VZ] / _CLIMB_MPS
    row[_OWN.tilt] = (-x[S.THETA] * ex + x[S.PHI] * ey) / _TILT_RAD
    row[_OWN.tilt + 1] = (-x[S.THETA] * px + x[S.PHI] * py) / _TILT_RAD
    row[_OWN.reference] = (reference[0] * ex + reference[1] * ey) / _SPEED_MPS
    row[_OWN.reference + 1] = (reference[0] * px + reference[1] * py) / _SPEED_MPS
    row[_OWN.closeness] = _NEAR_M / (_NEAR_M + way_m)
    bx, by, bz = x[S.X], x[S.Y], x[S.Z]
    for k in range(_PLACES):
        at = _FIRST_PLACE + k * _WIDTH
        dx, dy = aims_m[k, 0] - bx, aims_m[k, 1] - by
        row[at + _PLACE.way] = (dx * ex + dy * ey) / _LENGTH_M
        row[at + _PLACE.way + 1] = (dx * px + dy * py) / _LENGTH_M
        row[at + _PLACE.below] = (aims_m[k, 2] - bz) / _RISE_M
        dx, dy = ahead[k, NORTH] - aims_m[k, 0], ahead[k, EAST] - aims_m[k, 1]
        row[at + _PLACE.centre] = (dx * ex + dy * ey) / _RADIUS_M
        row[at + _PLACE.centre + 1] = (dx * px + dy * py) / _RADIUS_M
        row[at + _PLACE.radius] = ahead[k, RADIUS] / _RADIUS_M
        row[at + _PLACE.home] = ahead[k, IS_HOME]
        bx, by, bz = aims_m[k, 0], aims_m[k, 1], aims_m[k, 2]
    at = _FIRST_AROUND
    _cast_rays(arena, x, ex, ey, side, _AHEAD_RAD, row[at + _AROUND.ahead :])
    speed = math.hypot(x[S.VX], x[S.VY])
    if speed > _STILL_MPS:
        ex, ey = x[S.VX] / speed, x[S.VY] / speed
    _cast_rays(arena, x, ex, ey, side, _FLIGHT_RAD, row[at + _AROUND.flight :])
    row[at + _AROUND.rise] = (floor_m + x[S.Z]) / _RISE_M
    row[at + _AROUND.pace] = min(1.0, speed_mps / arena.uas[i].speed_mps)
    _observe_braking(
        arena, i, x, reference, reference[0], reference[1], aimed_m, _BRAKED_AFTER,
        row[at + _AROUND.spare :],
    )  # fmt: skip
    top_mps = arena.uas[i].speed_mps
    _observe_braking(
        arena, i, x, reference, top_mps * frame[ALONG_NORTH], top_mps * frame[ALONG_EAST],
        aimed_m, _AHEAD_AFTER, row[at + _AROUND.spare_ahead :],
    )  # fmt: skip
    for f in range(N_VELOCITY):
        row[f] = min(max(row[f], -_MOST), _MOST)
    return leg
