"""The contact before and after measured shots: balances in every draw, and what measured shots
narrow."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.contact import prior
from pyroshock.twin.contact.effects.effective_mass import EffectiveMass
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.prior import PriorContact
from pyroshock.twin.contact.shot_update import lower_roots
from pyroshock.twin.contact.uncertain_parameters import (
    ANVIL_VOLUME,
    COLUMNS,
    HAND_MASS,
    UncertainParameter,
)
from pyroshock.twin.contact_interface import ForcePulses, ImpactBatch
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.prediction import stratified_normals
from pyroshock.twin.setting import THESIS, Setting
from support.records.twin_parts import setting

SETTING = Setting(1.0, THESIS["steel"], 0.045, THESIS["steel"], 0.01, 23.4, tank_pressure_pa=2.78e5)
MATERIALS = st.sampled_from(list(THESIS.values()))


@st.composite
def settings(draw: st.DrawFn) -> Setting:
    anvil = draw(st.none() | MATERIALS)
    return Setting(
        impactor_mass_kg=draw(st.floats(0.05, 5.0)),
        tip=draw(MATERIALS),
        tip_radius_m=draw(st.floats(0.005, 0.1)),
        plate=draw(MATERIALS),
        plate_thickness_m=draw(st.sampled_from([0.005, 0.01, 0.03])),
        plate_mass_kg=8.0,
        impact_velocity_m_s=1.0,
        anvil=anvil,
        insulator="none" if anvil is None else draw(st.sampled_from(["none", "polymeric"])),
    )


def shots_of(
    given: list[Setting],
    velocity: list[float],
    force: list[float],
    time: list[float],
    impulse: list[float],
) -> MeasuredShots:
    """Measured shots without a plate, each a configuration of its own, velocities to 1 %."""
    n, u = len(given), np.array(velocity)
    nothing = np.zeros((n, 0))
    return MeasuredShots(
        tuple(given), np.arange(n), u, 0.01 * u, np.array(time), np.array(force), np.array(impulse),
        (), nothing,
        np.zeros(0), 10.0, np.zeros((n, 0, 0)),
    )  # fmt: skip


def draws(
    stage: PriorContact, setting: Setting, velocity: float, count: int = 64, seed: int = 0
) -> ForcePulses:
    z = stratified_normals(count, stage.normals, np.random.default_rng(seed))
    return stage.pulses(ImpactBatch([setting] * count, np.full(count, velocity)), z)


def band(values: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(values, (0.05, 0.95))
    return float(low), float(high)


@given(settings(), st.floats(0.1, 60.0), st.integers(0, 2**32 - 1))
def test_every_draw_keeps_momentum_and_energy(setting: Setting, velocity: float, seed: int) -> None:
    """The impulse is m u to 2 m u, so that no draw leaves faster than it came; m is the reduced
    mass at least where an anvil may fly on with the impactor."""
    stage = PriorContact()
    z = np.random.default_rng(seed).standard_normal((16, stage.normals))
    pulses = stage.pulses(ImpactBatch([setting] * 16, np.full(16, velocity)), z)
    share = pulses.impulse_n_s / (setting.impactor_mass_kg * velocity)
    least = np.ones(16)
    if setting.anvil is not None:
        mass = setting.anvil.density_kg_m3 * ANVIL_VOLUME.values(z[:, stage.names.index("anvil")])
        least = mass / (setting.impactor_mass_kg + mass)
    assert np.all((share >= least * (1 - 1e-6)) & (share <= 2 + 1e-6))
    assert np.all(pulses.force_n >= 0) and np.all(pulses.force_n[:, [0, -1]] == 0)
    assert np.all(
        (pulses.compression_time_s > 0) & (pulses.compression_time_s <= pulses.contact_time_s)
    )


@pytest.mark.parametrize(
    "parameter", [each for column in COLUMNS.values() for each in column], ids=lambda p: p.name
)
def test_parameters_are_drawn_from_their_documented_ranges(parameter: UncertainParameter) -> None:
    if parameter.effect is not None:
        documented = next(
            item for item in parameter.effect.parameters() if item.name == parameter.name
        ).likely
        assert documented[0] <= parameter.low < parameter.high <= documented[1]
    assert parameter.values(np.array([-2.0, 2.0])) == pytest.approx([parameter.low, parameter.high])


def test_a_hammers_mass_is_drawn_and_neither_a_bullets_nor_what_is_given() -> None:
    hammer, bullet = PriorContact(hand_held=True), PriorContact()
    assert hammer.normals == bullet.normals + 1
    assert draws(hammer, SETTING, 1.0).impulse_n_s.max() > 2.0
    heavy = PriorContact([EffectiveMass(1.5)], hand_held=True)
    assert np.all(draws(heavy, SETTING, 1.0).impulse_n_s <= 3.0 + 1e-6)
    assert HAND_MASS.values(np.array([-2.0, 2.0])) == pytest.approx((0.5, 3.0))
    fixed = PriorContact([PlasticYield(3.0)])
    assert fixed.normals == bullet.normals - 1
    assert fixed.label == "prior of 3 effects + contact.plastic_yield"
    assert bullet.label == "prior of 4 effects"


def test_zero_normals_are_the_nominal_pulse_and_pulses_do_not_depend_on_their_batch() -> None:
    stage, strikes = (
        PriorContact(),
        ImpactBatch([SETTING, replace(SETTING, anvil=THESIS["steel"])], np.array([2.0, 9.0])),
    )
    nominal, drawn = stage.pulses(strikes), stage.pulses(strikes, np.zeros((2, stage.normals)))
    np.testing.assert_allclose(drawn.force_n, nominal.force_n, rtol=1e-12)
    with pytest.raises(ValueError, match=r"z has shape \(1, 2\): expected \(1, 11\)"):
        PriorContact().pulses(ImpactBatch([SETTING], np.ones(1)), np.zeros((1, 2)))
    unknown = replace(SETTING, tip=replace(THESIS["delrin"], yield_strength_pa=None))
    many = ImpactBatch(
        [SETTING, unknown, replace(SETTING, anvil=THESIS["aluminum"])], np.array([3.0, 8.0, 30.0])
    )
    stage = PriorContact().updated(shots_of([SETTING], [10.0], [100e3], [4e-4], [13.0]))
    z = np.random.default_rng(0).standard_normal((3, stage.normals))
    together = stage.pulses(many, z)
    for row in range(3):
        alone = stage.pulses(
            ImpactBatch([many.settings[row]], many.impact_velocity_m_s[[row]]), z[[row]]
        )
        np.testing.assert_allclose(alone.force_n[0], together.force_n[row], rtol=1e-9)


def test_a_measured_shot_lies_in_the_prior_band_and_two_of_them_move_it_there() -> None:
    """A bullet of 1 kg with a tip of steel on a plate of steel, 2.78 bar: 143 kN and 0.60 ms were
    measured."""
    unlearned = PriorContact()
    before = draws(unlearned, SETTING, 10.0, 256)
    low, high = band(before.peak_force_n)
    assert low < 143e3 < high
    low, high = band(before.contact_time_s)
    assert low < 0.6e-3 < high
    twice = shots_of([SETTING] * 2, [10.0, 10.1], [143e3] * 2, [0.6e-3] * 2, [math.nan] * 2)
    after = draws(unlearned.updated(twice), SETTING, 10.0, 256)
    assert np.median(after.peak_force_n) == pytest.approx(143e3, rel=0.1)
    assert np.median(after.contact_time_s) == pytest.approx(0.6e-3, rel=0.15)
    narrow, wide = (band(pulses.peak_force_n) for pulses in (after, before))
    assert narrow[0] < 143e3 < narrow[1]
    assert 0.02 < math.log(narrow[1] / narrow[0]) < 0.5 * math.log(wide[1] / wide[0])


def test_shots_in_two_parts_are_the_shots_at_once_and_empty_ones_teach_nothing() -> None:
    both = shots_of(
        [SETTING] * 3, [9.0, 10.0, 11.0], [90e3, 100e3, 110e3], [4e-4] * 3, [12.0, 13.0, math.nan]
    )
    once, parts = (
        PriorContact().updated(both),
        PriorContact().updated(both.take([0])).updated(both.take([1, 2])),
    )
    assert once.shots == parts.shots == 3
    assert once.label == "contact law updated by 3 shots"
    np.testing.assert_allclose(
        draws(once, SETTING, 9.5).force_n, draws(parts, SETTING, 9.5).force_n, rtol=1e-6
    )
    nothing = shots_of(
        [SETTING] * 2, [math.nan, 10.0], [1e5, math.nan], [4e-4, math.nan], [math.nan] * 2
    )
    assert PriorContact().updated(nothing).shots == 0


def test_what_lies_beyond_the_learned_shots_is_said() -> None:
    light = replace(SETTING, impactor_mass_kg=0.5)
    stage = PriorContact().updated(
        shots_of([SETTING, light], [5.0, 10.0], [9e4, 8e4], [4e-4] * 2, [8.0, 7.0])
    )
    inside, fast = stage.extrapolation(
        ImpactBatch([SETTING, replace(light, tip_radius_m=0.03)], np.array([7.0, 12.0]))
    )
    assert inside == ()
    assert [(each.quantity, each.asked, each.low, each.high) for each in fast] == [
        ("impact_velocity_m_s", 12.0, 5.0, 10.0),
        ("tip_radius_m", 0.03, 0.045, 0.045),
    ]
    assert PriorContact().extrapolation(ImpactBatch([SETTING], np.array([99.0]))) == [()]


def test_it_goes_between_processes_and_more_settings_than_are_kept_are_no_matter(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stage = PriorContact().updated(shots_of([SETTING], [10.0], [100e3], [4e-4], [13.0]))
    again = pickle.loads(pickle.dumps(stage))
    np.testing.assert_array_equal(
        draws(again, SETTING, 9.0).force_n, draws(stage, SETTING, 9.0).force_n
    )
    monkeypatch.setattr(prior, "_KEPT", 3)
    stage = PriorContact().updated(shots_of([SETTING], [10.0], [100e3], [4e-4], [13.0]))
    many = ImpactBatch(
        [replace(SETTING, tip_radius_m=r) for r in np.linspace(0.02, 0.06, 9)],
        np.linspace(2, 20, 9),
    )
    np.testing.assert_array_equal(stage.pulses(many).force_n, stage.pulses(many).force_n)


def test_roots_of_a_covariance_that_rounding_has_spoilt() -> None:
    good = np.array([[2.0, 1.0], [1.0, 3.0]])
    spoilt = np.array([[1.0, 1.0], [1.0, 1.0 - 1e-7]])
    roots = lower_roots(np.array([good, spoilt]))
    np.testing.assert_allclose(roots @ np.swapaxes(roots, 1, 2), [good, spoilt], atol=1e-6)
    assert np.all(roots[:, 0, 1] == 0)


def test_a_hammers_anvil_passes_less_of_the_highest_frequencies_and_the_impulse_of_the_blow():
    """The joint's force on the plate is longer and lower than the tip's; without an anvil both are
    the same."""
    bare, anvil = (
        setting(impactor_mass_kg=0.3),
        setting(impactor_mass_kg=0.3, anvil=THESIS["steel"]),
    )
    stage, strikes = PriorContact(hand_held=True), ImpactBatch([bare, anvil], np.array([3.0, 3.0]))
    tip = stage.pulses(strikes)
    plate = stage.plate_pulses(strikes, None, tip)
    assert np.array_equal(plate.force_n[0], tip.force_n[0])
    assert plate.contact_time_s[0] == tip.contact_time_s[0]
    assert plate.contact_time_s[1] > 1.2 * tip.contact_time_s[1]
    assert plate.peak_force_n[1] < 0.8 * tip.peak_force_n[1]
    assert 0.3 * 3.0 <= plate.impulse_n_s[1] <= 2 * 0.3 * 3.0
    assert PriorContact().plate_pulses(strikes, None, tip) is tip
