"""The figures that the registry keeps beside each model: held-out pulses with their predictions,
and errors by test (figs. 4.10, 5.4 and 5.5 of the thesis)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ....array_types import Floats
from ....dataset.table import PulseTable
from ....training.evaluation.coverage import LEVELS, coverage, standardised
from ....training.evaluation.metrics import BAND, PulseErrors, pulse_errors, reconstruct
from ....training.evaluation.pulse_runs import PulseRuns, runs_of
from ....training.fitting.fitting import TrainingFigures
from ....training.models.base import ContactPrediction
from ....training.registry.evaluate import Evaluation
from ...figures.figure import (
    DIMENSIONLESS,
    BandSeries,
    ColourRole,
    HeatMap,
    LineSeries,
    Plot,
    PlotAxis,
    PlotGrid,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    ReferenceRegion,
    Scale,
    as_floats,
    category,
    equal_line,
)
from ...figures.matplotlib_renderer import png
from .charts import METRIC_NAMES

#: Units of metrics; the others are relative.
_UNITS = {"force_rmse_n": "N", "force_nrmse": "share of range", "cost": "eq. 5.4, of 1,000"}
#: Figures by test become illegible beyond these: the best ones, beside the thesis's analytic
#: pulses.
_BEST = 3
_ANALYTIC = ("hann", "reed", "hunter")
#: What the 90 % band should cover on held-out configurations.
WANTED = (0.87, 0.93)
#: Of the pulses of a tip, by their NRMSE: the best, two in between and the worst, so that no
#: picture flatters.
_SHARES = (0.0, 0.5, 0.9, 1.0)
_NAMES = ("best", "median", "90th percentile", "worst")


class RegisteredFigures(TrainingFigures):
    """The figures as PNG files."""

    def of_model(
        self,
        model: str,
        held_out: PulseTable,
        prediction: ContactPrediction,
        errors: PulseErrors,
    ) -> dict[str, bytes]:
        named = {model: errors}
        return {
            "pulses.png": png(pulses_figure(held_out, prediction)),
            "nrmse_by_test.png": png(errors_figure(held_out, named)),
            "cost_by_test.png": png(by_test_figure(held_out, named, "cost")),
            "impulse_error_by_test.png": png(by_test_figure(held_out, named, "impulse_error")),
        }

    def of_split(self, judged: Evaluation, split: str) -> dict[str, bytes]:
        errors = {
            label.partition("@")[0]: model_errors for label, model_errors in judged.errors.items()
        }
        predictions = {
            label.partition("@")[0]: prediction for label, prediction in judged.predictions.items()
        }
        ranked = sorted(errors, key=lambda name: float(errors[name].cost.mean()))
        analytic = [name for name in _ANALYTIC if name in errors]
        shown = list(dict.fromkeys([*ranked[:_BEST], *analytic]))
        some = {name: errors[name] for name in shown}
        with_spread = {
            name: predictions[name]
            for name in shown
            if predictions[name].force_spread_n is not None
        }
        end = f"{split.replace('/', '_')}.png"
        figures = {
            f"nrmse_{end}": png(errors_figure(judged.pulses, errors)),
            f"cost_by_test_{end}": png(by_test_figure(judged.pulses, some, "cost")),
            f"impulse_error_by_test_{end}": png(
                by_test_figure(judged.pulses, some, "impulse_error")
            ),
        }
        if with_spread:
            figures[f"coverage_{end}"] = png(intervals_figure(judged.pulses, with_spread))
        return figures


def _ranked(errors: Mapping[str, PulseErrors], metric: str) -> dict[str, Floats]:
    """Values of a metric by the name of the model, the best first."""
    values = {name: np.asarray(getattr(model, metric)) for name, model in errors.items()}
    return dict(sorted(values.items(), key=lambda pair: float(pair[1].mean())))


def by_test_figure(
    pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "cost"
) -> PlotGrid:
    """A plot a model, best first, on one scale; a point a test, the mean of its held-out pulses; a
    line at the mean.

    `errors` by name of model, of the held-out `pulses` row by row. 180 tests of five models in one
    plot, as the thesis draws them, hide each other; the tips' colours show what its zigzag lines
    were to show.
    """
    values, runs = _ranked(errors, metric), runs_of(pulses)
    means = np.concatenate([runs.mean(of_model) for of_model in values.values()])
    scale: Scale = "log" if _spans_decades(means) else "linear"
    axis = PlotAxis("error", _UNITS.get(metric, "relative"), scale, from_zero=True)
    rows = tuple(
        (_by_test_plot(runs, runs.mean(of_model), name, float(of_model.mean()), axis),)
        for name, of_model in values.items()
    )
    return PlotGrid(f"{METRIC_NAMES[metric]} by test", rows, share_x=True, share_y=True)


def _spans_decades(values: Floats) -> bool:
    """Whether an axis of these (positive) values should be logarithmic."""
    positive = values[values > 0]
    return bool(positive.size and np.quantile(positive, 0.98) > 30 * np.quantile(positive, 0.02))


def _by_test_plot(runs: PulseRuns, values: Floats, name: str, mean: float, axis: PlotAxis) -> Plot:
    places = np.arange(len(runs), dtype=np.float64)
    series = tuple(
        PointSeries(
            places[runs.tip == tip],
            values[runs.tip == tip],
            size=4,
            labels=tuple(f"run {label}" for label in runs.label[runs.tip == tip]),
            name=str(tip),
            role=category(i),
        )
        for i, tip in enumerate(np.unique(runs.tip))
    )
    line = ReferenceLine("y", mean, dash="solid") if mean > 0 else None
    lines = () if line is None else (line,)
    return Plot(f"{name}: {mean:.3g}", _tests(), axis, series, lines, height=180)


def _tests() -> PlotAxis:
    return PlotAxis("test, in run order", DIMENSIONLESS, whole=True)


def errors_figure(
    pulses: PulseTable, errors: Mapping[str, PulseErrors], metric: str = "force_nrmse"
) -> PlotGrid:
    """Models down, tests across in run order, best model first; the colour is logarithmic, as
    errors spread so wide. Below it, the tip of each test.

    `errors` by name of model, of the held-out `pulses` row by row. Figures beside the names are
    means over pulses.
    """
    values, runs = _ranked(errors, metric), runs_of(pulses)
    table = np.stack([runs.mean(of_model) for of_model in values.values()])
    shown = table[table > 0]
    low, high = np.quantile(shown, [0.01, 0.99]) if shown.size else (0.1, 1.0)
    ends = float(low), float(max(high, low * 1.01))
    name, unit = METRIC_NAMES[metric], _UNITS.get(metric, "relative")
    colour = PlotAxis(name, unit, scale="log", limits=ends)
    models = tuple(f"{model} ({of_model.mean():.3g})" for model, of_model in values.items())
    upper = Plot(
        f"{name} by test",
        _tests(),
        PlotAxis("", categories=models, reversed=True),
        (HeatMap(np.maximum(table, low), colour),),
        height=130 + 28 * len(models),
    )
    places = np.arange(len(runs), dtype=np.float64)
    tips = tuple(str(tip) for tip in np.unique(runs.tip))
    strips = tuple(
        PointSeries(
            places[runs.tip == tip],
            np.full(int((runs.tip == tip).sum()), float(i)),
            size=4,
            name=tip,
            role=category(i),
        )
        for i, tip in enumerate(tips)
    )
    lower = Plot(
        "tips",
        _tests(),
        PlotAxis("tip of the test", categories=tips, reversed=True),
        strips,
        height=110 + 18 * len(tips),
    )
    return PlotGrid(f"{name} of {len(models)} models", ((upper,), (lower,)), share_x=True)


def intervals_figure(pulses: PulseTable, predictions: Mapping[str, ContactPrediction]) -> PlotGrid:
    """Promised against found coverage of central normal intervals, force points and contact time;
    one line a model.

    Models without spread are left out. `predictions` are of the held-out `pulses` row by row.
    """
    row = tuple(_intervals_plot(pulses, predictions, name) for name in ("force", "contact time"))
    return PlotGrid("Coverage of the intervals", (row,))


def _intervals_plot(
    pulses: PulseTable, predictions: Mapping[str, ContactPrediction], name: str
) -> Plot:
    series: list[PlotSeries] = [equal_line("", as_floats([0.0, 1.0]))]
    for model, prediction in predictions.items():
        score = standardised(pulses, prediction, name)
        if score is not None:
            shares = coverage(score)
            words = f"{model} ({shares[LEVELS == 0.9][0]:.3f} at 0.90)"
            role = category(len(series) - 1)
            series.append(LineSeries(LEVELS, shares, marks=True, name=words, role=role))
    x, y = (
        PlotAxis(f"{word} coverage", DIMENSIONLESS, limits=(0.0, 1.0))
        for word in ("promised", "found")
    )
    wanted = ReferenceRegion("y", *WANTED, "wanted at 0.90", role=ColourRole.TOLERANCE)
    return Plot(name, x, y, tuple(series), regions=(wanted,), equal_scales=True)


def pulses_figure(pulses: PulseTable, prediction: ContactPrediction) -> PlotGrid:
    """Measured pulses and the predicted ones on top: a row a tip material, a column a rank by
    NRMSE. `prediction` is of the held-out `pulses` row by row."""
    nrmse = pulse_errors(pulses, prediction).force_nrmse
    grid = []
    for tip in np.unique(pulses.tip_material):
        rows = np.flatnonzero(pulses.tip_material == tip)
        plots = []
        for place, row in enumerate(_of_ranks(rows, nrmse)):
            words = f"{tip}, run {pulses.run[row]}, repetition {pulses.repetition[row]}"
            title = f"{words}\nNRMSE {nrmse[row]:.3f} ({_NAMES[place]})"
            plots.append(_pulse_plot(pulses, prediction, int(row), title))
        grid.append(tuple(plots))
    return PlotGrid("Held-out pulses", tuple(grid))


def worst_pulse_figures(
    pulses: PulseTable, prediction: ContactPrediction, most: int = 3
) -> list[Plot]:
    """The held-out pulses with the largest force error, measured and predicted, the worst first.
    `prediction` is of the held-out `pulses` row by row."""
    nrmse = pulse_errors(pulses, prediction).force_nrmse
    figures = []
    for place, row in enumerate(np.argsort(-nrmse)[:most], 1):
        words = f"{pulses.tip_material[row]}, run {pulses.run[row]}"
        words = f"{words}, repetition {pulses.repetition[row]}"
        title = f"{place}: {words}; force error {100 * nrmse[row]:.3g} %"
        figures.append(_pulse_plot(pulses, prediction, int(row), title))
    return figures


def _of_ranks(rows: NDArray[np.intp], nrmse: Floats) -> NDArray[np.intp]:
    order = rows[np.argsort(nrmse[rows], kind="stable")]
    return order[np.round(np.array(_SHARES) * (len(order) - 1)).astype(np.intp)]


def _pulse_plot(pulses: PulseTable, prediction: ContactPrediction, row: int, title: str) -> Plot:
    """One pulse: dots measured, line predicted (kN over ms), shades the band of the force and of
    the end of contact."""
    points, duration = pulses.force_n[row] * 1e-3, pulses.contact_time_s[row] * 1e3
    fine = reconstruct(prediction.force_n[row : row + 1], 200)[0] * 1e-3
    end = float(prediction.contact_time_s[row]) * 1e3
    series: list[PlotSeries] = []
    if prediction.force_spread_n is not None:
        wide = BAND * prediction.force_spread_n[row] * 1e-3
        mean, at = prediction.force_n[row] * 1e-3, np.linspace(0, end, points.size)
        name = "90 % band of force"
        series.append(BandSeries(at, mean - wide, mean + wide, name=name, role=ColourRole.MODEL))
    series.append(
        LineSeries(np.linspace(0, end, fine.size), fine, name="predicted", role=ColourRole.MODEL)
    )
    measured = np.linspace(0, duration, points.size)
    series.append(PointSeries(measured, points, size=4, name="measured", role=ColourRole.INK))
    regions = []
    if prediction.contact_time_spread_s is not None:
        late = BAND * float(prediction.contact_time_spread_s[row]) * 1e3
        if late > 0:
            name = "90 % band of contact time"
            regions.append(ReferenceRegion("x", end - late, end + late, name))
    axes = PlotAxis("time", "ms"), PlotAxis("force", "kN")
    return Plot(title, *axes, tuple(series), regions=tuple(regions), height=250)
