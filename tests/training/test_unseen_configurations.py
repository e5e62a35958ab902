"""Models are judged on configurations that they have not learned from, by what the twin
predicts."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.dataset.table import POINTS, Predictor, PulseTable
from pyroshock.schema.impacts import BEFORE_CONTACT, INTEGRATED
from pyroshock.training.evaluation.unseen_configurations import (
    PulseDraws,
    prior_draws,
    unseen_draws,
    unseen_scores,
    updated_law_draws,
    without_configurations,
)
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.models.prior_pulses import (
    measured_shots,
    prior_contact,
    prior_pulses,
    settings_of,
    updated_contact,
    velocity_before,
)
from pyroshock.twin.contact.prior import MOST_PULSES
from pyroshock.twin.contact_interface import ForcePulses
from pyroshock.twin.setting import ElasticMaterial
from scipy.stats import norm
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.records.virtual_pulses import gun_shots


@pytest.fixture(scope="module")
def table() -> PulseTable:
    return pulse_table(np.random.default_rng(1), repetitions=3)


def scattered(factor: float, spread: float) -> PulseDraws:
    """The measured pulses times a factor, log-normal: the score is known in closed form."""

    def draws(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[ForcePulses]:
        force = np.repeat((unseen.peak_force_n * factor)[:, None], 3, axis=1)
        time = unseen.contact_time_s
        return [
            ForcePulses(time, force * np.exp(spread * rng.normal(size=(len(unseen), 1))), time / 2)
            for _ in range(count)
        ]

    return draws


def test_score_is_that_of_the_normal_law(table: PulseTable) -> None:
    offset, spread = 0.3, 0.2
    scores = unseen_scores(
        table,
        {"a": scattered(np.exp(offset), spread), "b": scattered(1.0, spread)},
        np.random.default_rng(0),
    )
    z = offset / spread
    expected = spread * (z * (2 * norm.cdf(z) - 1) + 2 * norm.pdf(z) - 1 / np.sqrt(np.pi))
    assert scores.crps[0][:, 0].mean() == pytest.approx(expected, rel=0.02)
    assert scores.crps[1][:, 0].mean() == pytest.approx(
        spread * (2 * norm.pdf(0) - 1 / np.sqrt(np.pi)), rel=0.05
    )
    assert scores.crps[0][:, 1] == pytest.approx(np.zeros(len(table)), abs=1e-12)
    assert not scores.first_is_better


def test_every_configuration_is_judged(table: PulseTable) -> None:
    scores = unseen_scores(
        table, {"a": scattered(1.1, 0.1), "b": scattered(1.0, 0.1)}, np.random.default_rng(0)
    )
    assert (scores.configurations, len(scores.configuration), scores.folds) == (60, 180, 5)
    assert scores.p_value(np.random.default_rng(0)) < 0.01
    many = pulse_table(np.random.default_rng(1), repetitions=10)
    scores = unseen_scores(
        many, {"a": scattered(1.1, 0.1), "b": scattered(1.0, 0.1)}, np.random.default_rng(0)
    )
    assert np.unique(scores.configuration, return_counts=True)[1].tolist() == [6] * 60


def test_no_model_sees_what_it_is_asked_for(table: PulseTable) -> None:
    learned: list[set[str]] = []

    class Watched(Analytic):
        def refit(self, pulses, rng):
            learned.append(set(pulses.configuration.tolist()))
            return super().refit(pulses, rng)

    asked: list[set[str]] = []
    model = Watched("hann").fit(table, np.random.default_rng(0))
    draws = unseen_draws(model, table)

    def watched(unseen: PulseTable, count: int, rng: np.random.Generator) -> list[ForcePulses]:
        asked.append(set(unseen.configuration.tolist()))
        return draws(unseen, count, rng)

    unseen_scores(table, {"a": watched, "b": prior_draws(table)}, np.random.default_rng(0))
    assert len(learned) == 5
    assert all(not known & unseen for known, unseen in zip(learned, asked, strict=True))


def test_settings_of_rows_are_those_of_the_table(table: PulseTable) -> None:
    row = int(np.flatnonzero(table.column("insulator") > 0)[0])
    setting = settings_of(table)[row]
    assert setting.tip.youngs_modulus_pa == table.column("tip_youngs_modulus")[row]
    assert setting.target.density_kg_m3 == table.column("plate_density")[row]
    assert setting.impactor_mass_kg == table.impactor_mass_kg[row]
    assert setting.impact_velocity_m_s == table.column("impact_velocity")[row]
    assert (setting.anvil is not None, setting.insulator) == (True, "polymeric")
    on_steel = table.take(table.target_material == "steel")
    (below,) = {
        (setting.plate.name, setting.plate.density_kg_m3)
        for setting in settings_of(on_steel, table)
    }
    assert below == ("aluminum", 2700.0)
    assert {setting.target.name for setting in settings_of(on_steel, table)} == {"steel"}
    assert {setting.plate.name for setting in settings_of(on_steel)} == {"steel"}  # no row tells it
    from dataclasses import replace

    with pytest.raises(ValueError, match="mass"):
        settings_of(replace(table, impactor_mass_kg=np.full(len(table), np.nan)))


def test_prior_pulses_scatter_about_a_contact(table: PulseTable) -> None:
    few = table.take(np.arange(4))
    pulses = prior_pulses(prior_contact(few), few, 32, np.random.default_rng(0))
    peaks = np.log([each.peak_force_n for each in pulses])
    assert peaks.shape == (32, 4)
    assert (np.std(peaks, axis=0) > 0.1).all()
    momentum = few.impactor_mass_kg * few.column("impact_velocity")
    impulses = np.array([each.impulse_n_s for each in pulses])
    assert (np.abs(np.log(np.median(impulses, axis=0) / momentum)) < np.log(3)).all()


def test_integrated_velocity_is_converted_to_that_before_contact(table: PulseTable) -> None:
    few = table.take(np.arange(0, 180, 9))
    velocity = few.column("impact_velocity")
    np.testing.assert_array_equal(velocity_before(few, BEFORE_CONTACT)[0], velocity)
    converted, uncertainty = velocity_before(few, INTEGRATED)
    assert (converted >= velocity).all()
    assert (uncertainty > 0).all()
    contact = prior_contact(few)
    before = prior_pulses(contact, few, 8, np.random.default_rng(0), INTEGRATED)
    faster = np.log([pulses.impulse_n_s for pulses in before])
    slower = np.log(
        [pulses.impulse_n_s for pulses in prior_pulses(contact, few, 8, np.random.default_rng(0))]
    )
    assert (faster.mean(axis=0) > slower.mean(axis=0)).all()


def test_shots_of_rows_are_what_was_measured(table: PulseTable) -> None:
    shots = measured_shots(table, INTEGRATED)
    np.testing.assert_array_equal(shots.peak_force_n, table.peak_force_n)
    np.testing.assert_array_equal(shots.contact_time_s, table.contact_time_s)
    np.testing.assert_array_equal(shots.impulse_n_s, table.impulse_n_s)
    np.testing.assert_array_equal(shots.impact_velocity_m_s, velocity_before(table, INTEGRATED)[0])
    assert all(
        len(np.unique(table.configuration[shots.configuration == row])) == 1 for row in range(60)
    )
    assert updated_contact(table).shots == MOST_PULSES < len(table)


def test_updated_law_has_not_seen_what_it_is_asked_for(table: PulseTable) -> None:
    # Draws with the unseen pulses in `learned` are those without them, to the bit.
    unseen = table.take(np.arange(0, 9))
    others = table.take(~np.isin(table.configuration, unseen.configuration))
    with_them, without = (
        updated_law_draws(learned, table)(unseen, 4, np.random.default_rng(0))
        for learned in (table, others)
    )
    for first, second in zip(with_them, without, strict=True):
        np.testing.assert_array_equal(first.force_n, second.force_n)
    model = entry_of("linear").make(BuildOptions()).fit(table, np.random.default_rng(0))
    assert without_configurations(model, table, ["elsewhere"], np.random.default_rng(0)) is model
    with pytest.raises(ValueError, match="without all configurations"):
        without_configurations(model, table, table.configuration.tolist(), np.random.default_rng(0))


def test_updated_law_predicts_better_than_the_prior() -> None:
    """Unseen configurations of the virtual bench's gun, whose laws are others than the twin's."""
    table = gun_table(5)
    predictions = {
        "far": scattered(2.0, 0.1),
        "law": updated_law_draws(table, table),
        "prior": prior_draws(table),
    }
    scores = unseen_scores(table, predictions, np.random.default_rng(0))
    far, law, prior = (crps.mean() for crps in scores.crps)
    assert law < 0.8 * prior
    assert not scores.first_is_better
    figures = scores.figures()
    assert (figures["crps.candidate"], figures["crps.reference"], figures["crps.prior"]) == (
        far,
        law,
        prior,
    )


def gun_table(seed: int) -> PulseTable:
    """Measured pulses of 20 configurations, two each, as the dataset `gun` has them."""
    shots, _ = gun_shots(seed, configurations=20, repetitions=2)
    anvils, layers = ("none", "aluminum", "steel"), ("none", "polymeric")
    rows = [
        (
            *(
                setting.tip_radius_m,
                *quantities(setting.tip),
                velocity,
                *quantities(setting.target),
            ),
            *(
                anvils.index(setting.anvil.name if setting.anvil else "none"),
                layers.index(setting.insulator),
            ),
            *(setting.impactor_mass_kg, 0.0003 * setting.plate.density_kg_m3),
        )
        for setting, velocity in zip(shots.settings, shots.impact_velocity_m_s, strict=True)
    ]
    hammer = [predictor for predictor in PREDICTORS if predictor.name != "boundary_conditions"]
    n = len(shots)
    half_sine = np.sin(np.pi * np.linspace(0.0, 1.0, POINTS))
    names = np.array([f"{number}" for number in shots.configuration])
    return PulseTable(
        predictors=(*hammer, Predictor("bullet_mass", "kg"), Predictor("plate_mass", "kg")),
        x=np.array(rows, dtype=np.float64),
        impactor_mass_kg=np.array([setting.impactor_mass_kg for setting in shots.settings]),
        plate_thickness_m=np.array([setting.plate_thickness_m for setting in shots.settings]),
        force_n=shots.peak_force_n[:, None] * half_sine,
        contact_time_s=shots.contact_time_s,
        compression_time_s=shots.contact_time_s / 2,
        peak_force_n=shots.peak_force_n,
        impulse_n_s=shots.impulse_n_s,
        compression_impulse_n_s=shots.impulse_n_s / 2,
        configuration=names,
        treatment=names,
        tip_material=np.array([setting.tip.name for setting in shots.settings]),
        target_material=np.array([setting.target.name for setting in shots.settings]),
        campaign=np.full(n, "virtual"),
        run=shots.configuration.astype(np.int64),
        repetition=np.arange(n) % 2 + 1,
        key=np.array([f"virtual-{row}" for row in range(n)]),
        pulse_id=np.arange(1, n + 1),
    )


def quantities(material: ElasticMaterial) -> tuple[float, float, float, float]:
    strength = material.yield_strength_pa
    assert strength is not None
    return material.youngs_modulus_pa, material.poisson_ratio, material.density_kg_m3, strength
