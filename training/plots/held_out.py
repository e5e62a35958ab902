"""What models predict of held-out pulses, beside what was measured.

An error by test for several models (Fig. 5.4, cost, and Fig. 5.5, impulse, of the thesis); errors
of many models over all tests (Fig. 4.10); whether intervals hold what they promise; pulses with
their 90 % band.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..evaluation.coverage import LEVELS, coverage, standardised
from ..evaluation.metrics import BAND, PulseErrors, pulse_errors, reconstruct
from ..models.base import ContactPrediction
from .style import (
    COLOURS,
    LABELS,
    MARKERS,
    PulseRuns,
    new_figure,
    number_tests,
    runs_of,
    tip_colours,
    tip_strip,
    wide_range,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def by_test(pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "cost") -> Figure:
    """A panel a model, best first, on one scale; a point a test, the mean of its held-out pulses; a
    line at the mean.

    `errors` by name of model, of the held-out `pulses` row by row. 180 tests of five models in one
    panel, as the thesis draws them, hide each other; the tips' colours show what its zigzag lines
    were to show.
    """
    values = {name: getattr(model, metric) for name, model in errors.items()}
    names = sorted(values, key=lambda name: float(values[name].mean()))
    runs = runs_of(pulses)
    figure = new_figure(10, 1.3 + 1.35 * len(names))
    panels = figure.subplots(len(names), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, name in zip(panels, names, strict=True):
        _by_test_panel(axes, runs, runs.mean(values[name]), name, float(values[name].mean()))
    if wide_range(np.concatenate([runs.mean(model) for model in values.values()])):
        panels[0].set_yscale("log")
    else:
        panels[0].set_ylim(bottom=0)
    number_tests(panels[-1], runs)
    figure.supylabel(LABELS[metric], fontsize=10)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside upper center", ncols=len(labels), frameon=False, markerscale=2
    )
    return figure


def _by_test_panel(axes: Axes, runs: PulseRuns, values: Floats, name: str, mean: float) -> None:
    places = np.arange(len(runs))
    for tip, colour in tip_colours(runs.tip).items():
        here = runs.tip == tip
        axes.plot(places[here], values[here], "o", color=colour, ms=2.6, label=tip)
    axes.axhline(mean, color="black", lw=0.8)
    axes.set_title(f"{name}: {mean:.3g}", fontsize=9, loc="left", pad=3)
    axes.grid(axis="y", lw=0.4, alpha=0.5)


def heat_map(
    pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "force_nrmse"
) -> Figure:
    """Models down, tests across in run order, best model first; the colour is logarithmic, as
    errors spread so wide.

    `errors` by name of model, of the held-out `pulses` row by row. Figures at the right are means
    over pulses.
    """
    from matplotlib.colors import LogNorm

    values = {name: getattr(model, metric) for name, model in errors.items()}
    names = sorted(values, key=lambda name: float(values[name].mean()))
    runs = runs_of(pulses)
    table = np.stack([runs.mean(values[name]) for name in names])
    shown = table[table > 0]
    low, high = np.quantile(shown, [0.01, 0.99]) if shown.size else (0.1, 1.0)
    figure = new_figure(11, 2.3 + 0.28 * len(names))
    upper, strip = figure.subplots(2, 1, sharex=True, height_ratios=[len(names), 0.7])
    image = upper.imshow(
        np.maximum(table, low),
        aspect="auto",
        cmap="viridis",
        norm=LogNorm(low, max(high, low * 1.01)),
        interpolation="nearest",
        extent=(-0.5, len(runs) - 0.5, len(names) - 0.5, -0.5),
    )
    upper.set_yticks(range(len(names)), names)
    upper.tick_params(axis="x", length=0, labelbottom=False)
    means = upper.secondary_yaxis("right")
    means.set_yticks(range(len(names)), [f"{values[name].mean():.3g}" for name in names])
    means.tick_params(length=0)
    figure.colorbar(image, ax=upper, label=LABELS[metric], pad=0.02, extend="both")
    tip_strip(figure, strip, runs)
    return figure


#: What the 90 % band should cover on held-out configurations.
WANTED = (0.87, 0.93)


def coverage_figure(pulses: PulseTable, predictions: Mapping[str, ContactPrediction]) -> Figure:
    """Promised against found coverage of central normal intervals, force points and contact time;
    one line a model.

    Models without spread are left out. `predictions` are of the held-out `pulses` row by row.
    """
    figure = new_figure(10, 4.8)
    for axes, name in zip(figure.subplots(1, 2), ("force", "contact time"), strict=True):
        _frame(axes, name)
        drawn = 0
        for model, prediction in predictions.items():
            score = standardised(pulses, prediction, name)
            if score is not None:
                style = {
                    "color": COLOURS[drawn % len(COLOURS)],
                    "marker": MARKERS[drawn % len(MARKERS)],
                }
                shares = coverage(score)
                axes.plot(
                    LEVELS,
                    shares,
                    lw=1,
                    ms=4,
                    label=f"{model} ({shares[LEVELS == 0.9][0]:.3f})",
                    **style,
                )
                drawn += 1
        if drawn:
            axes.legend(frameon=False, loc="upper left", title="at 0.90")
    return figure


def _frame(axes: Axes, name: str) -> None:
    axes.plot([0, 1], [0, 1], color="black", lw=0.8)
    axes.plot([0.9, 0.9], WANTED, color="black", lw=5, alpha=0.3, solid_capstyle="butt")
    axes.set_title(name, fontsize=10)
    axes.set_xlabel("promised coverage")
    axes.set_ylabel("found coverage")
    axes.set_xlim(0, 1)
    axes.set_ylim(0, 1)
    axes.set_aspect("equal")
    axes.grid(lw=0.4, alpha=0.5)


#: Of the pulses of a tip, by their NRMSE: the best, two in between and the worst, so that no
#: picture flatters.
SHARES = (0.0, 0.5, 0.9, 1.0)
_NAMES = ("best", "median", "90th percentile", "worst")


def pulse_grid(pulses: PulseTable, prediction: ContactPrediction) -> Figure:
    """A row a tip material, a column a rank by NRMSE. `prediction` is of the held-out `pulses` row
    by row."""
    nrmse = pulse_errors(pulses, prediction).force_nrmse
    tips = np.unique(pulses.tip_material)
    figure = new_figure(12, 2.6 * len(tips) + 0.6)
    grid = figure.subplots(len(tips), len(SHARES), squeeze=False)
    for i, tip in enumerate(tips):
        rows = np.flatnonzero(pulses.tip_material == tip)
        for j, row in enumerate(_ranked(rows, nrmse)):
            _draw(grid[i, j], pulses, prediction, int(row))
            which = f"{tip}, run {pulses.run[row]}, repetition {pulses.repetition[row]}"
            grid[i, j].set_title(f"{which}\nNRMSE {nrmse[row]:.3f} ({_NAMES[j]})", fontsize=8)
        grid[i, 0].set_ylabel("force (kN)")
    for axes in grid[-1]:
        axes.set_xlabel("time (ms)")
    handles, labels = grid[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _ranked(rows: NDArray[np.intp], nrmse: Floats) -> NDArray[np.intp]:
    order = rows[np.argsort(nrmse[rows], kind="stable")]
    return order[np.round(np.array(SHARES) * (len(order) - 1)).astype(np.intp)]


def _draw(axes: Axes, pulses: PulseTable, prediction: ContactPrediction, row: int) -> None:
    """One pulse: dots measured, line predicted (kN over ms), shades the band of the force and of
    the end of contact."""
    points, duration = pulses.force_n[row] * 1e-3, pulses.contact_time_s[row] * 1e3
    fine = reconstruct(prediction.force_n[row : row + 1], 200)[0] * 1e-3
    end = prediction.contact_time_s[row] * 1e3
    axes.plot(
        np.linspace(0, duration, points.size),
        points,
        "o",
        color="black",
        ms=2.5,
        label="measured",
        zorder=3,
    )
    axes.plot(np.linspace(0, end, fine.size), fine, color=COLOURS[0], lw=1.3, label="predicted")
    if prediction.force_spread_n is not None:
        wide = BAND * prediction.force_spread_n[row] * 1e-3
        mean, at = prediction.force_n[row] * 1e-3, np.linspace(0, end, points.size)
        axes.fill_between(
            at,
            mean - wide,
            mean + wide,
            color=COLOURS[0],
            alpha=0.2,
            lw=0,
            label="90 % band of force",
        )
    if prediction.contact_time_spread_s is not None:
        late = BAND * float(prediction.contact_time_spread_s[row]) * 1e3
        axes.axvspan(
            end - late,
            end + late,
            color=COLOURS[1],
            alpha=0.2,
            lw=0,
            label="90 % band of contact time",
        )
    axes.axhline(0, color="black", lw=0.4)
