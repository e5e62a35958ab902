"""Where a model is good: errors that were put into some groups are found there and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.app.figures.figure import BarSeries, PointSeries
from pyroshock.app.operations.train.figures import coverage_rows, evaluated_figures
from pyroshock.app.operations.train.strengths import (
    group_errors,
    strength_sentences,
    strength_tables,
    strengths_figure,
)
from pyroshock.training.evaluation.floor import repeatability_floor
from pyroshock.training.evaluation.metrics import pulse_errors
from pyroshock.training.models.base import ContactPrediction
from pyroshock.training.registry.evaluate import Evaluation
from support.records.pulse_tables import pulse_table

WRONG = "polyurethane"


def judged(pulses, force_n, spread=None):
    prediction = ContactPrediction(force_n, pulses.contact_time_s, spread, None)
    errors = pulse_errors(pulses, prediction)
    return Evaluation(pulses, {"m@1": errors}, {"m@1": prediction}, {"m@1": 0})


@pytest.fixture(scope="module")
def halves():
    """Repetitions of every configuration on both sides."""
    table = pulse_table(np.random.default_rng(1), repetitions=8)
    held = np.arange(len(table)) % 4 == 0
    return table.take(~held), table.take(held)


@pytest.fixture(scope="module")
def groups(halves):
    """A model that errs by 2 % of the force, and by half of it behind a soft tip."""
    training, held_out = halves
    factor = np.where(held_out.tip_material == WRONG, 1.5, 1.02)
    pressure = np.where(np.arange(len(held_out)) % 2, 2e5, 4e5)
    return group_errors(
        judged(held_out, held_out.force_n * factor[:, None]),
        "m@1",
        training,
        {"tank_pressure": pressure},
    )


def test_the_group_with_the_error_is_marked_and_no_other_material(groups):
    tips = {own.level: own.is_worse for own in groups if own.factor == "tip"}
    assert tips.pop(WRONG) and not any(tips.values())


def test_the_repeatability_is_the_floor_of_the_pulses_of_the_group(groups, halves):
    training, held_out = halves
    floor = repeatability_floor(training, held_out)
    rows = held_out.tip_material[floor.rows] == WRONG
    own = next(own for own in groups if (own.factor, own.level) == ("tip", WRONG))
    assert own.repeatability == pytest.approx(floor.errors.force_nrmse[rows].mean())


def test_velocities_are_ranges_in_their_unit_and_pressures_their_levels(groups):
    velocities = [own.level for own in groups if own.factor == "impact velocity"]
    assert len(velocities) == 3 and all(level.endswith(" m/s") for level in velocities)
    pressures = {own.level for own in groups if own.factor == "tank pressure"}
    assert pressures == {"2 bar", "4 bar"}
    assert sum(own.pulses for own in groups if own.factor == "impact velocity") == sum(
        own.pulses for own in groups if own.factor == "tip"
    )


def test_the_sentence_names_the_worst_group_with_both_errors(groups):
    (sentence_text,) = map(str, strength_sentences("m@1", groups))
    assert f"tip {WRONG} (" in sentence_text and " against " in sentence_text
    counts = strength_tables(groups)[0].rows[0]
    assert sentence_text.startswith(
        f"In {counts['within twice the repeatability']} of {counts['groups']} "
    )


def test_the_picture_marks_the_groups_beyond_twice_the_repeatability(groups):
    figure = strengths_figure(groups)
    bars = [own for own in figure.series if isinstance(own, BarSeries)]
    twice, once = bars
    assert np.allclose(twice.end, 2 * once.end)
    marked = next(
        own
        for own in figure.series
        if isinstance(own, PointSeries) and own.name.startswith("error of more")
    )
    names = [figure.y.categories[int(place)] for place in marked.y]
    assert f"tip: {WRONG}" in names
    assert (marked.x > np.interp(marked.y, twice.position, twice.end)).all()


def test_a_model_without_repetitions_is_not_held_against_any(halves):
    """One pulse of each treatment: nothing was repeated."""
    training, held_out = halves
    first = np.unique(held_out.treatment, return_index=True)[1]
    alone = held_out.take(first)
    others = replace_labels(training)
    groups = group_errors(judged(alone, alone.force_n * 1.02), "m@1", others, {})
    assert all(own.repeatability is None for own in groups)
    assert "No impact was repeated" in next(map(str, strength_sentences("m@1", groups)))


def replace_labels(pulses):
    """The same pulses as if they were of other configurations."""
    return replace(
        pulses,
        configuration=np.char.add("other ", pulses.configuration),
        treatment=np.char.add("other ", pulses.treatment),
    )


def test_the_share_that_is_held_has_an_interval_that_counts_configurations(halves):
    """Bands of one true standard deviation hold nine tenths; their interval contains that."""
    _, held_out = halves
    rng = np.random.default_rng(2)
    spread = np.full_like(held_out.force_n, 10.0)
    noisy = held_out.force_n + rng.normal(scale=10.0, size=held_out.force_n.shape)
    coverage = evaluated_figures(judged(held_out, noisy, spread), "m@1")["coverage"]
    for level, held, (low, high) in zip(
        coverage["level"], coverage["force"], coverage["force_ci90"], strict=True
    ):
        assert low < held < high and low - 0.02 < level < high + 0.02
    assert [row["nominal"] for row in coverage_rows(coverage)] == ["50 %", "80 %", "90 %", "95 %"]
