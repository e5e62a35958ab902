"""Every family outside of the catalogue acts in its own stage, where its text says, and in no
other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.validation.cases.contact_case import CasePulse
from pyroshock.validation.cases.designs import CaseSetting
from pyroshock.validation.cases.unknown_effects import UnknownEffect
from pyroshock.validation.cases.unknowns import FAMILIES
from pyroshock.virtualbench.plate.modes import PlateModes

#: Tips, insulators, bullets and pressures that let each family find what it acts on.
PLAN = tuple(
    CaseSetting(
        tip, radius, insulator=insulator, tank_pressure_bar=pressure, mass_kg=mass, pulse_s=pulse_s
    )
    for tip, radius, insulator, pulse_s in (
        ("delrin", 30.0, "none", 1e-3),
        ("steel", 45.0, "polymeric", 2e-3),
    )
    for pressure in (1.0, 6.0)
    for mass in (0.2, 0.4, 0.6)
)
RATE_HZ = 100e3
LOUDEST_N = 2000.0
ORDER = np.linspace(0, 1, len(PLAN))


def case_pulse(peak_n: float = LOUDEST_N) -> CasePulse:
    """A half-sine of 0.2 ms."""
    return CasePulse(peak_n * np.sin(np.pi * np.linspace(0, 1, 201)), 1e-6)


def plate_modes() -> PlateModes:
    rng = np.random.default_rng(1)
    frequencies_hz = 300.0 * np.arange(1, 9)
    return PlateModes(
        frequencies_hz,
        np.full(8, 0.01),
        rng.normal(size=(1, 8)),
        rng.normal(size=(2, 8)),
        ("a", "b"),
    )


def ringing(samples: int = 2000) -> Floats:
    """Accelerations (2, n) that ring at 0.4 and 3 kHz after a rest."""
    time = np.maximum(np.arange(samples) - 200, 0) / RATE_HZ
    rings = [np.sin(2 * np.pi * f * time) * np.exp(-time / 4e-3) for f in (400.0, 3000.0)]
    return np.array([rings[0] + rings[1], rings[1] - rings[0]])


def velocity_change(effect: UnknownEffect) -> Floats:
    return effect.ln_velocity(PLAN, np.zeros(len(PLAN)), ORDER)


def pulses_of(effect: UnknownEffect) -> list[CasePulse]:
    return [
        effect.pulse(setting, case_pulse((0.3 + 0.7 * place) * LOUDEST_N), place, LOUDEST_N)
        for setting, place in zip(PLAN, ORDER, strict=True)
    ]


def changes_of_pulses(effect: UnknownEffect) -> Floats:
    """Of ln peak, impulse and width (n, 3)."""
    untouched = pulses_of(replace(effect, family=""))
    return np.array(
        [a.figures - b.figures for a, b in zip(pulses_of(effect), untouched, strict=True)]
    )


def plate_is_changed(effect: UnknownEffect) -> bool:
    before = plate_modes()
    after = [effect.modes(before, share * LOUDEST_N, LOUDEST_N, share) for share in (0.3, 1.0)]
    read = [effect.acceleration(setting, ringing(), RATE_HZ, 0.9, 1.0) for setting in PLAN]
    fields = ("frequencies_hz", "damping", "shape_impact", "shapes")
    same_modes = all(
        np.array_equal(getattr(m, name), getattr(before, name)) for m in after for name in fields
    )
    return not same_modes or any(not np.array_equal(a, ringing()) for a in read)


@pytest.mark.parametrize("name", FAMILIES)
def test_family_changes_its_own_stage_and_no_other(name: str) -> None:
    family = FAMILIES[name]
    effect = UnknownEffect(name, family.high / 2, PLAN)
    changed = {
        "gun": bool(np.any(velocity_change(effect) != 0)),
        "contact": bool(np.any(np.abs(changes_of_pulses(effect)) > 1e-6)),
        "plate": plate_is_changed(effect),
    }
    assert changed == {stage: stage == family.stage for stage in changed}


@pytest.mark.parametrize(
    "name", [name for name, family in FAMILIES.items() if family.stage == "gun"]
)
def test_velocity_changes_in_proportion_to_the_amount_and_by_no_more_than_it_says(
    name: str,
) -> None:
    low, high = (velocity_change(UnknownEffect(name, amount, PLAN)) for amount in (0.1, 0.2))
    assert high == pytest.approx(2 * low) and np.all(np.isfinite(high))
    assert np.all(velocity_change(UnknownEffect(name, 0.0, PLAN)) == 0)


def test_effects_of_one_part_of_the_plan_leave_the_others_alone() -> None:
    tight = velocity_change(UnknownEffect("gun.tight_sabot", 0.3, PLAN))
    assert np.array_equal(tight != 0, [setting.mass_kg == 0.4 for setting in PLAN])
    cleaned = velocity_change(UnknownEffect("gun.cleaned_barrel", 0.3, PLAN))
    assert np.array_equal(cleaned, np.where(ORDER > 0.5, 0.3, 0.0))
    loose = changes_of_pulses(UnknownEffect("contact.loose_tip", 0.3, PLAN))
    assert np.array_equal(
        np.abs(loose).max(axis=1) > 1e-9, [setting.tip_material == "delrin" for setting in PLAN]
    )
    torn = changes_of_pulses(UnknownEffect("contact.torn_layer", 0.3, PLAN))
    assert np.array_equal(
        np.abs(torn).max(axis=1) > 1e-9, [setting.insulator != "none" for setting in PLAN]
    )


def test_readings_are_cut_slowed_and_split_as_their_texts_say() -> None:
    clipped = UnknownEffect("contact.clipping", 0.5, PLAN).pulse(
        PLAN[0], case_pulse(), 0.5, LOUDEST_N
    )
    assert clipped.force_n.max() == pytest.approx(0.25 * LOUDEST_N)
    slewed = UnknownEffect("contact.slew", 0.5, PLAN).pulse(PLAN[0], case_pulse(), 0.5, LOUDEST_N)
    assert np.abs(np.diff(slewed.force_n)).max() <= 0.125 * LOUDEST_N / 20e-6 * 1e-6 * (1 + 1e-9)
    double = UnknownEffect("contact.double_hit", 0.4, PLAN).pulse(
        PLAN[0], case_pulse(), 0.5, LOUDEST_N
    )
    assert double.force_n[181:].max() == pytest.approx(0.4 * LOUDEST_N, rel=0.02)
    assert double.force_n.sum() == pytest.approx(
        (1 + 0.4 * 0.6) * case_pulse().force_n.sum(), rel=0.01
    )
    split = UnknownEffect("plate.tuned_mass", 0.1, PLAN).modes(
        plate_modes(), LOUDEST_N, LOUDEST_N, 0.5
    )
    assert split.frequencies_hz[[1, -1]] == pytest.approx([570.0, 630.0])
    before = plate_modes()
    strength = split.shape_impact[:, [1, -1]] * split.shapes[0, [1, -1]]
    assert strength.sum() == pytest.approx(before.shape_impact[0, 1] * before.shapes[0, 1])
