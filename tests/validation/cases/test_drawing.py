from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.validation.cases import FAMILIES, TIERS, draw_case, families
from pyroshock.validation.cases.case import KINDS, STAGES, tier_of
from pyroshock.validation.cases.designs import DESIGNS, design
from pyroshock.validation.cases.record import label_of
from pyroshock.validation.cases.run_scatter import (
    DAMPING,
    FREQUENCY,
    SHAPE,
    PlateBackground,
    background,
    draw_background,
)
from pyroshock.validation.cases.scale_cause import RANGES, shown_by, strength_for
from pyroshock.validation.cases.unknowns import SPLITS
from pyroshock.virtualbench.effects import CATALOGUE


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tier", ["weak", "middle", "strong", "very strong"])
def test_gap_over_floor_lies_in_its_tier(kind: str, tier: str) -> None:
    case = draw_case(kind, tier, np.random.default_rng(8), number=2)
    label = label_of(case, 1)
    low, high = TIERS[tier]
    assert low <= label.ratio < high
    assert label.tier == tier
    assert label.gap[str(label.stage)] == pytest.approx(label.ratio * case.floor)


def test_every_effect_of_the_catalogue_can_be_drawn() -> None:
    effects = {name for name in CATALOGUE if not name.startswith("bench.")}
    assert effects == set(RANGES)
    shown = {name for kind in KINDS for number in range(DESIGNS) for name in shown_by(kind, number)}
    assert shown == effects


@pytest.mark.parametrize("kind", KINDS)
def test_families_outside_the_catalogue_are_split_without_overlap(kind: str) -> None:
    parts = [set(families(kind, split)) for split in SPLITS]
    assert all(parts)
    assert sum(map(len, parts)) == len(set.union(*parts))
    assert not set(FAMILIES) & set(CATALOGUE)
    assert {FAMILIES[name].stage for part in parts for name in part} == set(STAGES[kind])


@pytest.mark.parametrize("kind", ["gun", "hammer"])
def test_unknown_cause_comes_from_its_split(kind: str) -> None:
    case = draw_case(kind, "strong", np.random.default_rng(2), cause="unknown", split="calibration")
    assert case.cause == ("unknown",)
    assert case.unknown in families(kind, "calibration")


def test_two_effects_stand_out_alone_and_none_has_no_gap() -> None:
    case = draw_case("hammer", "any", np.random.default_rng(3), cause="two", number=1)
    label = label_of(case, 1)
    assert len(label.cause) == 2
    assert min(label.alone.values()) >= 1.5
    assert 3 <= label.ratio < 20
    label = label_of(draw_case("gun", "any", np.random.default_rng(4), cause="none"), 1)
    assert (label.cause, label.tier, label.stage, label.within_tolerance) == (
        ("none",),
        "none",
        None,
        True,
    )
    first, second = (draw_case("hammer", "middle", np.random.default_rng(5)) for _ in range(2))
    assert first == second


def test_causes_keep_to_what_they_can_be() -> None:
    label = label_of(
        draw_case(
            "gun", "very strong", np.random.default_rng(6), cause="gun.heat_exchange", number=0
        ),
        1,
    )
    assert label.cause == ("gun.heat_exchange",)
    assert label.tier == tier_of(label.ratio)
    case = draw_case(
        "gun", "very strong", np.random.default_rng(7), cause="gun.back_pressure", number=1
    )
    assert 0.9 <= case.strengths["gun.back_pressure"] <= 1.04
    from pyroshock.validation.cases.effect_size import gap
    from pyroshock.validation.cases.scale_cause import cause_of

    for sign in (1, -1):
        strength = strength_for("hammer", 0, "contact.effective_mass", sign, 2.0)
        assert strength * sign > 0
        assert gap("hammer", 0, cause_of("contact.effective_mass", strength)) == pytest.approx(
            2.0, rel=0.04
        )


@pytest.mark.parametrize("rough", [False, True])
def test_background_is_as_large_as_drawn(rough: bool) -> None:
    rng, plan = np.random.default_rng(9), design("hammer", 1)
    for _ in range(5):
        what = draw_background(rng, rough=rough)
        size = float(np.hypot(what.smooth, what.white))
        assert (0.8 if rough else 0.2) <= size <= (1.6 if rough else 0.8)
        assert np.sqrt(np.mean(background(what, plan, 400, "a") ** 2)) == pytest.approx(
            size, rel=0.15
        )


def test_background_is_smooth_over_the_factors() -> None:
    """Neighbours in pressure are more alike than the ends."""
    plan = design("gun", 0)
    what = draw_background(np.random.default_rng(1))
    values = background(what, plan, 400, "a")
    light = [k for k, s in enumerate(plan) if s.mass_kg == plan[0].mass_kg]
    near = np.mean((values[light[0]] - values[light[1]]) ** 2)
    assert near < np.mean((values[light[0]] - values[light[-1]]) ** 2)


def test_background_of_a_plate_has_sizes_of_its_own() -> None:
    """Frequency, damping and shape are drawn apart from each other, and neighbouring modes are more
    or less alike."""
    case = draw_case("plate", "any", np.random.default_rng(4), cause="none")
    sizes, alike = [], []
    for seed in range(400):
        what = replace(case.background, seed=seed)
        size = float(np.hypot(what.smooth, what.white))
        plate = PlateBackground.of(replace(case, background=what))
        rows = plate.frequency / size, plate.damping / size, plate.shapes[0] / size / 0.6
        sizes.append([np.sqrt(np.mean(row**2)) for row in rows])
        alike.append(
            plate.frequency[1:] @ plate.frequency[:-1] / (plate.frequency @ plate.frequency)
        )
    mean = np.sqrt(np.mean(np.square(sizes), axis=0))
    assert np.all(mean > [low for low, _ in (FREQUENCY, DAMPING, SHAPE)])
    assert np.all(mean < [high for _, high in (FREQUENCY, DAMPING, SHAPE)])
    assert np.abs(np.corrcoef(np.log(sizes).T) - np.eye(3)).max() < 0.2
    assert np.mean(alike) > 0.2


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("rifle", "weak", "none"), "kind"),
        (("gun", "loud", "none"), "tier"),
        (("gun", "weak", "plate.damping"), "cause"),
    ],
)
def test_unknown_words_are_refused_by_name(words: tuple[str, str, str], named: str) -> None:
    kind, tier, cause = words
    with pytest.raises(ValueError, match=named):
        draw_case(kind, tier, np.random.default_rng(1), cause=cause)
