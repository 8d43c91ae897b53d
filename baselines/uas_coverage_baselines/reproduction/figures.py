"""The figures of one UAS, of the paper's curves and of a flight by the same lines."""

from dataclasses import asdict, dataclass

from uas_coverage_baselines.reproduction.published import Curves, PublishedFigure
from uas_coverage_env.flight import Flight

_J_PER_WH = 3600.0


@dataclass(frozen=True)
class UasFigures:
    """What the battery's curves say of one flight.

    Attributes:
        steps: Until it has landed, or the flight ended.
        energy_Wh: Sum over samples of voltage times current times dt.
        final_charge: State of charge in the end.
        mean_power_W: Of the samples in the air, like all that follow.
        least_power_W: See above.
        largest_power_W: See above.
        mean_current_A: See above.
        least_current_A: See above.
        largest_current_A: See above.
        mean_voltage_V: See above.
        least_voltage_V: See above.
    """

    steps: int
    energy_Wh: float
    final_charge: float
    mean_power_W: float
    least_power_W: float
    largest_power_W: float
    mean_current_A: float
    least_current_A: float
    largest_current_A: float
    mean_voltage_V: float
    least_voltage_V: float

    @classmethod
    def of(cls, curves: Curves, dt_s: float) -> "UasFigures":
        """Those of curves.

        Args:
            curves: Of one UAS.
            dt_s: Length of a step [s].
        """
        power_W = curves.voltage_V * curves.current_A
        return cls(
            steps=len(power_W),
            energy_Wh=float(power_W.sum()) * dt_s / _J_PER_WH,
            final_charge=float(curves.soc[-1]),
            mean_power_W=float(power_W.mean()),
            least_power_W=float(power_W.min()),
            largest_power_W=float(power_W.max()),
            mean_current_A=float(curves.current_A.mean()),
            least_current_A=float(curves.current_A.min()),
            largest_current_A=float(curves.current_A.max()),
            mean_voltage_V=float(curves.voltage_V.mean()),
            least_voltage_V=float(curves.voltage_V.min()),
        )

    def value(self, figure: PublishedFigure) -> float:
        """The figure of a name."""
        return float(asdict(self)[figure.name])


def flown_curves(flight: Flight) -> tuple[Curves, ...]:
    """The curves of each UAS of a flight, up to its landing."""
    result = []
    for i, last in enumerate(flight.last_sample):
        air = slice(0, int(last))
        result.append(
            Curves(
                soc=flight.soc[: int(last) + 1, i],
                voltage_V=flight.voltage_V[air, i],
                current_A=flight.current_A[air, i],
            )
        )
    return tuple(result)


def figures_of(flight: Flight) -> tuple[UasFigures, ...]:
    """The figures of each UAS of a flight of at least one step."""
    return tuple(UasFigures.of(curves, flight.scenario.dt_s) for curves in flown_curves(flight))
