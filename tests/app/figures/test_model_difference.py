"""The figure of two models' differences has a row for each metric and each group."""

from __future__ import annotations

import numpy as np
from pyroshock.app.figures.model_difference import difference_figure
from pyroshock.dataset.table import PulseTable
from pyroshock.training.evaluation.comparison import compare, comparison_groups
from pyroshock.training.evaluation.metrics import PulseErrors, pulse_errors
from pyroshock.training.models.base import ContactPrediction
from support.records.pulse_tables import held_out, pulse_table


def errors_of(pulses: PulseTable, share: float) -> PulseErrors:
    predicted = ContactPrediction(
        (1 + share) * pulses.force_n, (1 - share) * pulses.contact_time_s, None, None
    )
    return pulse_errors(pulses, predicted)


def test_difference_figure_has_every_group() -> None:
    rng = np.random.default_rng(0)
    pulses = held_out(pulse_table(rng, repetitions=3), rng)[1]
    a, b = errors_of(pulses, 0.3), errors_of(pulses, 0.003)
    groups = comparison_groups(pulses)
    result = compare(
        a,
        b,
        pulses.configuration,
        groups,
        np.random.default_rng(0),
        resamples=50,
    )
    figure = difference_figure(result)
    labels = [label.get_text() for label in figure.axes[1].get_yticklabels()]
    assert len(labels) == sum(len(np.unique(values)) for values in groups.values())
    assert "insulator: polymeric" in labels
    figure.canvas.draw()
    result = compare(a, b, pulses.configuration, {}, np.random.default_rng(0), resamples=50)
    assert len(difference_figure(result).axes) == 1
