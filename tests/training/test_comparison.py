"""Comparisons of models that are alike, and of models that are not, in groups of pulses."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.dataset.table import Texts
from pyroshock.training.evaluation.comparison import (
    Comparison,
    compare,
    comparison_groups,
    level_names,
    speed_terciles,
)
from pyroshock.training.evaluation.metrics import METRICS, PulseErrors
from support.records.pulse_tables import pulse_table

CONFIGURATION = np.repeat([f"c{i:02d}" for i in range(40)], 2)
NOTHING: dict[str, Texts] = {}


def drawn(rng: np.random.Generator, size: float = 0.05, configurations: int = 40) -> PulseErrors:
    """Errors, half of whose scatter is the configuration's."""
    arrays = {}
    for name in METRICS:
        shared = np.repeat(rng.standard_normal(configurations), 2)
        arrays[name] = size * np.exp(0.3 * shared + 0.3 * rng.standard_normal(2 * configurations))
    return PulseErrors(**arrays)


def of(a: PulseErrors, b: PulseErrors, groups: dict[str, Texts] = NOTHING) -> Comparison:
    return compare(a, b, CONFIGURATION, groups, np.random.default_rng(7))


@pytest.mark.parametrize("configurations", [10, 40])
def test_equal_models_are_called_different_in_one_of_twenty(configurations: int) -> None:
    """Eight independent metrics each of 100 campaigns, by repetitions that are no evidence of their
    own."""
    rng = np.random.default_rng(0)
    labels = np.repeat(np.arange(configurations), 2)
    called = 0
    for _ in range(100):
        pair = (
            drawn(rng, configurations=configurations),
            drawn(rng, configurations=configurations),
        )
        result = compare(*pair, labels, NOTHING, rng, resamples=10, draws=399)
        called += sum(row.beyond_chance for row in result.overall)
    # 800 questions: 5 % +- 4 standard errors
    assert 0.05 - 4 * 0.0077 < called / 800 < 0.05 + 4 * 0.0077


def test_real_difference_is_found_and_leads_by_chance_are_told_so() -> None:
    rng = np.random.default_rng(1)
    worse = drawn(rng)
    better = PulseErrors(**{name: 0.9 * values for name, values in worse.arrays().items()})
    row = of(better, worse).of("force_nrmse")
    assert row.beyond_chance
    assert row.low < row.difference < row.high < 0
    rng = np.random.default_rng(2)
    row = of(drawn(rng), drawn(rng)).of("force_nrmse")
    assert not row.beyond_chance


def test_swapped_models_mirror_and_a_model_equals_itself() -> None:
    rng = np.random.default_rng(3)
    a, b = drawn(rng), drawn(rng, 0.055)
    for there, back in zip(of(a, b).overall, of(b, a).overall, strict=True):
        assert there.difference == -back.difference and there.p_value == back.p_value
        assert np.allclose([there.low, there.high], [-back.high, -back.low], atol=1e-15)
    a = drawn(np.random.default_rng(4))
    row = of(a, a).of("cost")
    assert (row.difference, row.low, row.high, row.p_value) == (0.0, 0.0, 0.0, 1.0)


def test_where_the_models_differ() -> None:
    # A is 20 % better with one tip of four alone: found there and only there.
    rng = np.random.default_rng(5)
    tip = np.array(["steel", "delrin", "brass", "wood"])[np.arange(80) // 20]
    b, rest = drawn(rng), drawn(rng)
    a = PulseErrors(
        **{
            m: np.where(tip == "steel", 0.7 * v, v * rest.cost / 0.05)
            for m, v in b.arrays().items()
        }
    )
    found = of(a, b, {"tip_material": tip}).where("impulse_error")
    assert [row.group for row in found] == [("tip_material", "steel")]
    assert found[0].pulses == 20 and found[0].configurations == 10
    rng = np.random.default_rng(8)
    tip = np.where(np.arange(80) < 2, "rare", "common")
    rows = compare(
        drawn(rng), drawn(rng), CONFIGURATION, {"tip": tip}, rng, names=("gp", "tree")
    ).rows()
    assert len(rows) == 8 + 16
    assert set(rows[0]) == {"a", "b", "metric", "difference", "ci90", "p_value"}
    assert (rows[0]["a"], rows[0]["b"], rows[0]["metric"]) == ("gp", "tree", "force_rmse_n")
    rare = next(row for row in rows if row.get("group") == {"tip": "rare"})
    assert rare["ci90"] is None and rare["p_value"] == 1.0


def test_many_groups_are_many_questions() -> None:
    """Ten groups without a difference: one of them beyond chance in about 5 % of the comparisons,
    not in 40 %."""
    rng = np.random.default_rng(6)
    groups = {"tip_material": np.array([f"tip {i}" for i in np.arange(80) // 8])}
    accused = 0
    for _ in range(60):
        result = compare(
            drawn(rng), drawn(rng), CONFIGURATION, groups, rng, resamples=10, draws=199
        )
        accused += sum(bool(result.where(metric)) for metric in METRICS)
    assert accused / (60 * len(METRICS)) < 0.05 + 4 * 0.01


def test_unknown_metrics_and_other_pulses_are_refused() -> None:
    a = drawn(np.random.default_rng(9))
    with pytest.raises(LookupError, match="no metric 'rmse'; there are: force_rmse_n"):
        of(a, a).of("rmse")
    with pytest.raises(
        ValueError, match="80 errors of A, 79 of B: compare them on the same pulses"
    ):
        of(a, a.take(slice(1, None)))


TABLE = pulse_table(np.random.default_rng(0), repetitions=2)


def test_groups_of_a_hammer_campaign() -> None:
    groups = comparison_groups(TABLE)
    assert set(groups) == {
        "tip_material",
        "target_material",
        "anvil_material",
        "insulator",
        "boundary_conditions",
        "impact_velocity",
    }
    assert all(len(labels) == len(TABLE) for labels in groups.values())
    assert "tip_material" not in comparison_groups(TABLE.take(TABLE.tip_material == "delrin"))
    soft = level_names(TABLE, "insulator") == "polymeric"
    assert np.array_equal(soft, np.char.find(TABLE.treatment, "/polymeric/") > 0)
    with pytest.raises(LookupError, match="'tip_radius' has no levels"):
        level_names(TABLE, "tip_radius")
    speed, velocity = speed_terciles(TABLE), TABLE.column("impact_velocity")
    assert [int(np.count_nonzero(speed == name)) for name in ("slow", "middle", "fast")] == [
        40,
        40,
        40,
    ]
    assert velocity[speed == "slow"].max() < velocity[speed == "fast"].min()
