"""What `pyroshock srs` tells of a recording: as JSON, as a table, as CSV, and as a figure."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ....files.atomic_write import atomic_file
from ....files.spreadsheet_guard import GuardedCsv
from ....signals.checks import Finding
from ....twin.srs.target import SpectrumComparison, Target
from ...common.number_format import finite
from ...common.quantities import display_of
from ...figures.figure import (
    BandSeries,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
)
from .spectra import Acceleration, MeasuredSpectrum

_CURVES = ("maximax", "positive", "negative", "primary", "residual")


def as_json(measured: MeasuredSpectrum) -> Any:
    """The form that scripts rely on, and beyond it channel, moments and comparison. SI; infinities
    become null."""
    spectrum = measured.spectrum
    form = {
        "unit": "m/s2",
        **{
            name: getattr(spectrum, name).tolist()
            for name in ("frequency_hz", *_CURVES, "pseudo_velocity_m_s")
        },
        "checks": [_finding_json(finding) for finding in measured.findings],
        "channel": measured.acceleration.channel,
        "sampling_rate_hz": measured.acceleration.sampling_rate_hz,
        "samples": int(measured.acceleration.values_m_s2.size),
        "start_s": measured.acceleration.start_s,
        "duration_s": measured.acceleration.duration_s,
        "q": spectrum.q,
        "damping_ratio": spectrum.damping_ratio,
        "sampling_error": spectrum.sampling_error.tolist(),
        "part": measured.part,
        "rest": {"removed_m_s2": measured.rest.level_m_s2, "sentence": measured.rest.sentence},
        "resampled": int(spectrum.resampled),
        "moments": asdict(measured.moments),
        "target": None if measured.comparison is None else _comparison_json(measured.comparison),
    }
    return finite(form)


def summary(measured: MeasuredSpectrum) -> dict[str, Any]:
    """What stands above the table: the channel, its moments, and how the target was met."""
    acceleration, held = measured.acceleration, measured.comparison
    columns = {
        "channel": acceleration.channel,
        "sampling_rate_hz": acceleration.sampling_rate_hz,
        "samples": int(acceleration.values_m_s2.size),
        "part": measured.part,
        "rest": measured.rest.sentence,
        "resampled": _resampled(measured),
        "q": measured.spectrum.q,
        **asdict(measured.moments),
    }
    if held is None:
        return columns
    lines = held.frequency_hz.size
    return columns | {
        "target": "met" if held.met else "missed",
        "rule": held.sentence().partition(": ")[2],
        "lines_within": f"{round(float(held.share_within) * lines)} of {lines}",
        "worst_margin_db": float(held.worst_margin_db),
        "worst_frequency_hz": float(held.worst_frequency_hz),
    }


def _resampled(measured: MeasuredSpectrum) -> str:
    """By how much, and what sampling may still have changed."""
    spectrum = measured.spectrum
    factor = int(spectrum.resampled)
    largest = float(spectrum.sampling_error.max())
    error = (
        f"lines are off by {largest:.1%} at most"
        if np.isfinite(largest)
        else "some lines have no bound"
    )
    return f"{f'{factor}-fold' if factor > 1 else 'no'}; by sampling, {error}"


def rows_of(measured: MeasuredSpectrum) -> list[dict[str, Any]]:
    """One row a line, as the table shows it; lines outside of the target's range have no level."""
    spectrum, held = measured.spectrum, _by_line(measured.comparison)
    return [
        {
            "frequency_hz": float(hz),
            **{f"{name}_m_s2": float(getattr(spectrum, name)[i]) for name in _CURVES},
            "pseudo_velocity_m_s": float(spectrum.pseudo_velocity_m_s[i]),
            **({} if measured.comparison is None else held.get(float(hz), {})),
        }
        for i, hz in enumerate(spectrum.frequency_hz)
    ]


def write_spectrum(measured: MeasuredSpectrum, path: Path) -> None:
    """The table as CSV, numbers in full; `read_target` reads it."""
    columns = ["frequency_hz", *(f"{name}_m_s2" for name in _CURVES), "pseudo_velocity_m_s"]
    with atomic_file(path) as partial, partial.open("w", newline="", encoding="utf-8") as file:
        writer = GuardedCsv(file, line_end="\n")
        writer.write_row(columns)
        writer.write_rows([row[column] for column in columns] for row in rows_of(measured))


def _by_line(comparison: SpectrumComparison | None) -> dict[float, dict[str, float]]:
    if comparison is None:
        return {}
    columns = zip(
        comparison.frequency_hz,
        comparison.target.level_m_s2,
        comparison.error_db,
        comparison.margin_db,
        strict=True,
    )
    return {
        float(hz): {
            "level_m_s2": float(level),
            "error_db": float(error),
            "margin_db": float(margin),
        }
        for hz, level, error, margin in columns
    }


def _finding_json(finding: Finding) -> dict[str, Any]:
    """As `ingest` tells a finding; the evidence has its units in its keys."""
    return {name: getattr(finding, name) for name in ("check", "severity", "message", "evidence")}


def _comparison_json(comparison: SpectrumComparison) -> dict[str, Any]:
    return {
        "met": bool(comparison.met),
        "sentence": comparison.sentence(),
        "rule": {"name": comparison.target.rule.name, "clause": comparison.target.rule.clause},
        "rules": [
            {
                "rule": kept.name,
                "lines": int(kept.lines),
                "of": kept.of,
                "required": kept.required,
                "met": bool(kept.met),
            }
            for kept in comparison.rules
        ],
        "within": bool(comparison.within),
        "share_within": float(comparison.share_within),
        "share_above": float(comparison.share_above),
        "worst_margin_db": float(comparison.worst_margin_db),
        "worst_frequency_hz": float(comparison.worst_frequency_hz),
        "frequency_hz": comparison.frequency_hz.tolist(),
        **{
            name: getattr(comparison.target, name).tolist()
            for name in ("level_m_s2", "upper_db", "lower_db")
        },
        "error_db": comparison.error_db.tolist(),
        "margin_db": comparison.margin_db.tolist(),
    }


def spectrum_figure(measured: MeasuredSpectrum) -> PlotGrid:
    """Spectrum on logarithmic axes above, record below."""
    title = f"Shock response spectrum of {measured.acceleration.channel}"
    return PlotGrid(title, ((spectrum_plot(measured),), (_record_plot(measured.acceleration),)))


def spectrum_plot(measured: MeasuredSpectrum) -> Plot:
    """Positive, negative and maximax spectrum; lines outside of the target's tolerance are
    marked."""
    spectrum, held = measured.spectrum, measured.comparison
    shown, hz = display_of("acceleration_m_s2"), spectrum.frequency_hz
    series: list[PlotSeries] = [] if held is None else _target_series(held.target)
    series += [
        LineSeries(hz, shown.scale * spectrum.maximax, name="maximax", role=ColourRole.INK),
        LineSeries(
            *(hz, shown.scale * spectrum.positive, "dash"),
            name="positive",
            role=ColourRole.MEASURED,
        ),
        LineSeries(
            *(hz, shown.scale * spectrum.negative, "dot"), name="negative", role=ColourRole.MODEL
        ),
    ]
    if held is not None and not held.within:
        out = held.margin_db < 0
        level = shown.scale * held.target.level_m_s2[out] * 10 ** (held.error_db[out] / 20)
        series.append(
            PointSeries(
                *(held.frequency_hz[out], level),
                filled=False,
                name="out of tolerance",
                role=ColourRole.MODEL,
            )
        )
    quantity = f"absolute acceleration, Q = {spectrum.q:.3g}"
    return Plot(
        "spectrum",
        PlotAxis("natural frequency", "Hz", scale="log"),
        PlotAxis(quantity, shown.unit, scale="log"),
        tuple(series),
        height=480,
    )


def _target_series(target: Target) -> list[PlotSeries]:
    """Level and tolerance; a side that is free has no edge."""
    level = display_of("acceleration_m_s2").scale * target.level_m_s2
    upper, lower = (level * 10 ** (db / 20) for db in (target.upper_db, -target.lower_db))
    both = np.isfinite(upper) & (lower > 0)
    edges = [np.where(both, edge, np.nan) for edge in (lower, upper)]
    line, role = target.frequency_hz, ColourRole.REFERENCE
    return [
        BandSeries(line, *edges, name="tolerance", role=ColourRole.TOLERANCE),
        LineSeries(line, level, name="target", role=role),
        *(
            LineSeries(line, edge, "dash", 1.0, detail=f"{side} limit", role=role)
            for side, edge in (("upper", upper), ("lower", lower))
        ),
    ]


def _record_plot(acceleration: Acceleration) -> Plot:
    """Acceleration against time."""
    values = acceleration.values_m_s2
    time = acceleration.start_s + np.arange(values.size) / acceleration.sampling_rate_hz
    shown, shown_time = display_of("acceleration_m_s2"), display_of("time_s")
    x = PlotAxis(shown_time.label, shown_time.unit)
    line = LineSeries(
        time * shown_time.scale,
        values * shown.scale,
        width=1,
        detail=acceleration.channel,
        role=ColourRole.MEASURED,
    )
    return Plot("record", x, PlotAxis(acceleration.channel, shown.unit), (line,), height=240)
