"""Models are judged on configurations that they have not learned from, by what the twin predicts."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable
from pyroshock.schema.velocity_kinds import BEFORE_CONTACT, INTEGRATED
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.prior_pulses import prior_pulses, settings_of, velocity_before
from pyroshock.training.unseen_configurations import (
    PulseDraws,
    prior_draws,
    unseen_draws,
    unseen_scores,
    without_configurations,
)
from pyroshock.training.zoo import Making, entry_of
from pyroshock.twin.strikes import Pulses
from scipy.stats import norm
from support.records.pulse_tables import pulse_table


@pytest.fixture(scope="module")
def table() -> PulseTable:
    return pulse_table(np.random.default_rng(1), repetitions=3)


def scattered(factor: float, spread: float) -> PulseDraws:
    """The measured pulses times a factor, log-normal: the score is known in closed form."""

    def draws(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[Pulses]:
        force = np.repeat((unseen.peak_force_n * factor)[:, None], 3, axis=1)
        time = unseen.contact_time_s
        return [
            Pulses(time, force * np.exp(spread * rng.normal(size=(len(unseen), 1))), time / 2) for _ in range(count)
        ]

    return draws


def test_score_is_that_of_the_normal_law(table: PulseTable) -> None:
    offset, spread = 0.3, 0.2
    scores = unseen_scores(
        table, {"a": scattered(np.exp(offset), spread), "b": scattered(1.0, spread)}, np.random.default_rng(0)
    )
    z = offset / spread
    expected = spread * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))
    assert scores.crps[0][:, 0].mean() == pytest.approx(expected, rel=0.02)
    assert scores.crps[1][:, 0].mean() == pytest.approx(spread * (2 * norm.pdf(0) - 1 / np.sqrt(np.pi)), rel=0.05)
    assert scores.crps[0][:, 1] == pytest.approx(np.zeros(len(table)), abs=1e-12)
    assert not scores.first_is_better


def test_every_configuration_is_judged(table: PulseTable) -> None:
    scores = unseen_scores(table, {"a": scattered(1.1, 0.1), "b": scattered(1.0, 0.1)}, np.random.default_rng(0))
    assert (scores.configurations, len(scores.configuration), scores.folds) == (60, 180, 5)
    assert scores.p_value(np.random.default_rng(0)) < 0.01


def test_many_repetitions_are_thinned(table: PulseTable) -> None:
    many = pulse_table(np.random.default_rng(1), repetitions=10)
    scores = unseen_scores(many, {"a": scattered(1.1, 0.1), "b": scattered(1.0, 0.1)}, np.random.default_rng(0))
    assert np.unique(scores.configuration, return_counts=True)[1].tolist() == [6] * 60


def test_no_model_sees_what_it_is_asked_for(table: PulseTable) -> None:
    learned: list[set[str]] = []

    class Watched(Analytic):
        def refit(self, pulses, rng):  # type: ignore[no-untyped-def]
            learned.append(set(pulses.configuration.tolist()))
            return super().refit(pulses, rng)

    asked: list[set[str]] = []
    model = Watched("hann").fit(table, np.random.default_rng(0))
    draws = unseen_draws(model, table)

    def watched(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[Pulses]:
        asked.append(set(unseen.configuration.tolist()))
        return draws(unseen, count, rng)

    unseen_scores(table, {"a": watched, "b": prior_draws()}, np.random.default_rng(0))
    assert len(learned) == 5
    assert all(not known & unseen for known, unseen in zip(learned, asked, strict=True))


def test_model_of_other_configurations_is_not_refitted(table: PulseTable) -> None:
    model = entry_of("linear").make(Making()).fit(table, np.random.default_rng(0))
    assert without_configurations(model, table, ["elsewhere"], np.random.default_rng(0)) is model
    with pytest.raises(ValueError, match="without all configurations"):
        without_configurations(model, table, table.configuration.tolist(), np.random.default_rng(0))


def test_settings_of_rows_are_those_of_the_table(table: PulseTable) -> None:
    row = int(np.flatnonzero(table.column("insulator") > 0)[0])
    setting = settings_of(table)[row]
    assert setting.tip.youngs_modulus_pa == table.column("tip_youngs_modulus")[row]
    assert setting.target.density_kg_m3 == table.column("plate_density")[row]
    assert setting.impactor_mass_kg == table.impactor_mass_kg[row]
    assert setting.impact_velocity_m_s == table.column("impact_velocity")[row]
    assert (setting.anvil is not None, setting.insulator) == (True, "polymeric")


def test_prior_pulses_scatter_about_a_contact(table: PulseTable) -> None:
    few = table.take(np.arange(4))
    pulses = prior_pulses(few, 32, np.random.default_rng(0))
    peaks = np.log([each.peak_force_n for each in pulses])
    assert peaks.shape == (32, 4)
    assert (np.std(peaks, axis=0) > 0.1).all()
    momentum = few.impactor_mass_kg * few.column("impact_velocity")
    impulses = np.array([each.impulse_n_s for each in pulses])
    assert (np.abs(np.log(np.median(impulses, axis=0) / momentum)) < np.log(3)).all()


def test_integrated_velocity_is_converted_to_that_before_contact(table: PulseTable) -> None:
    few = table.take(np.arange(0, 180, 9))
    velocity = few.column("impact_velocity")
    np.testing.assert_array_equal(velocity_before(few, BEFORE_CONTACT), velocity)
    assert (velocity_before(few, INTEGRATED) >= velocity).all()
    faster = np.log([pulses.impulse_n_s for pulses in prior_pulses(few, 8, np.random.default_rng(0), INTEGRATED)])
    slower = np.log([pulses.impulse_n_s for pulses in prior_pulses(few, 8, np.random.default_rng(0))])
    assert (faster.mean(axis=0) > slower.mean(axis=0)).all()


def test_dataset_without_a_mass_has_no_prior(table: PulseTable) -> None:
    from dataclasses import replace

    with pytest.raises(ValueError, match="mass"):
        settings_of(replace(table, impactor_mass_kg=np.full(len(table), np.nan)))
