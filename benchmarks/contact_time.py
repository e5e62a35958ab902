"""`python -m benchmarks.contact_time [ROWS]`: the contact time's process, trained with two likelihoods, as Markdown.

The same rows, start, bounds and optimiser with GPyTorch's `ExactMarginalLogLikelihood`, differentiated automatically,
and with `CholeskyMarginalLogLikelihood`; in one process, in turn, on one core. Exit code 1 where ours is slower, or
ends at another likelihood.
"""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np
from gpytorch.mlls import ExactMarginalLogLikelihood
from pyroshock.training.estimators.contact_time import THESIS
from pyroshock.training.estimators.exact_process import PRIOR, ProcessInputs
from pyroshock.training.gp.basis_process import BasisProcess
from pyroshock.training.gp.marginal_likelihood import CholeskyMarginalLogLikelihood
from pyroshock.training.gp.maximise import maximise, one_core

from .apart import busy_seconds_of, in_turn
from .coregional_ways import Floats, pulses
from .measuring import Spread

ROWS, REPEATS, ITERATIONS = 1440, 3, 30
LIKELIHOODS = {"pyroshock": CholeskyMarginalLogLikelihood, "GPyTorch": ExactMarginalLogLikelihood}
#: The thesis's settings, and the dearest that the search meets.
SETTINGS: dict[str, dict[str, Any]] = {
    "rbf, one lengthscale": dict(THESIS),
    "rbf, a lengthscale each": {**THESIS, "ard": True, "basis": "linear"},
    "matern52, a lengthscale each": {**THESIS, "kernel": "matern52", "ard": True, "basis": "linear"},
}


def training(likelihood: Any, x: Floats, y: Floats, settings: dict[str, Any], losses: dict[Any, Floats]) -> None:
    """From the start of the search to its end; the losses of its evaluations are kept."""
    view = ProcessInputs(x, y, settings)
    start, floor = view.start(), settings["noise"] / 10
    z, h = view.inputs(x)
    lengthscales = start.lengthscales if settings["ard"] else start.lengthscales[:1]
    model = BasisProcess(
        z, h, view.output, start.kernel, lengthscales, start.signal, max(start.noise, floor), floor, PRIOR
    )
    objective = likelihood(model.likelihood, model)
    losses[likelihood] = maximise(objective, ITERATIONS, change=2.2e-9, gradient=1e-5).losses


def main(arguments: list[str]) -> int:
    rows = int(arguments[0]) if arguments else ROWS
    x, outputs = pulses(rows)
    time_s = 1e-3 * np.exp(0.1 * outputs[:, [9]])  # any positive output
    print(f"| {rows:,} rows | likelihood | s of one core, median (least to most) | evaluations | last loss |")
    print("| --- | --- | --- | ---: | ---: |")
    lost = False
    for what, settings in SETTINGS.items():
        losses: dict[Any, Floats] = {}
        with one_core():
            fits = {name: partial(training, kind, x, time_s, settings, losses) for name, kind in LIKELIHOODS.items()}
            taken = in_turn({name: partial(busy_seconds_of, fit) for name, fit in fits.items()}, REPEATS)
        for name, kind in LIKELIHOODS.items():
            seconds, evaluations, last = Spread.of(taken[name]).text(), len(losses[kind]), losses[kind][-1]
            print(f"| {what} | {name} | {seconds} | {evaluations} | {last:.9f} |", flush=True)
        ours, theirs = (Spread.of(taken[name]).median for name in LIKELIHOODS)
        ends = [losses[kind].min() for kind in LIKELIHOODS.values()]
        lost = lost or ours > theirs or abs(ends[0] - ends[1]) > 1e-5
    return int(lost)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
