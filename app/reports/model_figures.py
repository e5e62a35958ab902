"""How a model errs on the pulses that were held out: predicted against measured, and what its bands cover."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from ...array_types import Floats
from .curves import MOST_POINTS, Cloud, Curve, agreement_chart, dot_keys, line_chart, line_keys
from .document import Block, ChartRow, Figure, Paragraph, Section
from .labels import force_unit

if TYPE_CHECKING:
    from ...dataset.table import PulseTable
    from ...training.models.base import ContactPrediction
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry


def pulses_section(registry: Registry, version: Version, read: Callable[[str], PulseTable]) -> Section:
    """The charts; in their place the reason where the store has not the pulses, or the registry not the predictions."""
    from ...training.evaluation.evaluate import on_held_out

    title = "On the pulses held out"
    try:
        judged = on_held_out(registry, [version], read)
    except (LookupError, ValueError) as error:
        return Section(title, [Paragraph(f"Not drawn: {error}", quiet=True)])
    pulses, prediction = judged.pulses, judged.predictions[version.label]
    caption = f"{len(pulses)} pulses that it was not trained on; dashed: 10 % off."
    if len(pulses) > MOST_POINTS:
        caption += f" {MOST_POINTS} of them are drawn."
    blocks: list[Block] = [
        Paragraph(caption, quiet=True),
        agreement(pulses, prediction),
        *_coverage(pulses, prediction),
    ]
    return Section(title, blocks)


def agreement(pulses: PulseTable, prediction: ContactPrediction) -> ChartRow:
    """Predicted against measured peak force and contact time, logarithmic: what counts is relative."""
    from ...training.evaluation.metrics import figures, reconstruct

    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    unit, per_newton = force_unit(float(pulses.peak_force_n.max()))
    force = _clouds(pulses, per_newton * pulses.peak_force_n, per_newton * peak)
    time = _clouds(pulses, 1e3 * pulses.contact_time_s, 1e3 * prediction.contact_time_s)
    charts = (("peak force", unit, force), ("contact time", "ms", time))
    drawn = [
        Figure(
            f"Predicted against measured {name}",
            agreement_chart(
                f"predicted against measured {name}",
                clouds,
                f"measured ({unit})",
                f"predicted ({unit})",
                logarithmic=True,
                off=0.1,
            ),
        )
        for name, unit, clouds in charts
    ]
    return ChartRow(drawn, dot_keys(force))


def _clouds(pulses: PulseTable, measured: Floats, predicted: Floats) -> list[Cloud]:
    names = [
        f"{c} run {r}, repetition {k}" for c, r, k in zip(pulses.campaign, pulses.run, pulses.repetition, strict=True)
    ]
    clouds = []
    for number, tip in enumerate(np.unique(pulses.tip_material).tolist()):
        rows = np.flatnonzero(pulses.tip_material == tip)
        clouds.append(Cloud(f"{tip} tip", measured[rows], predicted[rows], [names[i] for i in rows], number))
    return clouds


def _coverage(pulses: PulseTable, prediction: ContactPrediction) -> list[Block]:
    """How many measurements central intervals hold, beside how many they promise to."""
    from ...training.evaluation.plots import LEVELS, coverage

    pairs = (
        ("force", prediction.force_n - pulses.force_n, prediction.force_spread_n),
        ("contact time", prediction.contact_time_s - pulses.contact_time_s, prediction.contact_time_spread_s),
    )
    curves = [
        Curve(name, LEVELS, coverage(_scores(off, spread)), number)
        for number, (name, off, spread) in enumerate(pairs)
        if spread is not None
    ]
    if not curves:
        return [Paragraph("The model gives no spread: it has no intervals to cover anything.", quiet=True)]
    drawing = line_chart("promised and found coverage", curves, "promised coverage", "found coverage", diagonal=True)
    at_90 = ", ".join(f"{c.name} {float(c.y[LEVELS == 0.9][0]):.3f}" for c in curves)
    return [ChartRow([Figure(f"Coverage of intervals; at 0.90: {at_90}", drawing, line_keys(curves))])]


def _scores(off: Floats, spread: Floats) -> Floats:
    """Errors in spreads; where a law is certain any error is beyond all of its intervals."""
    return np.divide(off, spread, out=np.where(off == 0, 0.0, np.inf), where=spread > 0)
