"""In which stage the gap arises: three linear stages, in one of which an effect is planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.localisation.stages import chain_of, shapley, stage_notes, stage_shares
from support.records.toy_bench import (
    Design,
    Scatter,
    ToyDamping,
    ToyForceGain,
    ToyGun,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    ToyVelocityGain,
    campaign,
    stages_of,
)

_BACKGROUND = Scatter(background=(0.005, 0.015, 0.25))
_PLANTED = [
    (ToyLoss(0.08), "gun"),
    (ToyLeak(0.08), "gun"),
    (ToyMass(1.2), "contact"),
    (ToyLayer(0.15), "contact"),
    (ToyDamping(2.0), "plate"),
    (ToyForceGain(1.15), "contact"),
    (ToyVelocityGain(1.05), "gun"),
]


def _shares(effects, seed=0, **other):
    rng = np.random.default_rng(seed)
    return stage_shares(stages_of(campaign(effects, rng, **other)), rng)


@pytest.mark.parametrize(("effect", "stage"), _PLANTED, ids=lambda value: getattr(value, "id", value))
def test_planted_stage_is_first(effect, stage) -> None:
    shares = _shares((effect,), scatter=_BACKGROUND)
    assert shares[0].name == stage
    assert shares[0].share > 0.9 and shares[0].own > 2


@pytest.mark.parametrize("seed", range(5))
def test_shares_sum_to_one(seed: int) -> None:
    shares = _shares((ToyMass(1.05), ToyLoss(0.02)), seed)
    assert sum(entry.share for entry in shares) == pytest.approx(1.0)
    assert all(0 <= entry.ci90[0] <= entry.share <= entry.ci90[1] <= 1 for entry in shares)


def test_own_gap_is_in_tolerances() -> None:
    # 0.1 of ln v is ten tolerances of the velocity, and nothing of what follows.
    shares = {entry.name: entry.own for entry in _shares((ToyLoss(0.1),))}
    assert shares["gun"] == pytest.approx(10.0, rel=0.05)
    assert shares["contact"] < 0.5 and shares["plate"] < 0.5
    shares = _shares((), scatter=Scatter(run=(0.03, 0.09, 1.5)))
    assert max(entry.own for entry in shares) < 1.0
    shares = {entry.name: entry for entry in _shares((ToyLoss(0.04), ToyDamping(1.0)))}
    assert shares["gun"].share > 0.15 and shares["plate"].share > 0.15
    assert shares["contact"].share < 0.1
    rng = np.random.default_rng(0)
    (only,) = stage_shares([ToyGun(campaign((ToyLoss(0.1),), rng))], rng)
    assert (only.share, only.ci90) == (1.0, (1.0, 1.0))


def test_velocity_errors_blame_nobody() -> None:
    """Readings that scatter about the true velocity move the contact's gap of one run; without repetitions their data
    sheet says by how much."""
    rng = np.random.default_rng(3)
    record = campaign((), rng, Design(repetitions=1), Scatter(run=(0.0, 0.005, 0.05)))
    runs = [
        replace(
            run,
            velocity_m_s=run.velocity_m_s * np.exp(0.03 * rng.standard_normal()),
            velocity_u_m_s=0.03 * run.velocity_m_s,
        )
        for run in record.runs
    ]
    shares = {entry.name: entry.own for entry in stage_shares(stages_of(replace(record, runs=tuple(runs))), rng)}
    assert shares["contact"] < 0.7


def test_missing_force_merges_contact_and_plate() -> None:
    rng = np.random.default_rng(0)
    record = campaign((ToyMass(1.3),), rng)
    blind = replace(record, runs=tuple(replace(run, force=None) for run in record.runs))
    shares = stage_shares(stages_of(blind), rng)
    assert shares[0].name == "contact and plate" and shares[0].share > 0.9
    assert stage_notes(stages_of(blind)) == (
        "nothing was measured between contact and plate: their gaps are told as one",
    )
    record = campaign((), np.random.default_rng(0))
    blind = replace(record, runs=tuple(replace(run, velocity_m_s=None) for run in record.runs))
    with pytest.raises(ValueError, match="gun has a measured exit"):
        chain_of([ToyGun(blind)])


def test_parts_add_up_and_shapley_of_a_square_is_the_product_with_the_sum() -> None:
    stages = stages_of(campaign((ToyLoss(0.1), ToyDamping(1.0)), np.random.default_rng(0)))
    gun, contact, plate = stages
    free = plate.simulated((), contact.output((), gun.output()))
    assert np.allclose(chain_of(stages)[-1].parts.sum(axis=0), plate.measured() - free)
    # v(A) = -|sum over those not in A|^2 shares out as d_i . D.
    parts = np.random.default_rng(0).normal(size=(4, 6))

    def value(replaced: frozenset[int]) -> np.ndarray:
        left = [i for i in range(4) if i not in replaced]
        return -np.square(parts[left].sum(axis=0)).sum(keepdims=True)

    assert np.allclose(shapley(value, 4)[:, 0], parts @ parts.sum(axis=0))


@pytest.mark.slow
def test_stage_hits_of_strong_effects() -> None:
    hits = []
    for seed in range(20):
        for effect, stage in _PLANTED:
            hits.append(_shares((effect,), seed, scatter=_BACKGROUND)[0].name == stage)
    assert np.mean(hits) >= 0.97
