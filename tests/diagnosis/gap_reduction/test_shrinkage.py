"""How far a gap shrinks: all of it by the right effect, nothing by a wrong one, and no gap where
there is none."""

from __future__ import annotations

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.gap_reduction import Gaps, by_configuration, corner, measure_reduction
from pyroshock.diagnosis.inference.held_out import fit_fold
from pyroshock.diagnosis.inference.model_search import search
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.verdict import CORRECTED, stage_figure
from pyroshock.training.evaluation.summary import fraction
from support.records.toy_bench import (
    Design,
    Scatter,
    ToyContact,
    ToyDamping,
    ToyGun,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    campaign,
    stages_of,
)

_BACKGROUND = Scatter(background=(0.005, 0.015, 0.25))


def _toy(effects, seed=0, **other):
    return stages_of(campaign(effects, np.random.default_rng(seed), **other))


def shrinkage(*arguments, **options):
    """The entries of the report alone."""
    return [entry for entry, _ in measure_reduction(*arguments, **options)]


def oracle(stages, kinds, rng, scales=None):
    """What the right effects achieve: it knows their kinds, and fits their parameters on the same
    folds."""
    problem = InferenceProblem.of(GapTable.of(stages[0].record, stages), stages, kinds)
    library = search(problem)
    together = max(
        (fit for fit in library.fits.values() if len(fit.laws) == len(kinds)), key=library.log_joint
    )
    return shrinkage(
        stages, lambda rows: fit_fold(library, rows, only=[together]), rng, scales, pulses=False
    )


def as_given(stages, *effects):
    """A fold's fit that has these effects, whatever the rows were."""
    change = np.concatenate([stage.changes([effects])[0] for stage in stages], axis=1)
    return SimpleNamespace(likeliest=effects, averaged=change, corrected=change)


@pytest.mark.parametrize(
    "effect", [ToyMass(1.25), ToyLeak(0.1), ToyLayer(0.3), ToyDamping(3.0)], ids=lambda e: e.id
)
def test_right_effect_removes_the_gap(effect) -> None:
    for entry in oracle(_toy((effect,)), [type(effect)], np.random.default_rng(1)):
        assert entry.effects == (effect.id,)
        assert entry.fraction == pytest.approx(1.0, abs=0.12)
        assert entry.ci90[0] <= entry.fraction <= entry.ci90[1]


def test_wrong_effect_or_no_cause_leaves_the_gap() -> None:
    by_folds, at_corner = oracle(_toy((ToyMass(1.25),)), [ToyDamping], np.random.default_rng(1))
    assert by_folds.fraction == pytest.approx(0.0, abs=0.02)
    assert at_corner.fraction == pytest.approx(0.0, abs=0.02)
    stages = _toy((ToyMass(1.25),))
    entry, _ = shrinkage(stages, lambda rows: as_given(stages), np.random.default_rng(0))
    assert (entry.effects, entry.fraction, entry.before) == ((), 0.0, entry.after)


def test_no_gap_to_shrink_where_scatter_alone_makes_one() -> None:
    fractions = [
        oracle(_toy((), seed)[:1], [ToyLoss], np.random.default_rng(seed))[0].fraction
        for seed in range(10)
    ]
    assert sum(each is None for each in fractions) >= 8
    gaps = [Gaps.of(_toy((), seed)) for seed in range(20)]
    assert np.mean([g.squares().mean() for g in gaps]) == pytest.approx(
        np.mean([g.floor.mean() for g in gaps]), rel=0.1
    )


def test_choice_never_sees_what_is_held_out() -> None:
    seen: list[np.ndarray] = []
    stages = _toy((ToyMass(1.25),))
    shrinkage(
        stages,
        lambda rows: (seen.append(rows), as_given(stages, ToyMass(1.25)))[1],
        np.random.default_rng(0),
    )
    held = [np.setdiff1d(np.arange(24), rows) for rows in seen]
    assert np.array_equal(np.sort(np.concatenate(held[:-1])), np.arange(24))
    assert 6 <= len(held[-1]) <= 8
    answers = iter([ToyLoss(0.1), *[ToyMass(1.25)] * 5])
    entry, _ = shrinkage(
        stages, lambda rows: as_given(stages, next(answers)), np.random.default_rng(0)
    )
    assert entry.effects == ("contact.toy_mass",)


def test_corner_is_an_extrapolation() -> None:
    """A gap that grows with pressure: the highest pressure is held out, where a constant loss
    fails."""
    stages = _toy((ToyLeak(0.3),))[:1]
    _, right = oracle(stages, [ToyLeak], np.random.default_rng(0))
    by_folds, wrong = oracle(stages, [ToyLoss], np.random.default_rng(0))
    assert right.held_out_by == "corner: tank_pressure_bar > 3"
    assert right.fraction > 0.9
    assert wrong.fraction < by_folds.fraction < 0.6


def test_corner_takes_a_second_factor_and_needs_numbers() -> None:
    configurations = Design(
        pressures_bar=(1.0, 4.0), masses_kg=(0.25, 1.0), insulators=tuple("abc")
    ).configurations()
    size = np.array(
        [
            float(each.factors["tank_pressure"]) - 1e4 * float(each.factors["bullet_mass"])
            for each in configurations
        ]
    )
    split = corner(configurations, np.arange(12), size)
    assert split.name == "corner: tank_pressure_bar > 2 and bullet_mass_kg <= 0.6"
    assert len(split.held_out) == 3
    configurations = Design(
        pressures_bar=(1.0,), masses_kg=(0.5,), insulators=tuple("abcdef")
    ).configurations()
    assert corner(configurations, np.arange(6), np.arange(6.0)) is None
    split = by_configuration(np.array([3, 5, 7]))
    assert len(split.folds) == 3
    assert sorted(split.held_out) == [3, 5, 7]


def test_error_of_a_stage_alone_is_in_its_tolerances_whatever_the_unit_of_the_gap() -> None:
    stages = _toy((ToyLoss(0.1), ToyMass(1.25)))
    tolerance = {
        stage.name: np.array([item.tolerance for item in stage.observables]) for stage in stages
    }
    gaps = Gaps.of(stages)
    names = [item.stage for item in gaps.observables]
    for scales in (None, {name: np.ones(own.size) for name, own in tolerance.items()}):
        for factor in (1.0, 2.0):
            given = {name: factor * own for name, own in tolerance.items()}
            entry, *_ = shrinkage(
                stages,
                lambda _: as_given(stages),
                np.random.default_rng(0),
                scales,
                False,
                stage_tolerances=given,
            )
            for stage in ("gun", "contact"):
                columns = np.flatnonzero([name == stage for name in names])
                expected = np.sqrt(np.nanmean(gaps.mean[:, columns] ** 2)) / factor
                assert entry.more[stage_figure(stage)] == pytest.approx((expected, expected))


def test_before_is_the_rms_over_the_scale() -> None:
    # In the unit of ln v where the scale is 1; and only what has a finite scale counts.
    stages = _toy((ToyLoss(0.1),))
    scales = {"gun": np.ones(1), "contact": np.full(3, np.inf), "plate": np.full(8, np.inf)}
    entry, _ = oracle(stages, [ToyLoss], np.random.default_rng(0), scales)
    assert entry.before == pytest.approx(0.1, rel=0.05)
    assert entry.after < 0.01
    assert set(entry.more) == {stage_figure("gun"), CORRECTED}
    entry, _ = oracle(_toy((ToyDamping(4.0),)), [ToyDamping], np.random.default_rng(0))
    before, after = entry.more["share of lines within 6 dB"]
    assert (before, after) == (pytest.approx(0.5, abs=0.1), 1.0)
    assert entry.more["dB, median"][0] == pytest.approx(4 * (1 + 3.5 / 8), rel=0.1)
    assert entry.more["dB, median"][1] < 0.3
    stages = [ToyGun(campaign((ToyLoss(0.1),), np.random.default_rng(0)))]
    assert oracle(stages, [ToyLoss], np.random.default_rng(0))[0].fraction > 0.85


def test_chance_is_the_scatter_of_the_mean_square() -> None:
    """Also where observables scatter together."""
    rng = np.random.default_rng(0)
    record = campaign((), rng)
    stage = ToyContact(record)
    means = []
    for _ in range(300):
        common = 0.03 * rng.standard_normal((96, 1))
        residual = common + 0.01 * rng.standard_normal((96, 3))
        stage.residuals = partial(np.asarray, residual)  # type: ignore[method-assign]
        gaps = Gaps.of([stage])
        means.append((gaps.squares().mean(), np.sqrt((gaps.chance**2).sum()) / 24))
    assert np.mean([m[1] for m in means]) == pytest.approx(np.std([m[0] for m in means]), rel=0.2)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_intervals_cover() -> None:
    """The fraction of the mean squares over many campaigns: 0.82 to 0.97 of 150, nominal 0.9."""
    entries, floors = [], []
    for seed in range(150):
        stages = _toy((ToyMass(1.2),), seed, scatter=_BACKGROUND)[1:2]
        entries.append(oracle(stages, [ToyMass], np.random.default_rng(seed))[0])
        floors.append(Gaps.of(stages).floor.mean())
    truth = float(
        fraction(
            *(
                np.array(np.mean(each))
                for each in ([e.before**2 for e in entries], [e.after**2 for e in entries], floors)
            )
        )
    )
    covered = np.mean([entry.ci90[0] <= truth <= entry.ci90[1] for entry in entries])
    assert 0.82 <= covered <= 0.97


def test_mean_over_configurations_is_that_over_all_cells() -> None:
    """A configuration with one cell of three counts for a third of the others, as in the gap of the
    report."""
    rng = np.random.default_rng(0)
    mean = rng.standard_normal((5, 3))
    mean[1, 1:] = np.nan
    mean[4] = np.nan
    variance = np.full(mean.shape, 0.2)
    gaps = Gaps((), np.ones(3), mean, variance, np.zeros(5), 4)
    assert gaps.rows.tolist() == [0, 1, 2, 3]
    assert gaps.squares()[gaps.rows].mean() == pytest.approx(np.nanmean(mean**2))
    assert gaps.floor[gaps.rows].mean() == pytest.approx(0.2)
    assert gaps.squares()[1] == pytest.approx(mean[1, 0] ** 2 / 2.5)
