"""Published and recorded shots: Table 5.1, eq. 5.1 to 5.3, and another gun's."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from pyroshock.twin.effects import effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.chambers import choked_flow, critical_ratio
from pyroshock.twin.gun.measured import (
    corner_leakage,
    corner_velocity_ratio,
    percentage_error,
    thesis_spread,
    velocity_spread,
    velocity_uncertainty_m_s,
)
from pyroshock.twin.gun.motion_kernel import ellipse
from pyroshock.twin.gun.shots import gun_velocity

#: Table 5.1: pressure, measured and predicted velocity, uncertainty, error in percent.
PRESSURE = np.array([0.2319, 0.2651, 0.4042, 0.5784, 0.6158]) * 1e5
MEASURED = np.array([10.366, 11.872, 13.799, 16.346, 18.973])
PREDICTED = np.array([10.58, 11.35, 14.13, 16.98, 17.53])
UNCERTAINTY = np.array([0.13, 0.15, 0.18, 0.23, 0.28])
ERROR = np.array([-2.1, 4.4, -2.4, -3.9, 7.6])
THESIS = GunBench(0.0095, 0.049, 0.048, 0.90, 1.464, 1.4, 0.5)


def test_table_5_1_is_predicted_with_its_errors_uncertainties_and_spread():
    np.testing.assert_allclose(gun_velocity(THESIS, PRESSURE, 0.1428).velocity_m_s, PREDICTED, atol=0.009)
    errors = percentage_error(MEASURED, PREDICTED)
    np.testing.assert_allclose(errors, ERROR, atol=0.06)
    assert np.abs(errors).mean() == pytest.approx(4.07, abs=0.01)
    np.testing.assert_allclose(velocity_uncertainty_m_s(MEASURED, 0.085, 1e-3, 4e-5), UNCERTAINTY, atol=0.006)
    assert thesis_spread().log_sd == pytest.approx(velocity_spread(MEASURED, PREDICTED).log_sd, rel=0.01)


def test_spread_of_known_ratios_and_corner_losses():
    spread = velocity_spread(10 * np.exp([0.1, 0.2, 0.3]), np.full(3, 10.0))
    assert (spread.log_mean, spread.log_sd, spread.shots) == (pytest.approx(0.2), pytest.approx(0.1), 3)
    found = velocity_spread([0.0, 0.2, 8.0, 9.0, 5.0], [4.0, 0.1, 0.5, 0.0, 2.5])
    assert found.shots == 3
    assert found.log_mean == pytest.approx(np.log(2 * 16 * 2) / 3)
    pair = velocity_spread([2.0, 8.0], [1.0, 1.0])
    assert (pair.shots, pair.log_sd) == (2, pytest.approx(np.log(4) / np.sqrt(2)))
    with pytest.raises(ValueError, match="1 shots with both velocities"):
        velocity_spread([2.0, 0.0], [1.0, 1.0])
    # And explains an efficiency of a half by leakage; the first share outside of 0 to 1 is named.
    np.testing.assert_allclose(1 - corner_velocity_ratio([0.4, 0.6]), [0.30, 0.47], atol=0.005)
    assert corner_leakage(0.5) == pytest.approx(1 - 0.5 ** (10 / 7), rel=1e-12)
    np.testing.assert_allclose(corner_leakage(corner_velocity_ratio([0, 0.3, 1])), [0, 0.3, 1], atol=1e-12)
    for share, name in (([0.5, 1.2], r"1\.2"), ([0.5, -0.5, 1.2], r"-0\.5")):
        with pytest.raises(ValueError, match=rf"leakage = {name}: expected 0 to 1"):
            corner_velocity_ratio(share)
    with pytest.raises(ValueError, match=r"velocity_ratio = 1\.5: expected 0 to 1"):
        corner_leakage([1.0, 1.5])


def test_effects_bring_another_gun_near_its_record(real_data):
    """74 shots of a small gun; dead volume, friction and valve (3 mm) as its author gives them, none fitted here."""
    bore = 13.3858e-3
    bench = GunBench(18.03e-6, bore, bore, 0.3048, 0.0, 1.4, 1.0)
    with (real_data / "trettel-blastersim" / "shots.csv").open(newline="") as handle:
        rows = [row for row in csv.DictReader(handle) if row["v_m_s"] != "did_not_exit"]
    pressure = np.array([float(row["p_gauge_kPa"]) * 1e3 for row in rows])
    measured = np.array([float(row["v_m_s"]) for row in rows])
    effects = [
        effect("gun.back_pressure", atmosphere_pa=101_350.0),
        effect("gun.dead_volume", volume_m3=18e-6),
        effect("gun.valve_flow", loss_coefficient=(bore / 3e-3) ** 4, opening_time_s=0.0),
    ]
    nominal = gun_velocity(bench, pressure, 0.98e-3).velocity_m_s
    with_effects = gun_velocity(bench, pressure, 0.98e-3, effects).velocity_m_s
    high = pressure > 250e3
    assert np.all(nominal > 1.5 * measured)
    assert abs(velocity_spread(measured[high], with_effects[high]).log_mean) < 0.15
    stuck = gun_velocity(bench, 172_369.0, 0.98e-3, effects)
    assert stuck.words() == ["stopped in the barrel"]
    assert math.isnan(stuck.exit_time_s[0])


def test_flow_follows_a_nozzle_up_to_small_drops():
    """De Saint-Venant and Wantzel, air."""
    g, ratio = 1.4, np.linspace(0.53, 0.99, 200)
    nozzle = np.sqrt(2 * g / (g - 1) * (ratio ** (2 / g) - ratio ** ((g + 1) / g))) / choked_flow(g)
    error = np.abs(np.array([ellipse(each, critical_ratio(g))[0] for each in ratio]) / nozzle - 1)
    assert error[ratio < 0.9].max() < 0.004
    assert error.max() < 0.015
