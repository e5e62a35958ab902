"""Figures of predictions that were made before the shots."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.quantities import display_of
from ...common.run_forecasts import ComparedShot, quantity_label
from ...figures.figure import ColourRole, Plot, PlotAxis, PointSeries, as_floats, category


def band_figure(quantity: str, shots: Sequence[ComparedShot]) -> Plot:
    """Each shot in the order of the runs: its 90 % band with the median, and the measured value,
    which has another colour where it lies outside."""
    compared = [
        (shot, comparison)
        for shot in shots
        for comparison in shot.quantities
        if comparison.band.quantity == quantity
    ]
    shown = display_of(quantity)
    place = np.arange(1, len(compared) + 1, dtype=np.float64)
    names = tuple(f"run {shot.run}, repetition {shot.repetition}" for shot, _ in compared)
    bands = [comparison.band for _, comparison in compared]
    medians, lower, upper = (
        shown.scale * as_floats([getattr(band, end) for band in bands])
        for end in ("median", "lower", "upper")
    )
    measured = shown.scale * as_floats([comparison.measured for _, comparison in compared])
    inside = np.array([comparison.inside for _, comparison in compared], dtype=np.bool_)
    label = quantity_label(quantity)
    series = [
        PointSeries(
            place, medians, y_low=lower, y_high=upper, filled=False, labels=names,
            name="prediction with its 90 % band", role=ColourRole.INK,
        )
    ]  # fmt: skip
    for words, rows, role in (
        ("measured, in the band", inside, category(0)),
        ("measured, outside", ~inside, category(1)),
    ):
        if rows.any():
            series.append(
                PointSeries(
                    place[rows], measured[rows], name=words, role=role,
                    labels=tuple(name for name, chosen in zip(names, rows, strict=True) if chosen),
                )
            )  # fmt: skip
    return Plot(
        f"Predicted before and measured: {label}",
        PlotAxis("shot, in the order of the runs", "1", whole=True),
        PlotAxis(label, shown.unit or "1"),
        tuple(series),
    )
