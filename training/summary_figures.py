"""Figures over all models of a split: the thesis's Fig. 4.10, 5.4 and 5.5."""

from __future__ import annotations

from .evaluation import Judged
from .rendering import png

#: Figures by test become illegible beyond these: the best ones, beside the thesis's analytic pulses.
_BEST = 3
_ANALYTIC = ("hann", "reed", "hunter")


def summary_figures(judged: Judged, split: str) -> dict[str, bytes]:
    """PNG files by name."""
    from .plots.by_test import by_test
    from .plots.coverage import coverage_figure
    from .plots.heat_map import heat_map

    errors = {label.partition("@")[0]: model_errors for label, model_errors in judged.errors.items()}
    predictions = {label.partition("@")[0]: prediction for label, prediction in judged.predictions.items()}
    ranked = sorted(errors, key=lambda name: float(errors[name].cost.mean()))
    shown = list(dict.fromkeys([*ranked[:_BEST], *(name for name in _ANALYTIC if name in errors)]))
    some = {name: errors[name] for name in shown}
    with_spread = {name: predictions[name] for name in shown if predictions[name].force_spread_n is not None}
    end = f"{split.replace('/', '_')}.png"
    figures = {
        f"nrmse_{end}": png(heat_map(judged.pulses, errors)),
        f"cost_by_test_{end}": png(by_test(judged.pulses, some, "cost")),
        f"impulse_error_by_test_{end}": png(by_test(judged.pulses, some, "impulse_error")),
    }
    if with_spread:
        figures[f"coverage_{end}"] = png(coverage_figure(judged.pulses, with_spread))
    return figures
