"""What the networks of a route policy read, by name, and how large they are."""

from uas_coverage_agents.policy.networks import Mlp
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route import leg_flight, order
from uas_coverage_agents.route.leg_flight import N_FLIGHT
from uas_coverage_agents.route.order import N_ORDER
from uas_coverage_env.env.observation import Feature
from uas_coverage_env.env.observation.block import Group

LAYOUT = "routes_v1"

_LIMIT = 3.0

_CHOICE = {
    order.N_OPEN: "open waypoints / 25",
    order.PER_UAS: "open waypoints per covering UAS / 15",
    order.MATES: "other UAS that cover / 4, at most 1",
    order.ALONE: "1 where no other UAS covers",
    order.OTHERS_FREE: "how much later the others are free on average / 5 unit_s",
    order.IN_AIR: "1 where it is at no waypoint",
    order.MORE_TOTAL: "flying time of all in the greedy rollout, over the best choice / 2 unit_s",
    order.MORE_LONGEST: "longest flight in the greedy rollout, likewise",
    order.FIRST_LEG: "leg time of the nearest waypoint / 2 unit_s",
    order.OFF_CENTRE: "distance from the centre of the open waypoints / 100 m",
}
_WAYPOINT = {
    order.LEG: "leg time with its turn / 2 unit_s",
    order.MORE_LEG: "leg time beyond that of the nearest / unit_s",
    order.COSINE: "cosine of the turn",
    order.SINE: "size of the sine of the turn",
    order.LEG_HOME: "way home from there / 10 unit_s",
    order.MATE_LATER: "how much later the first mate could be there / 3 unit_s",
    order.NEAREST: "leg time to its nearest open neighbour / unit_s",
    order.SECOND_NEAREST: "to its second nearest / unit_s",
    order.NEAR: "open waypoints within 1.6 unit_s of it / 6",
    order.AROUND: "within 3 unit_s / 15",
    order.ONE_SIDED: "how far those around it lie to one side of the leg, 0 to 1",
    order.FROM_CENTRE: "its distance from the centre of the open waypoints / 100 m",
    order.BEHIND: "share of those around it that lie behind it",
    order.IS_NEAREST: "1 for the nearest",
    order.IS_BEST: "1 for the best greedy rollout",
    order.RANK: "its rank among the nearest / 12",
    order.TWO_LEGS: "leg time and that to its nearest neighbour / 3 unit_s",
    order.MATE_SOONER: "1 where a mate could be there sooner",
    order.MORE_LEFT: "waypoints that no battery reaches then, over the best choice",
    order.CLOSER_HOME: "way home now less way home from there / 10 unit_s",
}
_HOME = {
    order.WAY_HOME: "way home / 10 unit_s",
    order.MATE_FREE: "when the first mate is free / 20 unit_s",
    order.TIME_LEFT: "flying time left / 300 s",
    order.ENOUGH_MATES: "1 where there are no more open waypoints than mates",
}
_FLIGHT = {
    leg_flight.WAY: "way to the first place / 50 m",
    leg_flight.FIRST_RADIUS: "its radius / 15 m",
    leg_flight.ALONG: "velocity along / 12 m/s",
    leg_flight.ACROSS: "velocity across / 12 m/s",
    leg_flight.TILT_ALONG: "tilt along / 0.44 rad",
    leg_flight.TILT_ACROSS: "tilt across / 0.44 rad",
    leg_flight.LOOP_ALONG: "velocity of the inner loop along / 12 m/s",
    leg_flight.LOOP_ACROSS: "and across / 12 m/s",
    leg_flight.SECOND_ALONG: "second place from the first, along / 50 m",
    leg_flight.SECOND_ACROSS: "and across / 50 m",
    leg_flight.SECOND_RADIUS: "its radius / 15 m",
    leg_flight.THIRD_ALONG: "third place from the second, along / 50 m",
    leg_flight.THIRD_ACROSS: "and across / 50 m",
    leg_flight.THIRD_RADIUS: "its radius / 15 m",
    leg_flight.FIRST_DOWN: "first place, how far down / 10 m",
    leg_flight.SECOND_DOWN: "second place below the first / 10 m",
    leg_flight.DESCENT: "descent / 3 m/s",
    leg_flight.FIRST_IS_HOME: "1 where the first is home",
    leg_flight.SECOND_IS_HOME: "1 where the second is home",
    leg_flight.THIRD_IS_HOME: "1 where the third is home",
    leg_flight.WAY_ON: "way from the first to the second / 50 m",
}


def order_groups() -> tuple[Group, ...]:
    """What the order networks read; leg times are told in units of the mission, `unit_s`."""
    unused = dict.fromkeys(range(len(_CHOICE) + len(_HOME), N_ORDER), "0")
    return (
        _group("waypoint", _CHOICE | _WAYPOINT),
        _group("home", _CHOICE | _HOME | unused),
    )


def observed_groups() -> tuple[Group, ...]:
    """All numbers in their order."""
    return (*order_groups(), _group("flight", _FLIGHT))


def route_networks(hidden: int) -> RouteNetworks:
    """The networks that read them."""

    def layers(inputs: int) -> Mlp:
        return Mlp(inputs=inputs, hidden=(hidden, hidden), outputs=1, activation="relu")

    return RouteNetworks(order=layers(N_ORDER), home=layers(N_ORDER), flight=layers(N_FLIGHT))


def _group(name: str, meanings: dict[int, str]) -> Group:
    features = tuple(
        Feature(f"{name}_{k}", 1, -_LIMIT, _LIMIT, meanings[k]) for k in range(len(meanings))
    )
    return Group(name, 1, features)
