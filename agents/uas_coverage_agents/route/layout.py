"""What the networks of a route policy read, by name, and how large they are."""

from uas_coverage_agents.policy.networks import Mlp
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.leg_flight import N_FLIGHT
from uas_coverage_agents.route.order import N_ORDER
from uas_coverage_env.env.observation import Feature, Group

LAYOUT = "routes_v1"

_LIMIT = 3.0

_CHOICE = (
    "open waypoints / 25",
    "open waypoints per covering UAS / 15",
    "other UAS that cover / 4, at most 1",
    "1 where no other UAS covers",
    "how much later the others are free on average / 5 unit_s",
    "1 where it is at no waypoint",
    "flying time of all in the greedy outlook, over the best choice / 2 unit_s",
    "longest flight in the greedy outlook, likewise",
    "leg time of the nearest waypoint / 2 unit_s",
    "distance from the centre of the open waypoints / 100 m",
)
_WAYPOINT = (
    "leg time with its turn / 2 unit_s",
    "leg time beyond that of the nearest / unit_s",
    "cosine of the turn",
    "size of the sine of the turn",
    "way home from there / 10 unit_s",
    "how much later the first mate could be there / 3 unit_s",
    "leg time to its nearest open neighbour / unit_s",
    "to its second nearest / unit_s",
    "open waypoints within 1.6 unit_s of it / 6",
    "within 3 unit_s / 15",
    "how far those around it lie to one side of the leg, 0 to 1",
    "its distance from the centre of the open waypoints / 100 m",
    "share of those around it that lie behind it",
    "1 for the nearest",
    "1 for the best greedy outlook",
    "its rank among the nearest / 12",
    "leg time and that to its nearest neighbour / 3 unit_s",
    "1 where a mate could be there sooner",
    "waypoints that no battery reaches then, over the best choice",
    "way home now less way home from there / 10 unit_s",
)
_HOME = (
    "way home / 10 unit_s",
    "when the first mate is free / 20 unit_s",
    "flying time left / 300 s",
    "1 where there are no more open waypoints than mates",
)
_FLIGHT = (
    "way to the first place / 50 m",
    "its radius / 15 m",
    "velocity along / 12 m/s",
    "velocity across / 12 m/s",
    "tilt along / 0.44 rad",
    "tilt across / 0.44 rad",
    "velocity of the inner loop along / 12 m/s",
    "and across / 12 m/s",
    "second place from the first, along / 50 m",
    "and across / 50 m",
    "its radius / 15 m",
    "third place from the second, along / 50 m",
    "and across / 50 m",
    "its radius / 15 m",
    "first place, how far down / 10 m",
    "second place below the first / 10 m",
    "descent / 3 m/s",
    "1 where the first is home",
    "1 where the second is home",
    "1 where the third is home",
    "way from the first to the second / 50 m",
)


def order_groups() -> tuple[Group, ...]:
    """What the order networks read; leg times are told in units of the mission, `unit_s`."""
    unused = tuple("0" for _ in range(N_ORDER - len(_CHOICE) - len(_HOME)))
    return (
        _group("waypoint", (*_CHOICE, *_WAYPOINT)),
        _group("home", (*_CHOICE, *_HOME, *unused)),
    )


def observed_groups() -> tuple[Group, ...]:
    """All numbers in their order."""
    return (*order_groups(), _group("flight", _FLIGHT))


def route_networks(hidden: int) -> RouteNetworks:
    """The networks that read them."""

    def layers(inputs: int) -> Mlp:
        return Mlp(inputs=inputs, hidden=(hidden, hidden), outputs=1, activation="relu")

    return RouteNetworks(order=layers(N_ORDER), home=layers(N_ORDER), flight=layers(N_FLIGHT))


def _group(name: str, meanings: tuple[str, ...]) -> Group:
    features = tuple(
        Feature(f"{name}_{k}", 1, -_LIMIT, _LIMIT, meaning) for k, meaning in enumerate(meanings)
    )
    return Group(name, 1, features)
