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
    Figure,
    Paragraph,
    Section,
    Table,
)
from ...documents.svg import Curve, band, chart, dots, frame_of, level, line, line_chart, line_keys
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
_KEYS = (("interval", "90 % band of the prediction"), ("after", "measured"))


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
            "repetitions resemble each other. The mean deviation is measured over predicted. CRPS "
            "is the continuous ranked probability score of the logarithm, or of the level in dB; "
            "less is better.",
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
            figures.append(Figure(quantity_words(row["name"]), _in_order(row, shots)))
    return [ChartRow(figures, _KEYS)] if figures else []


def _in_order(row: Mapping[str, Any], shots: list[Mapping[str, float]]) -> str:
    unit, scale = shown_unit(row["quantity_unit"])
    ordered = sorted(shots, key=lambda shot: shot["predicted"])
    x = np.arange(1, len(ordered) + 1, dtype=np.float64)
    measured, low, high = (
        scale * np.array([shot[key] for shot in ordered]) for key in ("measured", "low90", "high90")
    )
    frame = frame_of([np.array([0.5, len(ordered) + 0.5])], [measured, low, high])
    marks = [
        line(frame, np.array([a, a]), np.array([b, c]), "interval")
        for a, b, c in zip(x, low, high, strict=True)
    ]
    marks.append(dots(frame, x, measured, "after", [f"shot {i:.0f}" for i in x]))
    title = f"{quantity_words(row['name'])}, measured and predicted"
    y_title = f"{quantity_words(row['name']).partition(',')[0]} ({unit})"
    return chart(title, frame, marks, "shot, in the order of the prediction", y_title, whole=True)


def _ranks(data: Mapping[str, Any]) -> list[Block]:
    figures = [Figure(quantity_words(row["name"]), _histogram(row)) for row in data["quantities"]]
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


def _histogram(row: Mapping[str, Any]) -> str:
    shares = 100 * np.array(row["pit_histogram"], dtype=np.float64)
    edges = np.repeat(np.linspace(0.0, 1.0, len(shares) + 1), 2)[1:-1]
    heights = np.repeat(shares, 2)
    frame = frame_of([edges], [heights, np.array([0.0, 2 * _UNIFORM])])
    marks = [
        band(frame, edges, np.zeros_like(heights), heights, "floor"),
        level(frame, _UNIFORM, "tolerance"),
    ]
    label = f"ranks of the {quantity_words(row['name'])}"
    return chart(label, frame, marks, "rank among the draws", "measured values (%)")


def _lines(lines: Mapping[str, list[Mapping[str, float]]]) -> list[Block]:
    """Coverage and error at each line, the sensors over each other."""
    inside, error = [], []
    for number_of_sensor, (name, rows) in enumerate(lines.items()):
        columns = {key: np.array([row[key] for row in rows]) for key in _LINE_COLUMNS}
        frequency, sensor = columns["frequency_hz"], quantity_words(name).partition(", ")[2]
        inside.append(Curve(sensor, frequency, 100 * columns["coverage90"], number_of_sensor))
        error.append(Curve(sensor, frequency, columns["median_abs_error"], number_of_sensor))
    if not inside:
        return []
    figures = []
    for title, y_title, curves, nominal in (
        ("Inside of the 90 % band", "measured values inside (%)", inside, 90.0),
        ("Median error of the level", "error (dB)", error, None),
    ):
        drawing = line_chart(
            title, curves, "natural frequency (Hz)", y_title, log_x=True, nominal=nominal
        )
        figures.append(Figure(title, drawing, line_keys(curves)))
    return [ChartRow(figures)]


_LINE_COLUMNS = ("frequency_hz", "coverage90", "median_abs_error")
