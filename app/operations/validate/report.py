"""A validation as a report, of the data of `validate --json`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...common.number_format import number
from ...common.quantities import shown_unit
from ...documents.document import (
    Block,
    Bullets,
    ChartRow,
    Document,
    Paragraph,
    Section,
    Table,
)
from ...figures.figure import (
    DIMENSIONLESS,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PointSeries,
    ReferenceLine,
    StepSeries,
    category,
)
from .validation import (
    COLUMNS,
    MAIN_COLUMNS,
    adopted_lines,
    reason_lines,
    score_rows,
)
from .verdict import failure_sentences, is_calibrated, quantity_words, verdict_text

#: Per cent of the ranks in each of the ten bins, of bands that are right.
_UNIFORM = 10.0


def validation_document(data: Mapping[str, Any]) -> Document:
    """The report on a validation."""
    sections = (
        Section(
            "Where the predictions fail",
            [
                Bullets(
                    [str(failure) for failure in failure_sentences(data)],
                    "No group of shots is predicted wrong by more than chance.",
                )
            ],
        ),
        Section("Scores", _scores(data)),
        Section(
            "With the adopted effects",
            [Bullets(lines, "")] if (lines := adopted_lines(data)) else [],
        ),
        Section("Measured beside predicted", _comparisons(data)),
        Section("Ranks of the measured values", _ranks(data)),
        Section("Lines of the spectra", _lines(data["lines"])),
        Section(
            "Not compared",
            [Bullets(reason_lines(data["left_out"]), "Every shot is compared.", quiet=True)],
        ),
        Section("Assumptions of the twin", [Bullets(data["notes"], "None.", quiet=True)]),
    )
    return Document(
        kind="Validation",
        title=data["campaign"],
        lead=verdict_text(data) if is_calibrated(data) else f"{verdict_text(data)} {CONSEQUENCE}",
        facts={
            "What the predictions had seen": f"{data['seen'][0].upper()}{data['seen'][1:]}",
            "Made in": f"{number(data['seconds'])} s",
        },
        sections=[section for section in sections if section.blocks],
    )


#: What a verdict that is not calibrated means.
CONSEQUENCE = (
    "Do not rely on the 90 % bands of this twin yet. Diagnose the campaign to find the cause of "
    "the deviations, or train the contact model on more shots, and validate again."
)


def _scores(data: Mapping[str, Any]) -> list[Block]:
    rows = [list(row.values()) for row in score_rows(data)]
    caption = (
        "Measured values inside of the bands, errors of the median, width of the bands and CRPS."
    )
    return [
        Table(caption, COLUMNS, rows, main=MAIN_COLUMNS),
        Paragraph(
            "“At least” and “at most” are the ends of the 95 % interval of the share inside the "
            "90 % band, of all quantities together. It counts independent values, not shots: "
            "repetitions resemble each other. The mean deviation is that of the prediction from "
            "the measured value: + is too high. CRPS is the continuous ranked probability score of "
            "the logarithm, or of the level in dB; less is better.",
            quiet=True,
        ),
    ]


def _comparisons(data: Mapping[str, Any]) -> list[Block]:
    """Measured values and the bands of the shots in the order of their predictions."""
    figures = []
    for row in data["quantities"]:
        shots = [
            shot["quantities"][row["name"]]
            for shot in data["shots"]
            if row["name"] in shot["quantities"]
        ]
        if shots:
            figures.append(_in_order(row, shots))
    return [ChartRow(figures)] if figures else []


def _in_order(row: Mapping[str, Any], shots: list[Mapping[str, float]]) -> Plot:
    unit, scale = shown_unit(row["quantity_unit"])
    ordered = sorted(shots, key=lambda shot: shot["predicted"])
    x = np.arange(1, len(ordered) + 1, dtype=np.float64)
    measured, predicted, low, high = (
        scale * np.array([shot[key] for shot in ordered])
        for key in ("measured", "predicted", "low90", "high90")
    )
    labels = tuple(f"shot {i:.0f}" for i in x)
    bands = PointSeries(
        name="predicted, with its 90 % band",
        role=ColourRole.MODEL,
        x=x,
        y=predicted,
        y_low=low,
        y_high=high,
        size=4.0,
        labels=labels,
    )
    points = PointSeries(
        name="measured", role=ColourRole.MEASURED, x=x, y=measured, size=6.0, labels=labels
    )
    words = quantity_words(row["name"])
    return Plot(
        words,
        PlotAxis("shot, in the order of the prediction", DIMENSIONLESS, whole=True),
        PlotAxis(words.partition(",")[0], unit),
        (bands, points),
    )


def _ranks(data: Mapping[str, Any]) -> list[Block]:
    figures = [_histogram(row) for row in data["quantities"]]
    return [
        Paragraph(
            "If the bands are right, a tenth of the measured values has a rank in each tenth of "
            "the predicted draws (dashed). Many values at both ends mean that the bands are too "
            "narrow, many in the middle that they are too wide, and many at one end that the "
            "predictions are too high or too low.",
            quiet=True,
        ),
        ChartRow(figures),
    ]


def _histogram(row: Mapping[str, Any]) -> Plot:
    shares = 100 * np.array(row["pit_histogram"], dtype=np.float64)
    edges = np.linspace(0.0, 1.0, len(shares) + 1)
    highest = 1.05 * max(float(shares.max()), 2 * _UNIFORM)
    return Plot(
        quantity_words(row["name"]),
        PlotAxis("rank among the draws", DIMENSIONLESS),
        PlotAxis("measured values", "%", limits=(0.0, highest)),
        (StepSeries(role=ColourRole.MEASURED, edges=edges, values=shares, filled=True),),
        (ReferenceLine("y", _UNIFORM),),
    )


def _lines(lines: Mapping[str, list[Mapping[str, float]]]) -> list[Block]:
    """Coverage and error at each line, the sensors over each other."""
    inside, error = list[LineSeries](), list[LineSeries]()
    for number_of_sensor, (name, rows) in enumerate(lines.items()):
        columns = {key: np.array([row[key] for row in rows]) for key in _LINE_COLUMNS}
        frequency, sensor = columns["frequency_hz"], quantity_words(name).partition(", ")[2]
        role, coverage = category(number_of_sensor), 100 * columns["coverage90"]
        inside.append(LineSeries(frequency, coverage, name=sensor, role=role))
        error.append(LineSeries(frequency, columns["median_abs_error"], name=sensor, role=role))
    if not inside:
        return []
    x = PlotAxis("natural frequency", "Hz", "log")
    figures = [
        Plot(
            "Inside of the 90 % band",
            x,
            PlotAxis("measured values inside", "%"),
            tuple(inside),
            (ReferenceLine("y", 90.0),),
        ),
        Plot("Median error of the level", x, PlotAxis("error", "dB"), tuple(error)),
    ]
    return [ChartRow(figures)]


_LINE_COLUMNS = ("frequency_hz", "coverage90", "median_abs_error")
