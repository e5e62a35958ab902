"""The figures that the registry keeps with a model and with a session of training."""

from __future__ import annotations

from ...dataset.table import PulseTable
from ..evaluation.metrics import PulseErrors
from ..models.base import ContactPrediction
from ..registry.evaluate import Evaluation
from .held_out import by_test, coverage_figure, heat_map, pulse_grid
from .style import png

#: Figures by test become illegible beyond these: the best ones, beside the thesis's analytic
#: pulses.
_BEST = 3
_ANALYTIC = ("hann", "reed", "hunter")


def training_figures(
    model: str, held_out: PulseTable, prediction: ContactPrediction, errors: PulseErrors
) -> dict[str, bytes]:
    """PNG files by name, of one model's predictions of held-out pulses."""
    named = {model: errors}
    return {
        "pulses.png": png(pulse_grid(held_out, prediction)),
        "nrmse_by_test.png": png(heat_map(held_out, named)),
        "cost_by_test.png": png(by_test(held_out, named, "cost")),
        "impulse_error_by_test.png": png(by_test(held_out, named, "impulse_error")),
    }


def summary_figures(judged: Evaluation, split: str) -> dict[str, bytes]:
    """PNG files by name, of all models of a split: the thesis's Fig. 4.10, 5.4 and 5.5."""
    errors = {
        label.partition("@")[0]: model_errors for label, model_errors in judged.errors.items()
    }
    predictions = {
        label.partition("@")[0]: prediction for label, prediction in judged.predictions.items()
    }
    ranked = sorted(errors, key=lambda name: float(errors[name].cost.mean()))
    shown = list(dict.fromkeys([*ranked[:_BEST], *(name for name in _ANALYTIC if name in errors)]))
    some = {name: errors[name] for name in shown}
    with_spread = {
        name: predictions[name] for name in shown if predictions[name].force_spread_n is not None
    }
    end = f"{split.replace('/', '_')}.png"
    figures = {
        f"nrmse_{end}": png(heat_map(judged.pulses, errors)),
        f"cost_by_test_{end}": png(by_test(judged.pulses, some, "cost")),
        f"impulse_error_by_test_{end}": png(by_test(judged.pulses, some, "impulse_error")),
    }
    if with_spread:
        figures[f"coverage_{end}"] = png(coverage_figure(judged.pulses, with_spread))
    return figures
