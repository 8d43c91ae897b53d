"""The published battery curves (Gasche et al., Fig. 3) against the battery and the LPV model.

The file beside this one holds the curves read from the figure: state of charge to 1e-6, voltage
and current to 1e-4. Nothing is fitted here.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from uas_coverage_env.vehicle import linear_model, load_vehicle, simulate_battery
from uas_coverage_env.vehicle.layout import DELTA_THRUST, DOD, N_INPUTS, N_STATES, U_TH

S500 = load_vehicle("s500_v2")
SOC, VOLTAGE, CURRENT = range(3)


class Curve(NamedTuple):
    soc: np.ndarray
    voltage_V: np.ndarray
    current_A: np.ndarray

    @property
    def airborne(self) -> int:
        """Number of samples before the landing, from which on no current flows."""
        return int(np.count_nonzero(self.current_A))


def published(uas: int) -> Curve:
    path = Path(__file__).with_name("fig3_battery_reference.csv")
    data = np.genfromtxt(path, delimiter=",", names=True)
    return Curve(data[f"soc_uas{uas}"], data[f"voltage_uas{uas}_V"], data[f"current_uas{uas}_A"])


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def polarisation_V(curve: Curve) -> np.ndarray:
    """u_th before each sample: what discharge curve and R_0 leave of the replayed voltage."""
    _, voltage = simulate_battery(S500, curve.current_A, curve.soc[0])
    battery = S500.battery
    ocv = np.interp(1.0 - curve.soc, battery.ocv_dod, battery.ocv_V)
    return ocv - voltage - battery.resistance_0_ohm * curve.current_A


def state(dod: float, u_th_V: float) -> np.ndarray:
    x = np.zeros(N_STATES)
    x[DOD], x[U_TH] = dod, u_th_V
    return x


@pytest.mark.parametrize("uas", [1, 2])
def test_the_published_current_replayed_gives_the_published_state_of_charge(uas):
    curve = published(uas)
    soc, _ = simulate_battery(S500, curve.current_A, curve.soc[0])
    assert np.abs(soc - curve.soc).max() < 1e-6


@pytest.mark.parametrize("uas", [1, 2])
def test_the_published_current_replayed_gives_the_published_voltage(uas):
    curve = published(uas)
    _, voltage = simulate_battery(S500, curve.current_A, curve.soc[0])
    assert rms(voltage - curve.voltage_V) < 1e-4


@pytest.mark.parametrize(("uas", "sample"), [(1, 0), (1, 246), (2, 0)])
def test_the_linear_model_draws_the_published_current_in_hover(uas, sample):
    curve = published(uas)
    x = state(1.0 - curve.soc[sample], polarisation_V(curve)[sample])
    model = linear_model(S500, x[DOD])
    hover = (model.C @ x + model.F)[CURRENT]
    assert hover == pytest.approx(curve.current_A[sample], abs=5e-4)


@pytest.mark.parametrize(("uas", "energy_Wh"), [(1, 14.18), (2, 8.36)])
def test_published_and_replayed_voltage_give_the_published_energy(uas, energy_Wh):
    curve = published(uas)
    _, voltage = simulate_battery(S500, curve.current_A, curve.soc[0])
    for volt in (curve.voltage_V, voltage):
        assert round(float(volt @ curve.current_A) / 3600.0, 2) == energy_Wh


@pytest.mark.parametrize("uas", [1, 2])
def test_the_lpv_battery_reproduces_the_curves_from_the_excess_thrust_they_imply(uas):
    curve = published(uas)
    u_th = polarisation_V(curve)
    x, u = state(1.0 - curve.soc[0], 0.0), np.zeros(N_INPUTS)
    outputs = []
    for k in range(curve.airborne):
        seen = linear_model(S500, 1.0 - curve.soc[k])
        hover = (seen.C @ state(1.0 - curve.soc[k], u_th[k]) + seen.F)[CURRENT]
        u[DELTA_THRUST] = (curve.current_A[k] - hover) / seen.D[CURRENT, DELTA_THRUST]
        model = linear_model(S500, x[DOD])
        outputs.append(model.C @ x + model.D @ u + model.F)
        x = model.A @ x + model.B @ u + model.E
    soc, voltage, current = np.array(outputs).T
    airborne = slice(curve.airborne)
    assert rms(soc - curve.soc[airborne]) < 1e-6
    assert np.abs(soc - curve.soc[airborne]).max() < 2e-6
    assert rms(voltage - curve.voltage_V[airborne]) < 1e-4
    assert rms(current - curve.current_A[airborne]) < 1e-4
    assert 1.0 - x[DOD] == pytest.approx(curve.soc[curve.airborne], abs=2e-6)


@pytest.mark.parametrize(("uas", "other"), [(1, 2), (2, 1)])
def test_hover_power_and_the_others_mean_excess_foretell_the_charge_left(uas, other):
    seen, curve = published(other), published(uas)
    u_th, excess = polarisation_V(seen), []
    for k in range(seen.airborne):
        model = linear_model(S500, 1.0 - seen.soc[k])
        hover = (model.C @ state(1.0 - seen.soc[k], u_th[k]) + model.F)[CURRENT]
        excess.append((seen.current_A[k] - hover) / model.D[CURRENT, DELTA_THRUST])
    x, u = state(1.0 - curve.soc[0], 0.0), np.zeros(N_INPUTS)
    u[DELTA_THRUST] = np.mean(excess)
    for k in range(curve.airborne):
        assert 1.0 - x[DOD] == pytest.approx(curve.soc[k], abs=1.3e-3)
        model = linear_model(S500, x[DOD])
        x = model.A @ x + model.B @ u + model.E


def test_the_landed_battery_relaxes_as_published():
    curve = published(2)
    _, voltage = simulate_battery(S500, curve.current_A, curve.soc[0])
    landed = slice(curve.airborne, None)
    assert np.abs(voltage - curve.voltage_V)[landed].max() < 1e-4
    assert np.ptp(curve.voltage_V[landed]) > 0.2
