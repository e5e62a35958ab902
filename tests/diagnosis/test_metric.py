"""The size of a gap: which observables make it, in which unit, and what of it repetitions leave
anyway."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.gap import GapMetric, GapTable, Noise
from pyroshock.diagnosis.observables.base import Observable
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.record import CampaignRecord

VELOCITY = Observable("ln_velocity", "gun", "velocity", "1", 0.01, 0.008)
PEAK, IMPULSE, HALF, TENTH = (
    Observable(f"ln_{name}", "contact", "force", "1", tolerance, 0.01)
    for name, tolerance in (
        ("peak", 0.02),
        ("impulse", 0.03),
        ("width_half", 0.06),
        ("width_tenth", 0.09),
    )
)
MODE = Observable(
    "ln frequency of the mode at 300 Hz", "plate", "plate", "1", 0.02, 0.01, 300.0, (0.001, 0.1)
)
LINE_1, LINE_2 = (
    Observable(
        f"acceleration_1 spectrum at {f:g} Hz", "plate", "acceleration_1", "dB", tolerance, 0.2, f
    )
    for f, tolerance in ((100.0, 0.5), (200.0, 1.0))
)
REST = Observable(
    "acceleration_1 rest", "plate", "acceleration_1", "1", 0.1, 0.05, None, (0.0, 0.1), detail=True
)


def table(
    observables: Sequence[Observable],
    mean: Sequence[Sequence[float]],
    count: Sequence[Sequence[int]] | None = None,
    sigma: Sequence[float] | None = None,
) -> GapTable:
    """`sigma` is the scatter of one run of each observable; 1000 runs of each configuration, unless
    said otherwise."""
    values = np.array(mean, dtype=np.float64)
    scatter = np.full(len(observables), 1e-6) if sigma is None else np.array(sigma)
    return GapTable(
        record=CampaignRecord("by hand", "gun", (), ()),
        observables=tuple(observables),
        residuals=values,
        mean=values,
        count=np.where(np.isfinite(values), 1000, 0)
        if count is None
        else np.array(count, dtype=np.intp),
        noise=Noise(np.diag(scatter**2), np.full(len(observables), 10.0)),
        nuisances=np.zeros((0, *values.shape)),
        loudness={},
    )


def test_gap_of_one_stage_is_the_rms_of_its_cells_in_their_own_unit() -> None:
    gap = table([VELOCITY], [[0.03], [-0.04], [0.0], [0.12]])
    size = GapMetric.of(gap).size(gap)
    assert size.before == pytest.approx(np.sqrt((0.03**2 + 0.04**2 + 0.12**2) / 4))
    assert size.tolerance == pytest.approx(0.01)
    assert "velocity" in size.metric
    gap = table(OBSERVABLES, [[0.1] * len(OBSERVABLES)])
    names = [gap.observables[column].name for column in GapMetric.of(gap).columns]
    assert sorted(names) == ["ln_impulse", "ln_peak", "ln_width_half"]


@pytest.mark.parametrize(
    ("observables", "columns", "unit"),
    [
        ([VELOCITY], [0], "logarithm"),
        ([TENTH, PEAK, HALF, IMPULSE], [1, 2, 3], "logarithm"),
        ([MODE, LINE_1, REST, LINE_2], [1, 3], "dB"),
        (
            [VELOCITY, TENTH, PEAK, IMPULSE, HALF, MODE, LINE_1, LINE_2, REST],
            [0, 2, 3, 4, 6, 7],
            "tolerances",
        ),
    ],
    ids=["gun", "contact", "plate", "all"],
)
def test_amplitudes_and_lines_make_the_number(
    observables: list[Observable], columns: list[int], unit: str
) -> None:
    """Shapes, timings, modes and what is left of a record are for telling causes apart: however far
    they are off, the gap stays what it is."""
    row = np.full(len(observables), 0.25)
    gap = table(observables, [row.tolist()])
    metric = GapMetric.of(gap)
    assert metric.columns.tolist() == columns
    assert unit in metric.name
    others = np.setdiff1d(np.arange(len(row)), columns)
    away = gap.mean.copy()
    away[:, others] = 100.0
    assert metric.rms(away) == metric.rms(gap.mean)
    for column in columns:
        moved = gap.mean.copy()
        moved[:, column] *= 2
        assert metric.rms(moved) > metric.rms(gap.mean)


def test_unit_of_one_stage_is_its_own_and_of_several_their_tolerances() -> None:
    # 0.02, 0.03 and 0.06: sqrt(49 / 3) %.
    observables = [PEAK, IMPULSE, HALF]
    gap = table(observables, [[item.tolerance for item in observables]] * 3)
    size = GapMetric.of(gap).size(gap)
    assert size.tolerance == pytest.approx(0.01 * np.sqrt(49 / 3))
    assert size.before == pytest.approx(size.tolerance)
    # Velocity off by three of its tolerances, the peak by four, lines by one and by none.
    gap = table([VELOCITY, PEAK, MODE, LINE_1, LINE_2], [[0.03, -0.08, 9.0, 0.5, 0.0]])
    size = GapMetric.of(gap).size(gap)
    assert size.before == pytest.approx(np.sqrt((9 + 16 + (1 + 0) / 2) / 3))
    assert size.tolerance == 1.0
    assert all(name in size.metric for name in ("gun", "contact", "plate", "tolerances"))


def test_floor_is_the_scatter_of_means() -> None:
    # One run scatters by two tolerances and by three; means of four and of nine by one.
    gap = table([VELOCITY, PEAK], [[0.0, 0.0]], [[4, 9]], [0.02, 0.06])
    size = GapMetric.of(gap).size(gap)
    assert size.noise_floor == pytest.approx(1.0)
    assert size.before == 0.0
    nan = float("nan")
    gap = table(
        [PEAK, IMPULSE],
        [[0.03, nan], [nan, nan], [0.05, -0.07]],
        [[4, 0], [0, 0], [4, 1]],
        [0.02, 0.01],
    )
    size = GapMetric.of(gap).size(gap)
    assert size.before == pytest.approx(np.sqrt((0.03**2 + 0.05**2 + 0.07**2) / 3))
    assert size.noise_floor == pytest.approx(np.sqrt((2 * 0.02**2 / 4 + 0.01**2) / 3))


@pytest.mark.parametrize(("before", "beyond"), [(0.0499, False), (0.0501, True)])
def test_gap_is_beyond_noise_where_more_than_the_tolerance_is_left_of_it(
    before: float, beyond: bool
) -> None:
    """3, 4, 5: a floor of 0.04, and a tolerance of 0.03."""
    item = Observable("ln_velocity", "gun", "velocity", "1", 0.03, 0.01)
    gap = table([item], [[before], [-before]], [[1], [1]], [0.04])
    size = GapMetric.of(gap).size(gap)
    assert (size.before, size.noise_floor, size.tolerance) == pytest.approx((before, 0.04, 0.03))
    assert size.beyond_noise is beyond


def test_gap_within_tolerance_or_scatter_has_nothing_to_reduce() -> None:
    item = Observable("ln_velocity", "gun", "velocity", "1", 0.5, 0.01)
    gap = table([item], [[0.5], [-0.5]], sigma=[0.0])
    assert not GapMetric.of(gap).size(gap).beyond_noise
    # A mean may come to lie nearer to zero than its scatter says.
    gap = table([VELOCITY], [[0.001], [-0.002]], [[1], [1]], [0.5])
    size = GapMetric.of(gap).size(gap)
    assert size.noise_floor > size.before
    assert size.beyond_noise is False


def test_scales_are_units_of_the_stages_and_infinite_where_nothing_counts() -> None:
    inf = float("inf")
    one = table([TENTH, PEAK, HALF], [[0.0, 0.0, 0.0]])
    assert {name: unit.tolist() for name, unit in GapMetric.of(one).scales(one).items()} == {
        "contact": [inf, 1, 1]
    }
    several = table([VELOCITY, PEAK, TENTH, REST, LINE_1, LINE_2], [[0.0] * 6])
    scales = GapMetric.of(several).scales(several)
    alone, of_two = (
        np.sqrt(3 / 4),
        np.sqrt(6 / 4),
    )  # one or two of the four columns, a third of the weight
    assert scales["gun"] == pytest.approx([0.01 * alone])
    assert scales["contact"] == pytest.approx([0.02 * alone, inf])
    assert scales["plate"] == pytest.approx([inf, 0.5 * of_two, 1.0 * of_two])
    assert GapMetric.of(several).weights(several) == pytest.approx(
        [4 / 3, 4 / 3, 0.0, 0.0, 2 / 3, 2 / 3]
    )


@given(st.lists(st.lists(st.floats(-3, 3), min_size=6, max_size=6), min_size=1, max_size=5))
def test_rms_over_scales_is_the_gap(mean: list[list[float]]) -> None:
    """What is divided by infinity adds nothing to the sum, and is not counted."""
    gap = table([VELOCITY, PEAK, TENTH, REST, LINE_1, LINE_2], mean)
    metric = GapMetric.of(gap)
    scales = np.concatenate([metric.scales(gap)[name] for name in gap.stages])
    square = ((gap.mean / scales) ** 2).sum() / (np.isfinite(scales).sum() * len(mean))
    assert metric.rms(gap.mean) == pytest.approx(np.sqrt(square))
