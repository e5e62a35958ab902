"""Whole answers on a toy plate with a spectrum and one damping ratio: what is called none, and what
unknown."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
import pytest
from pyroshock.diagnosis.conclusion import Conclusion, conclude
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.gap_reduction import measure_reduction
from pyroshock.diagnosis.inference.held_out import fit_fold
from pyroshock.diagnosis.inference.posterior import HypothesisPosterior
from pyroshock.diagnosis.inference.shares import gap_shares
from pyroshock.diagnosis.observable_families import family_gaps
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.options import UnknownMap
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.diagnosis.verdict import NONE, UNKNOWN
from support.records.toy_bench import Design, Scatter, ToyDamping, ToyForceGain, ToyPlate, campaign

#: Standard deviation of one run's ln damping, and by how much a decibel of the first line moves it.
_SCATTER, _PER_DB = 0.02, 1.0


class DampedPlate(ToyPlate):
    """Beside the lines the logarithm of a damping ratio. The damping lowers the lines and raises
    the ratio."""

    observables = (
        *ToyPlate.observables,
        Observable("ln damping of the mode at 300 Hz", "plate", "plate", "1", 0.1, 0.02, 300.0),
    )

    def __init__(self, record: CampaignRecord, true_db: float) -> None:
        super().__init__(record)
        scatter = _SCATTER * np.random.default_rng(5).standard_normal(len(record.runs))
        self._damping = _PER_DB * true_db + scatter

    def measured(self) -> np.ndarray:
        return np.column_stack([super().measured(), self._damping])

    def simulated(self, effects=(), upstream=None) -> np.ndarray:
        loss_db = sum(item.loss_db for item in effects if isinstance(item, ToyDamping))
        return np.pad(
            super().simulated(effects, upstream),
            ((0, 0), (0, 1)),
            constant_values=_PER_DB * loss_db,
        )


@cache
def concluded(
    loss_db: float = 0.0, rough: float = 0.0, seed: int = 2
) -> tuple[HypothesisPosterior, Conclusion]:
    """`rough`: what each configuration's lines are off by, each by itself, in tolerances (rms); no
    effect makes it."""
    effects = (ToyDamping(loss_db),) if loss_db else ()
    scatter = Scatter(run=(0.01, 0.03, 0.2), background=(0.0, 0.0, 0.5 * rough))
    design = Design((0.5, 1.0, 2.0, 4.0), (0.25, 1.0), ("none", "polymeric"), 3)
    record = campaign(effects, np.random.default_rng(seed), design, scatter)
    stages = [DampedPlate(record, loss_db)]
    gap, rng = GapTable.of(record, stages), np.random.default_rng(0)
    posterior = HypothesisPosterior.of(gap, stages, (ToyDamping, ToyForceGain))
    shares = gap_shares(posterior.library, posterior.weights, posterior.floor, rng)
    corrections = measure_reduction(
        stages, partial(fit_fold, posterior.library), rng, posterior.metric.scales(gap), False
    )
    return posterior, conclude(posterior, shares, corrections[0][1], UnknownMap())


def test_effect_that_shows_in_the_damping_alone_is_the_first_cause():
    """0.25 dB of a tolerance of 0.5, and 0.25 of a damping's tolerance of 0.1."""
    posterior, conclusion = concluded(0.25)
    assert not posterior.metric.size(posterior.gap).beyond_noise
    assert [item.family for item in family_gaps(posterior.gap) if item.beyond_noise] == ["damping"]
    first = conclusion.causes[0]
    assert first.effects == ("plate.toy_damping",)
    assert first.probability > 0.7
    (row,) = [row for row in conclusion.effects if row.effect == "plate.toy_damping"]
    assert row.inclusion > 0.9
    assert row.named
    assert row.held_out_gain > 0.8  # of the damping, where it shows


def test_effect_within_every_tolerance_is_none():
    _, conclusion = concluded(0.05)
    assert conclusion.causes[0].effects == (NONE,)
    assert conclusion.causes[0].probability > 0.9


@pytest.mark.parametrize("rough", [0.0, 0.6, 1.2])
def test_background_is_none_smooth_or_rough(rough: float):
    posterior, conclusion = concluded(rough=rough)
    assert conclusion.causes[0].effects == (NONE,)
    assert family_gaps(posterior.gap)[0].excess == pytest.approx(rough, abs=0.25)


def test_gap_of_three_tolerances_that_no_effect_makes_is_unknown():
    posterior, conclusion = concluded(rough=3.0)
    assert posterior.within_probability > 0.5  # of the catalogue no set is better than none
    assert conclusion.causes[0].effects == (UNKNOWN,)
    assert conclusion.causes[0].probability > 0.7
    assert next(cause.probability for cause in conclusion.causes if cause.effects == (NONE,)) < 0.05


def test_gap_that_an_effect_explains_held_out_is_not_unknown():
    _, conclusion = concluded(3.0)
    assert conclusion.causes[0].effects == ("plate.toy_damping",)
    table = {cause.effects: cause.probability for cause in conclusion.causes}
    assert table[(UNKNOWN,)] < 0.2
