"""A validation as a report, of the data of `validate --json`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..common.number_format import number
from ..documents.document import Block, Bullets, ChartRow, Document, Figure, Paragraph, Section, Table
from ..documents.svg import band, chart, dots, frame_of, level, line
from .validation import COLUMNS, failure_lines, quantity_words, reason_lines, score_rows

#: Shares of the ranks that the histogram's bins hold, of bands that mean what they say.
_UNIFORM = 0.1
_KEYS = (("interval", "90 % band of the prediction"), ("after", "measured"))


def validation_document(data: Mapping[str, Any]) -> Document:
    """The report on a validation."""
    return Document(
        kind="Validation",
        title=data["campaign"],
        lead=data["verdict"],
        facts={"What the predictions had seen": f"{data['seen']}.", "Made in": f"{number(data['seconds'])} s"},
        sections=(
            Section("Scores", _scores(data)),
            Section("Where the predictions fail", [Bullets(failure_lines(data), "No rule stands out from chance.")]),
            Section("Measured beside predicted", _comparisons(data)),
            Section("Ranks of the measured values", _ranks(data)),
            Section("Lines of the spectra", _lines(data)),
            Section("Not compared", [Bullets(reason_lines(data["left_out"]), "Every shot is compared.")]),
            Section("Assumptions of the twin", [Bullets(data["notes"], "None.")]),
        ),
    )


def _scores(data: Mapping[str, Any]) -> list[Block]:
    rows = [list(row.values()) for row in score_rows(data)]
    return [
        Table(
            "Shares of measured values inside of the bands, errors of the median, sharpness and CRPS.", COLUMNS, rows
        ),
        Paragraph(
            "The interval of a share counts configurations, not shots: repetitions resemble each other. The mean "
            "deviation is measured over predicted. CRPS is the continuous ranked probability score of the logarithm, "
            "or of the level in dB; less is better.",
            quiet=True,
        ),
    ]


def _comparisons(data: Mapping[str, Any]) -> list[Block]:
    """Measured values and the bands of the shots in the order of their predictions."""
    figures = []
    for row in data["quantities"]:
        shots = [shot["quantities"][row["name"]] for shot in data["shots"] if row["name"] in shot["quantities"]]
        if shots:
            figures.append(Figure(quantity_words(row["name"]), _in_order(row, shots), _KEYS))
    return [ChartRow(figures)] if figures else [Paragraph("No quantity of a whole shot was measured.", quiet=True)]


def _in_order(row: Mapping[str, Any], shots: list[Mapping[str, float]]) -> str:
    ordered = sorted(shots, key=lambda shot: shot["predicted"])
    x = np.arange(1, len(ordered) + 1, dtype=np.float64)
    measured, low, high = (np.array([shot[key] for shot in ordered]) for key in ("measured", "low90", "high90"))
    frame = frame_of([np.array([0.5, len(ordered) + 0.5])], [measured, low, high])
    marks = [line(frame, np.array([a, a]), np.array([b, c]), "interval") for a, b, c in zip(x, low, high, strict=True)]
    names = [f"shot {i:.0f}" for i in x]
    unit = f"{quantity_words(row['name'])} ({row['quantity_unit']})"
    title = f"{quantity_words(row['name'])}, measured and predicted"
    return chart(
        title, frame, [*marks, dots(frame, x, measured, "after", names)], "shot, by prediction", unit, whole=True
    )


def _ranks(data: Mapping[str, Any]) -> list[Block]:
    figures = [Figure(quantity_words(row["name"]), _histogram(row)) for row in data["quantities"]]
    return [
        ChartRow(figures),
        Paragraph(
            "Where bands mean what they say, a tenth of the measured values has a rank in each tenth of the predicted "
            "draws. A hollow in the middle tells of bands that are too narrow, a hump of bands that are too wide, a "
            "slope of predictions that are too high or too low.",
            quiet=True,
        ),
    ]


def _histogram(row: Mapping[str, Any]) -> str:
    shares = np.array(row["pit_histogram"], dtype=np.float64)
    edges = np.repeat(np.linspace(0.0, 1.0, len(shares) + 1), 2)[1:-1]
    heights = np.repeat(shares, 2)
    frame = frame_of([edges], [heights, np.array([0.0, 2 * _UNIFORM])])
    marks = [band(frame, edges, np.zeros_like(heights), heights, "floor"), level(frame, _UNIFORM, "tolerance")]
    return chart(f"ranks of the {quantity_words(row['name'])}", frame, marks, "rank among the draws", "share")


def _lines(data: Mapping[str, Any]) -> list[Block]:
    if not data["lines"]:
        return [Paragraph("No spectrum was measured.", quiet=True)]
    return [ChartRow(list(_line_charts(data["lines"])))]


def _line_charts(lines: Mapping[str, list[Mapping[str, float]]]) -> Iterator[Figure]:
    for name, rows in lines.items():
        frequency, inside, error = (
            np.array([row[key] for row in rows]) for key in ("frequency_hz", "coverage90", "median_abs_error")
        )
        decades = np.log10(frequency)
        frame = frame_of([decades], [100 * inside, np.array([0.0, 100.0])])
        marks = [line(frame, decades, 100 * inside, "after-line"), level(frame, 90.0, "tolerance")]
        title = f"{quantity_words(name)}: inside of the 90 % band"
        yield Figure(title, chart(title, frame, marks, "log10 of frequency (Hz)", "shots inside (%)"))
        frame = frame_of([decades], [error, np.zeros(1)])
        title = f"{quantity_words(name)}: median error"
        marks = [line(frame, decades, error, "before-line")]
        yield Figure(title, chart(title, frame, marks, "log10 of frequency (Hz)", "error (dB)"))
