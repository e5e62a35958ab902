"""Two versions on the same pulses, held to differences that are known beforehand."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from pyroshock.app.figures.figure import PointSeries
from pyroshock.app.operations.train.paired_errors import (
    paired_errors,
    paired_figure,
    paired_sentences,
    paired_tables,
)
from scipy.stats import ttest_rel

CONFIGURATIONS = ("near", "far", "alike", "single")
SIZES = (4, 4, 4, 1)


def judged(first: np.ndarray, second: np.ndarray, labels: np.ndarray):
    errors = {
        label: SimpleNamespace(force_nrmse=values)
        for label, values in (("a@1", first), ("b@1", second))
    }
    return SimpleNamespace(errors=errors, pulses=SimpleNamespace(configuration=labels))


@pytest.fixture
def pair():
    labels = np.repeat(CONFIGURATIONS, SIZES)
    second = np.full(len(labels), 0.10)
    off = np.array([-0.05, -0.06, -0.05, -0.04, 0.05, 0.04, 0.06, 0.05, 0.01, -0.01, 0.01, -0.01,
                    -0.02])  # fmt: skip
    return paired_errors(judged(second + off, second, labels), "a@1", "b@1")


def test_a_configuration_is_decided_by_the_scatter_of_its_repetitions(pair):
    verdicts = {own.configuration: own.verdict for own in pair.configurations}
    assert verdicts == {
        "near": "better",
        "far": "worse",
        "alike": "the same",
        "single": "not known",
    }
    assert [own.configuration for own in pair.configurations] == ["near", "single", "alike", "far"]


def test_the_interval_of_a_configuration_is_students(pair):
    near = next(own for own in pair.configurations if own.configuration == "near")
    first, second = np.array([0.05, 0.04, 0.05, 0.06]), np.full(4, 0.10)
    expected = ttest_rel(first, second).confidence_interval(0.90)
    assert (near.low, near.high) == pytest.approx((expected.low, expected.high))


def test_the_share_of_pulses_counts_repetitions_as_no_independent_evidence():
    """Sixteen pulses of two configurations tell less than sixteen of sixteen."""
    off = np.repeat([-0.01, 0.01], 8)
    few = paired_errors(judged(0.1 + off, np.full(16, 0.1), np.repeat(["x", "y"], 8)), "a@1", "b@1")
    many = paired_errors(judged(0.1 + off, np.full(16, 0.1), np.arange(16).astype(str)), "a@1",
                         "b@1")  # fmt: skip
    assert few.better_share == many.better_share == 0.5
    assert few.low < many.low < 0.5 < many.high < few.high


def test_pulses_on_which_both_err_alike_count_half():
    equal = paired_errors(
        judged(np.full(4, 0.1), np.full(4, 0.1), np.array(["x", "x", "y", "y"])), "a@1", "b@1"
    )
    assert equal.better_share == 0.5 and equal.better_pulses == 0
    assert {own.verdict for own in equal.configurations} == {"the same"}


def test_sentences_say_the_counts(pair):
    share, configurations = map(str, paired_sentences(pair))
    assert "a@1 has the smaller force error than b@1 on 7 of 13 pulses (54 %" in share
    assert configurations.startswith(
        "Of 4 configurations, a@1 is better on 1 and worse on 1; on 1 the difference is within the "
        "scatter of the repetitions; not decided, for want of repetitions: 1."
    )
    counts = paired_tables(pair)[0].rows[0]
    assert (counts["better"], counts["worse"], counts["the same"]) == (1, 1, 1)


def test_the_figure_has_every_pulse_and_every_configuration(pair):
    figure = paired_figure(pair)
    pulses, *verdicts = (own for own in figure.series if isinstance(own, PointSeries))
    assert len(pulses.x) == 13 and sum(len(own.x) for own in verdicts) == 4
    better = next(own for own in verdicts if own.name == "a@1 is better")
    assert better.labels == ("near",) and better.y.tolist() == pytest.approx([-5.0])
    assert figure.y.unit == "% points"
