"""Fig. 4.9: a force model and a contact-time model, put together to a pulse in time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from pyroshock.app.figures.matplotlib_renderer import new_figure
from pyroshock.training.evaluation.metrics import BAND, reconstruct
from pyroshock.training.registry.evaluate import Evaluation

from .picture import MEASURED, MODEL, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def median_pulse(judged: Evaluation, model: str) -> int:
    """Row of the held-out pulse whose NRMSE is the median one: neither the best nor the worst."""
    order = np.argsort(judged.errors[model].force_nrmse, kind="stable")
    return int(order[len(order) // 2])


def draw(judged: Evaluation, model: str | None = None) -> Figure:
    """The two predictions, and the spline through the 20 points over the predicted time, beside
    what was measured."""
    name = model or min(
        judged.errors, key=lambda each: float(judged.errors[each].force_nrmse.mean())
    )
    row, prediction = median_pulse(judged, name), judged.predictions[name]
    figure = new_figure(11.0, 3.6)
    points, duration, pulse = figure.subplots(1, 3, width_ratios=(3, 1.4, 3))
    phase = np.arange(1, prediction.force_n.shape[1] + 1)
    points.plot(phase, prediction.force_n[row], "o", color=MODEL, ms=4)
    points.set(
        xlabel="point of the contact", ylabel="predicted force (N)", title="force model: 20 points"
    )
    _draw_time(duration, judged, name, row)
    _draw_pulse(pulse, judged, name, row)
    figure.suptitle(f"{name}, held-out hit of median NRMSE; virtual campaign", fontsize=9)
    return figure


def _draw_time(axes: Any, judged: Evaluation, name: str, row: int) -> None:
    prediction = judged.predictions[name]
    wide = prediction.contact_time_spread_s
    axes.bar([0], judged.pulses.contact_time_s[row] * 1e3, color=MEASURED, width=0.5)
    error = None if wide is None else BAND * wide[row] * 1e3
    axes.bar(
        [1], prediction.contact_time_s[row] * 1e3, yerr=error, color=MODEL, capsize=4, width=0.5
    )
    axes.set_xticks([0, 1], ["measured", "predicted"])
    axes.set(ylabel="contact time (ms)", title="time model")


def _draw_pulse(axes: Any, judged: Evaluation, name: str, row: int) -> None:
    prediction = judged.predictions[name]
    fine = reconstruct(prediction.force_n[row : row + 1])[0]
    predicted_ms = np.linspace(0, prediction.contact_time_s[row] * 1e3, fine.size)
    measured = reconstruct(judged.pulses.force_n[row : row + 1])[0]
    measured_ms = np.linspace(0, judged.pulses.contact_time_s[row] * 1e3, measured.size)
    axes.plot(measured_ms, measured, color=MEASURED, label="measured")
    axes.plot(predicted_ms, fine, color=MODEL, label="spline over the predicted time")
    axes.plot(predicted_ms[:: fine.size - 1], fine[:: fine.size - 1], "|", color=QUIET)
    axes.set(xlabel="time (ms)", ylabel="force (N)", title="reconstructed pulse")
    axes.legend(frameon=False, fontsize=8)
