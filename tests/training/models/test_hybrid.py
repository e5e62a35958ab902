"""The hybrid's promises hold by construction; its spreads are those of samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.models.base import MARGIN, impulse
from pyroshock.training.models.hybrid import (
    Hybrid,
    ResidualPulse,
    _jacobian,
    measured_outputs,
    pulses_of,
    spreads_of,
)
from support.records.pulse_tables import pulse_table


@pytest.fixture(scope="module")
def table() -> PulseTable:
    return pulse_table(np.random.default_rng(4), repetitions=4)


def base_of(table: PulseTable) -> ResidualPulse:
    nominal = Analytic("hann").fit(table, np.random.default_rng(0)).predict(table.inputs)
    bound = 2 * table.impactor_mass_kg * table.column("impact_velocity")
    return ResidualPulse.of(nominal.force_n, nominal.contact_time_s, bound)


def fitted(table: PulseTable) -> Hybrid:
    return Hybrid(Analytic("hann"), LinearPowers()).fit(table, np.random.default_rng(0))


@pytest.mark.parametrize("size", [0.1, 3.0, 1000.0])
def test_promises_hold_for_any_outputs(table: PulseTable, size: float) -> None:
    base = base_of(table)
    outputs = size * np.random.default_rng(5).standard_normal((len(table), 20))
    pulse = pulses_of(outputs, base)
    assert np.all(pulse.force_n >= 0)
    assert np.all(pulse.force_n[:, [0, -1]] == 0)
    assert np.all(pulse.contact_time_s > 0)
    whole = impulse(pulse.force_n, pulse.contact_time_s)
    assert np.all(whole > 0)
    assert np.all(whole <= base.bound_n_s * (1 + 1e-12))


def test_outputs_bring_the_measured_pulse_back(table: PulseTable) -> None:
    base = base_of(table)
    pulse = pulses_of(measured_outputs(table, base), base)
    np.testing.assert_allclose(pulse.contact_time_s, table.contact_time_s)
    measured = np.maximum(table.force_n, 0)
    np.testing.assert_allclose(pulse.force_n, measured, atol=1e-9 * measured.max())
    pulse = pulses_of(np.zeros((len(table), 20)), base)
    np.testing.assert_allclose(pulse.root, base.root)
    np.testing.assert_allclose(pulse.contact_time_s, base.contact_time_s)
    base, outputs = base_of(table), np.full((len(table), 20), -9.0)
    np.testing.assert_array_equal(pulses_of(outputs, base).root, base.root)


def test_jacobian_is_that_of_differences(table: PulseTable) -> None:
    few = table.take(slice(0, 240, 40))
    base = base_of(few)
    outputs = measured_outputs(few, base)
    jacobian = _jacobian(pulses_of(outputs, base))
    for column in range(20):
        step = np.zeros(20)
        step[column] = 1e-6
        difference = (
            pulses_of(outputs + step, base).force_n - pulses_of(outputs - step, base).force_n
        )
        np.testing.assert_allclose(jacobian[:, :, column], difference / 2e-6, rtol=1e-5, atol=1e-3)


def test_spreads_are_those_of_samples(table: PulseTable) -> None:
    few, rng = table.take(slice(0, 240, 40)), np.random.default_rng(6)
    base = base_of(few)
    outputs = measured_outputs(few, base)
    correlation = 0.5 * np.eye(20) + 0.5
    spread = np.full(outputs.shape, 0.02)
    force, time = spreads_of(pulses_of(outputs, base), spread, correlation, np.array([0.01, 0.01]))
    draws = rng.multivariate_normal(np.zeros(20), 0.02**2 * correlation, 4000)
    sampled = [pulses_of(outputs[[row]] + draws, _repeated(base, row)) for row in range(len(few))]
    np.testing.assert_allclose(time, [pulse.contact_time_s.std() for pulse in sampled], rtol=0.05)
    inner = np.array([pulse.force_n.std(axis=0) for pulse in sampled])[:, 1:-1]
    np.testing.assert_allclose(force[:, 1:-1], inner, rtol=0.15)


def _repeated(base: ResidualPulse, row: int) -> ResidualPulse:
    return ResidualPulse(
        *(
            getattr(base, name)[np.full(4000, row)]
            for name in ("root", "contact_time_s", "bound_n_s", "share")
        )
    )


def test_allowance_tells_what_pulses_exceed(table: PulseTable) -> None:
    # The synthetic impulses are 1.6 m u.
    assert fitted(table).allowance_ == 1.0
    strong = replace(table, force_n=2 * table.force_n)
    momentum = 2 * table.impactor_mass_kg * table.column("impact_velocity")
    measured = impulse(np.maximum(strong.force_n, 0), strong.contact_time_s)
    assert fitted(strong).allowance_ == pytest.approx(MARGIN * np.max(measured / momentum))


def test_bound_holds_outside_the_domain(table: PulseTable) -> None:
    """A line continued to ten times the speed would leave it."""
    x = table.x.copy()
    x[:, 5] *= 10
    inputs = replace(table, x=x).inputs
    model = fitted(table)
    answer = model.predict(inputs)
    bound = 2 * table.impactor_mass_kg * x[:, 5] * model.allowance_
    whole = impulse(answer.force_n, answer.contact_time_s)
    assert np.all((whole > 0) & (whole <= bound * (1 + 1e-12)))
    assert np.all(answer.force_n[:, [0, -1]] == 0)
    assert np.all(answer.force_n >= 0)
