"""Validations of the twin: ask for one, those that were made, and the page of each with its
charts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ...schema.conditions import list_campaign_names
from ...twin.contact.laws import LAWS
from ..common.quantities import shown_unit
from ..figures.plotly_base import COLOURS, Figure, bars, categories, figure, line, points
from ..operations.form import controls
from ..operations.validate.report import validation_document
from ..operations.validate.validating import VALIDATE
from ..operations.validate.validation import (
    COLUMNS,
    adopted_lines,
    reason_lines,
    score_rows,
)
from ..operations.validate.verdict import (
    failure_sentences,
    is_calibrated,
    joint_interval,
    quantity_words,
    verdict_text,
)
from ..twins.building import PRIOR
from ..web.dependencies import Key, OpenStore, Running
from ..web.jobs import finished_result
from ..web.rendering import page
from .report import Ending, report_file


def coverage_figure(data: Mapping[str, Any]) -> Figure:
    """Shares inside of the 50 and the 90 % bands by quantity, with 95 % intervals and the nominal
    shares."""
    names = [quantity_words(row["name"]) for row in data["quantities"]]
    traces, nominal = [], []
    for band, colour in ((50, "c1"), (90, "c0")):
        shares = np.array([row[f"coverage{band}"] for row in data["quantities"]])
        low, high = np.clip(
            np.array([_interval(row, band, len(names)) for row in data["quantities"]]).T, 0.0, 1.0
        )
        error = {
            "type": "data",
            "symmetric": False,
            "array": (100 * np.maximum(high - shares, 0)).tolist(),
            "arrayminus": (100 * np.maximum(shares - low, 0)).tolist(),
        }
        traces.append(
            bars(names, 100 * shares, f"inside of the {band} % band", colour, error_y=error)
        )
        # a line through one quantity would be a point: the shape spans the chart
        style = {"color": colour, "dash": "dash", "width": 1.5}
        nominal.append(
            {
                "type": "line",
                "xref": "paper",
                "x0": 0,
                "x1": 1,
                "y0": band,
                "y1": band,
                "line": style,
            }
        )
    chart = categories(
        traces, "quantity", "measured values inside (%)", barmode="group", shapes=nominal
    )
    chart["layout"]["yaxis"] |= {"range": [0, 103]}
    return chart


def _interval(row: Mapping[str, Any], band: int, quantities: int) -> tuple[float, float]:
    """Of the 90 % band the interval that the verdict rests on."""
    return joint_interval(row, quantities) if band == 90 else tuple(row[f"coverage{band}_ci95"])


def rank_figure(data: Mapping[str, Any]) -> Figure:
    """Probability-integral histograms: the share of measured values by their rank among the
    draws."""
    traces = []
    for i, row in enumerate(data["quantities"]):
        shares = row["pit_histogram"]
        middle = (np.arange(len(shares)) + 0.5) / len(shares)
        name = quantity_words(row["name"])
        traces.append(line(middle, shares, name, COLOURS[i % len(COLOURS)], mode="lines+markers"))
    traces.append(
        line([0.0, 1.0], [0.1, 0.1], "bands that mean what they say", "quiet", dash="dash")
    )
    return figure(traces, "rank among the predicted draws", "share of measured values")


def comparison_figures(data: Mapping[str, Any]) -> dict[str, Figure]:
    """Measured over predicted values with their 90 % bands, by quantity."""
    figures = {}
    for row in data["quantities"]:
        shots = [
            shot["quantities"][row["name"]]
            for shot in data["shots"]
            if row["name"] in shot["quantities"]
        ]
        if not shots:
            continue
        measured, predicted, low, high = (
            np.array([shot[key] for shot in shots])
            for key in ("measured", "predicted", "low90", "high90")
        )
        unit, scale = shown_unit(row["quantity_unit"])
        measured, predicted, low, high = (
            scale * values for values in (measured, predicted, low, high)
        )
        ends = np.array([min(measured.min(), low.min()), max(measured.max(), high.max())])
        error = {
            "type": "data",
            "symmetric": False,
            "array": (high - predicted).tolist(),
            "arrayminus": (predicted - low).tolist(),
            "thickness": 1,
        }
        words = quantity_words(row["name"])
        traces = [
            line(ends, ends, "equal", "quiet", dash="dash", width=1.2),
            points(measured, predicted, "prediction with its 90 % band", "c0", error_y=error),
        ]
        titles = f"measured {words} ({unit})", f"predicted {words} ({unit})"
        figures[words] = figure(traces, *titles, log_x=True, log_y=True)
    return figures


def line_figures(data: Mapping[str, Any]) -> dict[str, Figure]:
    """Coverage of the 90 % band and median error at each line of the spectra."""
    if not data["lines"]:
        return {}
    inside, error = [], []
    for i, (name, rows) in enumerate(data["lines"].items()):
        frequency = [row["frequency_hz"] for row in rows]
        words, colour = quantity_words(name), COLOURS[i % len(COLOURS)]
        inside.append(line(frequency, [100 * row["coverage90"] for row in rows], words, colour))
        error.append(line(frequency, [row["median_abs_error"] for row in rows], words, colour))
    ends = [rows[0]["frequency_hz"] for rows in data["lines"].values()][:1]
    ends += [rows[-1]["frequency_hz"] for rows in data["lines"].values()][:1]
    inside.append(line(ends, [90.0, 90.0], "90 %", "quiet", dash="dash"))
    return {
        "Inside of the 90 % band": figure(
            inside, "frequency (Hz)", "measured values inside (%)", log_x=True
        ),
        "Median error of the level": figure(error, "frequency (Hz)", "error (dB)", log_x=True),
    }


router = APIRouter()


@router.get("/validations")
def validations(request: Request, store: OpenStore, running: Running) -> Response:
    """The form, with the values of the address in its fields, and the validations that were
    made."""
    with store.reading() as session:
        names = list_campaign_names(session)
    made = [job for job in running.listed() if job.kind == VALIDATE.name]
    values = dict(request.query_params)
    further = set(VALIDATE.request.model_fields) - {"campaign"}
    return page(
        request,
        "validations.html",
        campaigns=names,
        campaign=values.get("campaign", ""),
        controls=controls(VALIDATE, values, names=further, suggestions={"contact": [PRIOR, *LAWS]}),
        jobs=made,
    )


@router.get("/validations/{job}")
def validation(request: Request, job: Key, running: Running) -> Response:
    data = finished_result(running, job, VALIDATE.name, "validation")
    return page(
        request,
        "validation.html",
        job=job,
        validation=data | {"verdict": verdict_text(data), "calibrated": is_calibrated(data)},
        columns=COLUMNS,
        rows=list(score_rows(data)),
        adopted=adopted_lines(data),
        failures=failure_sentences(data),
        left_out=reason_lines(data["left_out"]),
        coverage=coverage_figure(data),
        ranks=rank_figure(data),
        comparisons=comparison_figures(data),
        lines=line_figures(data),
    )


@router.get("/validations/{job}/report.{ending}")
def report(job: Key, ending: Ending, running: Running) -> Response:
    data = finished_result(running, job, VALIDATE.name, "validation")
    return report_file(validation_document(data), f"validation-{data['campaign']}", ending)
