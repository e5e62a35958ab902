"""Kernels of what a simulator is off by: distances between configurations, observables together,
backgrounds."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference.model_error import (
    BANK,
    LENGTH,
    OCTAVES,
    OWN,
    PLATE_BANK,
    SHARED,
    ErrorKernels,
    ModelErrorAmplitudes,
    bank,
    observable_kernel,
    same_levels,
    squared_distances,
)
from pyroshock.diagnosis.observables.base import Observable

FACTORS = [
    {"tip": tip, "speed": speed, "pressure": pressure}
    for tip in ("steel", "delrin")
    for speed in (1.0, 1.5, 2.0)
    for pressure in (1.0, 4.0, 16.0)
]
PULSE = tuple(
    Observable(name, "contact", "force", "1", 0.03, 0.02) for name in ("ln_peak", "ln_width")
)


def kernels(observables=PULSE) -> ErrorKernels:
    c, o = (rows.ravel() for rows in np.indices((len(FACTORS), len(observables))))
    return ErrorKernels.of(FACTORS, observables, c, o)


def test_distances_add_over_shares_of_the_factors_ranges():
    distance = squared_distances([{"speed": speed} for speed in (1.0, 1.5, 2.0)])
    np.testing.assert_allclose(distance, [[0, 0.25, 1], [0.25, 0, 0.25], [1, 0.25, 0]])
    distance = squared_distances([{"pressure": pressure} for pressure in (1.0, 10.0, 100.0)])
    np.testing.assert_allclose(distance, [[0, 0.25, 1], [0.25, 0, 0.25], [1, 0.25, 0]])
    distance = squared_distances([{"tip": tip} for tip in ("steel", "delrin", "steel")])
    np.testing.assert_array_equal(distance, [[0, 1, 0], [1, 0, 1], [0, 1, 0]])
    rows = [{"tip": "steel", "speed": speed} for speed in (1.0, 2.0)]
    np.testing.assert_array_equal(squared_distances(rows), [[0, 1], [1, 0]])
    total = sum(squared_distances([{name: row[name]} for row in FACTORS]) for name in FACTORS[0])
    np.testing.assert_allclose(squared_distances(FACTORS), total)
    rows = [
        {"tip": tip, "speed": speed, "plate": "x"}
        for tip, speed in (("a", 1.0), ("a", 2.0), ("b", 2.0))
    ]
    np.testing.assert_array_equal(same_levels(rows), [[1, 0.5, 0], [0.5, 1, 0.5], [0, 0.5, 1]])
    np.testing.assert_array_equal(same_levels([{"plate": "x"}] * 2), np.ones((2, 2)))


def test_observables_share_errors_by_octaves_and_parts():
    lines = [
        Observable(f"a at {f:g} Hz", "plate", channel, "dB", 0.5, 0.3, frequency_hz=f)
        for channel, f in (("a", 100.0), ("a", 200.0), ("b", 200.0))
    ]
    kernel = observable_kernel(lines)
    assert kernel[0, 1] == pytest.approx(SHARED * np.exp(-0.5 / OCTAVES**2))
    assert kernel[1, 2] == 0.0
    np.testing.assert_array_equal(np.diag(kernel), 1.0)
    # An impulse is a height times a length, and has a little of its own beside them.
    parts = (("height",), ("length",), ("height", "length"))
    own = [Observable(str(part), "contact", "force", "1", 0.03, 0.02, parts=part) for part in parts]
    np.testing.assert_allclose(
        observable_kernel(own), [[1 + OWN, 0, 1], [0, 1 + OWN, 1], [1, 1, 2 + OWN]]
    )


def test_background_is_the_sum_of_its_amplitudes_squared():
    own = kernels()
    matrix = own.background(ModelErrorAmplitudes(0.5, 0.3, 0.2))
    np.testing.assert_allclose(np.diag(matrix), 0.5**2 + 0.3**2 + 0.2**2)
    first, last = 0, len(FACTORS) - 1  # of the same observable
    smooth = np.exp(-0.5 * squared_distances(FACTORS)[first, last] / LENGTH**2)
    assert matrix[2 * first, 2 * last] == pytest.approx(0.5**2 + 0.3**2 * smooth)
    detail = (PULSE[0], Observable("ln_rise", "contact", "force", "1", 0.03, 0.02, detail=True))
    matrix = kernels(detail).background(ModelErrorAmplitudes(1.0, detail=0.15))
    np.testing.assert_allclose(np.diag(matrix), np.tile([1.0, 0.15**2], len(FACTORS)))
    matrix = kernels().discrepancy()
    np.testing.assert_allclose(np.diag(matrix), 1.0)
    assert np.linalg.eigvalsh(matrix).min() > 0
    for stage in ("gun", "contact", "plate"):
        assert np.abs(kernels().background(bank(stage)[0])).max() == 0.0


@pytest.mark.parametrize("member", [*BANK, *PLATE_BANK])
def test_every_background_is_a_covariance(member: ModelErrorAmplitudes):
    assert np.linalg.eigvalsh(kernels().background(member)).min() > -1e-9
