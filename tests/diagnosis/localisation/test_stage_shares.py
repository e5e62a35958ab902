"""In which stage the gap arises: three linear stages, in one of which an effect is planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.gap import GapMetric, GapTable
from pyroshock.diagnosis.localisation.stages import chain_of, shapley, stage_notes, stage_shares
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.verdict import Where
from support.records.toy_bench import (
    Design,
    Scatter,
    ToyContact,
    ToyDamping,
    ToyForceGain,
    ToyGun,
    ToyLayer,
    ToyLeak,
    ToyLoss,
    ToyMass,
    ToyPlate,
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


@pytest.mark.parametrize(
    ("effect", "stage"), _PLANTED, ids=lambda value: getattr(value, "id", value)
)
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


class _DetailedContact(ToyContact):
    """Beside peak and impulse ten numbers of the shape, which nothing moves."""

    observables = (
        *ToyContact.observables,
        *(
            Observable(f"shape_{i}", "contact", "force", "1", 0.02, 0.005, detail=True)
            for i in range(10)
        ),
    )

    def measured(self) -> np.ndarray:
        return np.pad(super().measured(), ((0, 0), (0, 10)))

    def simulated(self, effects=(), upstream=None) -> np.ndarray:
        return np.pad(super().simulated(effects, upstream), ((0, 0), (0, 10)))


class _ModalPlate(ToyPlate):
    """Beside the lines a damping ratio that is 14 of its tolerances off."""

    observables = (
        *ToyPlate.observables,
        Observable("ln damping of the mode at 300 Hz", "plate", "plate", "1", 0.1, 0.02, 300.0),
    )

    def measured(self) -> np.ndarray:
        return np.pad(super().measured(), ((0, 0), (0, 1)), constant_values=1.4)

    def simulated(self, effects=(), upstream=None) -> np.ndarray:
        return np.pad(super().simulated(effects, upstream), ((0, 0), (0, 1)))


def test_stages_are_compared_by_the_observables_of_the_gaps_size() -> None:
    """The contact is three and more tolerances off, the plate's spectrum one; its damping and the
    pulse's ten shapes are for telling causes apart, and change nothing of what either stage is off
    by."""
    record = campaign((ToyMass(1.2), ToyDamping(0.35)), np.random.default_rng(0))
    plain = stage_shares(
        [ToyGun(record), ToyContact(record), ToyPlate(record)], np.random.default_rng(1)
    )
    detailed = stage_shares(
        [ToyGun(record), _DetailedContact(record), _ModalPlate(record)], np.random.default_rng(1)
    )
    assert detailed == plain
    assert [entry.name for entry in plain][:2] == ["contact", "plate"]
    gap = GapTable.of(record, [ToyGun(record), _DetailedContact(record), _ModalPlate(record)])
    sizes = GapMetric.of(gap).by_stage(gap)
    assert [sizes[entry.name] for entry in plain] == sorted(sizes.values(), reverse=True)
    for entry in plain:
        assert entry.own == pytest.approx(
            sizes[entry.name], abs=0.15
        )  # noise by the data sheets, or drawn towards it


def test_own_gap_has_an_interval_that_holds_the_true_one_as_often_as_it_says() -> None:
    """4 tolerances of ln v in each configuration; the white background of half a tolerance adds in
    squares."""
    true = np.hypot(4.0, 0.5)
    inside = []
    for seed in range(60):
        record = campaign(
            (ToyLoss(0.04),),
            np.random.default_rng(seed),
            scatter=Scatter(background=(0.005, 0.0, 0.0)),
        )
        (entry,) = stage_shares([ToyGun(record)], np.random.default_rng(seed))
        assert entry.own_ci90 is not None
        assert entry.own_ci90[0] <= entry.own <= entry.own_ci90[1]
        inside.append(entry.own_ci90[0] <= true <= entry.own_ci90[1])
    assert 0.78 <= np.mean(inside) <= 0.98


def test_two_stages_that_are_off_alike_are_a_near_tie_and_unequal_ones_are_none() -> None:
    rng = np.random.default_rng(2)
    alike = Where(
        stage=_shares(
            (ToyLoss(0.03), ToyMass(1.115)), scatter=Scatter(background=(0.01, 0.03, 0.0))
        )
    )
    assert {alike.stage[0].name, *(stage.name for stage in alike.nearly_largest)} == {
        "gun",
        "contact",
    }
    unequal_stages = Where(stage=_shares((ToyLoss(0.08), ToyMass(1.1)), scatter=_BACKGROUND))
    assert unequal_stages.nearly_largest == ()
    (only,) = stage_shares([ToyGun(campaign((), rng, Design((1.0,), (0.5,), ("none",))))], rng)
    assert only.own_ci90 is None
    assert Where(stage=(only,)).nearly_largest == ()


def test_velocity_errors_blame_nobody() -> None:
    """Readings that scatter about the true velocity move the contact's gap of one run; without
    repetitions their data sheet says by how much."""
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
    shares = {
        entry.name: entry.own
        for entry in stage_shares(stages_of(replace(record, runs=tuple(runs))), rng)
    }
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
