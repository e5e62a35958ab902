"""Counts of a converter: found where they are, exact to the bit, and left alone where they are not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyroshock.schema.counts import LARGEST_COUNT, as_counts, from_counts


def converter(step: float, noise_steps: float, dtype: str, samples: int = 40_000, seed: int = 1) -> np.ndarray:
    counts = np.random.default_rng(seed).normal(0, noise_steps, samples).round().clip(-LARGEST_COUNT, LARGEST_COUNT)
    return (counts.astype(np.int16) * np.float64(step)).astype(dtype)


def restored(samples: np.ndarray) -> np.ndarray | None:
    found = as_counts(samples)
    if found is None:
        return None
    again = np.empty_like(samples)
    from_counts(*found, again)
    return again


@settings(max_examples=60)
@given(st.floats(1e-9, 1e6), st.floats(0.5, 9000), st.sampled_from(["<f4", "<f8"]), st.integers(0, 9))
def test_found_counts_give_every_bit_back(step, noise_steps, dtype, seed):
    samples = converter(step, noise_steps, dtype, seed=seed)
    again = restored(samples)
    assert again is None or again.tobytes() == samples.tobytes()


@pytest.mark.parametrize("dtype", ["<f4", "<f8"])
@pytest.mark.parametrize("noise_steps", [1.0, 30.0, 3000.0])
def test_step_is_found_whatever_the_scale(dtype, noise_steps):
    steps = 10 ** np.random.default_rng(2).uniform(-9, 6, 40)
    found = sum(restored(converter(step, noise_steps, dtype)) is not None for step in steps)
    # In double precision the product's rounding leaves a few steps that no double stands for.
    assert found >= 34


def test_step_in_single_precision_is_the_converters_and_rare_large_counts_are_kept():
    _, step = as_counts(converter(0.152587890625, 5.0, "<f4"))
    assert step == 0.152587890625
    samples = converter(0.1, 2.0, "<f4")
    samples[12_345] = np.float32(-32_767 * 0.1)
    assert restored(samples).tobytes() == samples.tobytes()


def test_anything_else_is_left_alone():
    samples = converter(0.1, 2.0, "<f8")
    for other in (samples + 0.3, np.zeros_like(samples), samples[:1]):
        assert as_counts(other) is None
    for value in (np.nan, np.inf, 33_000 * 0.1, -0.0, 0.15):
        assert as_counts(np.where(np.arange(samples.size) == 777, value, samples)) is None, value
    for dtype in ("<i2", "|u1", "<c8", ">f8"):
        assert as_counts(np.arange(100).astype(dtype)) is None, dtype


@settings(max_examples=200)
@given(st.lists(st.floats(width=32), min_size=1, max_size=50))
@example([5e-324, 0.0, 1.0])
@example([1e308, -1e308])
def test_no_number_is_refused_or_changed(values):
    for dtype in ("<f4", "<f8"):
        with np.errstate(over="ignore"):
            samples = np.array(values, dtype=dtype)
        again = restored(samples)
        assert again is None or again.tobytes() == samples.tobytes()
