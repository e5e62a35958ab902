"""The nominal laws as models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import POINTS, Inputs, Predictor
from pyroshock.training.estimators.base import NotFittedError
from pyroshock.training.models.analytic import Analytic
from pyroshock.twin.contact.laws import LAWS, LOSSY
from support.records.pulse_tables import MASS_KG, inputs_at, pulse_table

TABLE = pulse_table(np.random.default_rng(0), repetitions=2)
RNG = np.random.default_rng(1)
every_law = pytest.mark.parametrize("law", LAWS)


def _fitted(law: str, restitution: str | None = None) -> Analytic:
    return Analytic(law, restitution).fit(TABLE, RNG)


def _without(quantity: str) -> Inputs:
    return replace(TABLE.inputs, **{quantity: np.full(len(TABLE), np.nan)})


@every_law
def test_pulses_have_the_models_form_and_come_back_from_a_file(law: str) -> None:
    model = _fitted(law)
    prediction = model.predict(TABLE.inputs)
    assert prediction.force_n.shape == (len(TABLE), POINTS)
    assert prediction.contact_time_s.shape == (len(TABLE),)
    assert prediction.force_spread_n is None
    assert prediction.contact_time_spread_s is None
    again = Analytic(**model.settings()).restore(model.arrays())
    assert np.array_equal(again.predict(TABLE.inputs).force_n, prediction.force_n)


def test_quantities_of_the_bench_are_seen() -> None:
    # A bench of Table 4.2: delrin, R = 30 mm, 0.32 kg at 1 m/s on steel, by hand.
    inputs = inputs_at(TABLE, impact_velocity=1.0)
    row = int(
        np.flatnonzero((TABLE.tip_material == "delrin") & (TABLE.target_material == "steel"))[0]
    )
    compliance = (1 - 0.35**2) / 3.2e9 + (1 - 0.3**2) / 200e9
    expected = 2.8683 * (MASS_KG**2 * compliance**2 / 0.03) ** 0.2
    assert _fitted("hertz").predict(inputs).contact_time_s[row] == pytest.approx(expected, rel=1e-4)
    predictors = (*TABLE.predictors, Predictor("bullet_mass", "kg"))
    mass = np.linspace(0.2, 1.0, len(TABLE))
    gun = replace(
        TABLE,
        predictors=predictors,
        x=np.c_[TABLE.x, mass],
        impactor_mass_kg=np.full(len(TABLE), np.nan),
    )
    pulse = Analytic("hertz").fit(gun, RNG).pulse(gun.inputs)
    assert pulse.impulse_n_s == pytest.approx(2 * mass * gun.column("impact_velocity"))
    assert np.all(_fitted("hunter").predict(_without("impactor_mass_kg")).contact_time_s > 0)
    assert np.all(_fitted("hertz").predict(_without("plate_thickness_m")).contact_time_s > 0)


@pytest.mark.parametrize("law", LOSSY)
def test_restitution_is_a_setting_and_needs_a_thickness(law: str) -> None:
    zener, chosen = (
        _fitted(law, name).predict(TABLE.inputs).force_n for name in (None, "weir-tallon")
    )
    assert not np.allclose(zener, chosen)
    with pytest.raises(
        ValueError, match=r"plate_thickness_m.*thickness_m in \[bench\.plate\] of campaign\.toml"
    ):
        _fitted(law).predict(_without("plate_thickness_m"))


@pytest.mark.parametrize("law", ["hertz", "hann", "hunt-crossley"])
def test_missing_mass_says_where_to_give_it(law: str) -> None:
    with pytest.raises(
        ValueError, match=r"impactor_mass_kg.*mass_kg in \[bench\.hammer\] of campaign\.toml"
    ):
        _fitted(law).predict(_without("impactor_mass_kg"))


def test_what_a_law_cannot_take_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="tip_radius"):
        other = (Predictor("tip_radius", "mm"), *TABLE.predictors[1:])
        _fitted("hertz").predict(replace(TABLE.inputs, predictors=other))
    for ask in (lambda: Analytic("reed").predict(TABLE.inputs), Analytic("reed").arrays):
        with pytest.raises(NotFittedError, match="reed"):
            ask()
    with pytest.raises(ValueError, match="analytic"):
        Analytic("reed").restore({"force.alpha": np.zeros(3)})
    with pytest.raises(LookupError, match="no law of contact 'hanning'"):
        Analytic("hanning")
    with pytest.raises(ValueError, match=r"impact_velocity_m_s = 0\.0: expected positive"):
        _fitted("hertz").predict(inputs_at(TABLE, impact_velocity=0.0))
