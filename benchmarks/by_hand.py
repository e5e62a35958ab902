"""`python -m benchmarks.by_hand`: code of our own beside a library that does the same, as Markdown.

Times are of one core and of the same numbers: a way that gives others ends the run. Other
comparisons have pages of their own (docs/measurements/packages.md lists them). The exit code is 1
where a fit of the contact time is slower than with GPyTorch's likelihood, or ends at another loss.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pyDOE3
from pyroshock.doe.designs.two_level import fractional_factorial, smallest_generators
from pyroshock.doe.factors import DesignFactor
from pyroshock.doe.merit.quality import aliases
from pyroshock.doe.space import space_of
from pyroshock.training.estimators.contact_time import THESIS
from pyroshock.training.estimators.exact_process import (
    PRIOR,
    Process,
    ProcessInputs,
    inverse,
    leave_folds_out,
)
from pyroshock.training.gp.basis_process import BasisProcess
from pyroshock.training.gp.kernels import kernel_matrix
from pyroshock.training.gp.marginal_likelihood import (
    CholeskyMarginalLogLikelihood,
    KroneckerMarginalLogLikelihood,
    exact_likelihood,
)
from pyroshock.training.gp.maximise import exactly, maximise, one_core

from . import coregional
from .coregional import Floats, parameters, pulses
from .harness import Spread, processor_seconds, ratio, table_row, take_turns

FOLDS, SEARCHED, TRAINED = 5, 480, 1440
#: Saturated: 15 factors in 16 runs.
SATURATED = "a b c d ab ac ad bc bd cd abc abd acd bcd abcd"
#: Of the contact time's process: the thesis's, and the dearest that the search meets.
SETTINGS: dict[str, dict[str, Any]] = {
    "rbf, one lengthscale": dict(THESIS),
    "rbf, a lengthscale each": {**THESIS, "ard": True, "basis": "linear"},
    "matern52, a lengthscale each": {
        **THESIS,
        "kernel": "matern52",
        "ard": True,
        "basis": "linear",
    },
}


def left_out(rows: int = SEARCHED) -> dict[str, Callable[[], Floats]]:
    """Means of `rows` contact times, each fold predicted by the others."""
    x, outputs = pulses(rows)
    h, y = np.ones((rows, 1)), outputs[:, 9]
    process = Process("rbf", np.full(x.shape[1], 4.0), 1.0, 0.1)
    folds = [np.arange(rows) % FOLDS == fold for fold in range(FOLDS)]

    def by_folds(predicted: Callable[[Any], Floats]) -> Floats:
        means = np.empty(rows)
        for fold in folds:
            means[fold] = predicted(fold)
        return means

    def plain(fold: Any) -> Floats:
        from scipy.linalg import cho_solve

        weights = cho_solve((process.factor(x[~fold], h[~fold]), True), y[~fold])
        return process.between(x[fold], h[fold], x[~fold], h[~fold]) @ weights

    def gpytorch(fold: Any) -> Floats:
        import torch

        start = (process.kernel, process.lengthscales, process.signal, process.noise)
        model = BasisProcess(x[~fold], h[~fold], y[~fold], *start, 0.01, PRIOR)
        model.eval()
        with torch.no_grad(), exactly():
            return np.asarray(model(torch.tensor(np.hstack([x[fold], h[fold]]))).mean.numpy())

    return {
        "pyroshock, one inverse": lambda: leave_folds_out(inverse(process.factor(x, h)), y, folds),
        "NumPy, a factor for each fold": partial(by_folds, plain),
        "GPyTorch, a model for each fold": partial(by_folds, gpytorch),
    }


def likelihoods(rows: int = TRAINED) -> dict[str, Callable[[], float]]:
    """Loss and gradient of the coregional process at the benchmark's parameters, without and with
    PyTorch."""
    (x, y), at = pulses(rows), parameters()

    def numpy_alone() -> float:
        scaled = x / at.lengthscales
        return exact_likelihood(
            kernel_matrix("rbf", scaled, scaled), y, at.b, np.diag(at.noise)
        ).value

    return {
        "NumPy, no gradient of the kernel": numpy_alone,
        "GPyTorch's model": coregional.ours(rows),
    }


def one_output(kernel: str, rows: int) -> dict[str, Callable[[], None]]:
    """Loss and gradient of a process of one output, by the likelihood of several and by that of
    one."""
    from pyroshock.training.gp.multitask import CoregionalModel, named_kernel

    x, outputs = pulses(rows)
    several = CoregionalModel(x, outputs[:, [9]], named_kernel(kernel, x.shape[1]), 1)
    one = BasisProcess(
        x,
        np.empty((rows, 0)),
        outputs[:, 9],
        kernel,
        np.full(x.shape[1], 3.0),
        1.0,
        0.3,
        0.01,
        PRIOR,
    )

    def evaluated(objective: Any) -> None:
        model = objective.model
        model.zero_grad()
        with exactly():
            objective(model(*model.train_inputs), model.train_targets).backward()

    return {
        "Kronecker": partial(
            evaluated, KroneckerMarginalLogLikelihood(several.likelihood, several)
        ),
        "Cholesky": partial(evaluated, CholeskyMarginalLogLikelihood(one.likelihood, one)),
    }


def kernels(rows: int = TRAINED) -> dict[str, Callable[[], Floats]]:
    """Derivatives of a sum of covariances by the lengthscales, one for each of 13 predictors."""
    import torch
    from gpytorch.kernels import RBFKernel
    from pyroshock.training.gp.kernel_description import SquaredExponential

    x = torch.tensor(pulses(rows)[0])

    def slopes(kernel: Any) -> Floats:
        kernel.zero_grad()
        kernel(x).to_dense().sum().backward()
        return np.asarray(kernel.raw_lengthscale.grad.numpy()).copy()

    types = {"SquaredExponential": SquaredExponential, "GPyTorch's RBFKernel": RBFKernel}
    return {
        name: partial(slopes, kind(ard_num_dims=x.shape[1]).double())
        for name, kind in types.items()
    }


def contact_time(settings: dict[str, Any], rows: int = TRAINED) -> dict[str, Callable[[], float]]:
    """The contact time's process trained from the start of the search to its end, by ours and by
    GPyTorch's likelihood, which is differentiated automatically; the last loss."""
    from gpytorch.mlls import ExactMarginalLogLikelihood

    x, outputs = pulses(rows)
    view = ProcessInputs(x, 1e-3 * np.exp(0.1 * outputs[:, [9]]), settings)  # any positive output
    start, floor, (z, h) = view.start(), settings["noise"] / 10, view.inputs(x)
    lengthscales = start.lengthscales if settings["ard"] else start.lengthscales[:1]

    def train(likelihood: Any) -> float:
        noise = max(start.noise, floor), floor
        model = BasisProcess(
            z, h, view.output, start.kernel, lengthscales, start.signal, *noise, PRIOR
        )
        return float(
            maximise(
                likelihood(model.likelihood, model), 30, change=2.2e-9, gradient=1e-5
            ).losses.min()
        )

    kinds = {"pyroshock": CholeskyMarginalLogLikelihood, "GPyTorch": ExactMarginalLogLikelihood}
    return {name: partial(train, kind) for name, kind in kinds.items()}


def alias_tables(generators: str = SATURATED) -> dict[str, Callable[[], object]]:
    """What a two-level design cannot tell apart; pyDOE3 lists interactions of all orders."""
    names = [f"factor_{index}" for index in range(len(generators.split()))]
    factors = [DesignFactor(name, name, ("low", "high"), None, True, 0) for name in names]
    space = space_of("two levels", "hammer", factors)
    treatments = fractional_factorial(space, generators=generators).treatments
    coded = pyDOE3.fracfact(generators)
    return {
        "pyroshock, up to two factors": lambda: aliases(space, treatments),
        "pyDOE3": lambda: pyDOE3.fracfact_aliasing(coded),
    }


def fewest_runs() -> str:
    """Runs of the smallest two-level design of a resolution, ours and pyDOE3's."""
    cells = []
    for factors, resolution in ((5, 5), (7, 3), (8, 4)):
        ours = pyDOE3.fracfact(smallest_generators(factors, resolution))
        try:
            theirs = str(len(pyDOE3.fracfact_by_res(factors, resolution)))
        except ValueError:
            theirs = "none"
        cells.append(
            f"{factors} factors of resolution {resolution}: {len(ours)} runs, pyDOE3 {theirs}"
        )
    return "; ".join(cells)


def compare(
    what: str,
    functions: Mapping[str, Callable[[], Any]],
    repeats: int,
    difference: float | None = None,
) -> bool:
    """Prints a row for each way; whether the first is the quickest. Raises `ValueError` where
    answers are more than `difference` from the first one's."""
    first, *_ = answers = [function() for function in functions.values()]
    for name, answer in zip(functions, answers, strict=True):
        if difference is not None and not np.max(np.abs(np.subtract(answer, first))) <= difference:
            raise ValueError(f"{what}: {name} gives other numbers")
    seconds = take_turns(functions, repeats, processor_seconds, warm=False)
    ours = next(iter(seconds.values()))
    ratios = [ratio(taken, ours).median for taken in seconds.values()]
    for (name, taken), times in zip(seconds.items(), ratios, strict=True):
        print(table_row(what, name, Spread.of(taken).text(" ms", 1e3), f"{times:.3g}"), flush=True)
    return min(ratios) >= 1


def main() -> int:
    print("| what | by | median (least to most) | times the first |\n| --- | --- | --- | ---: |")
    with one_core():
        compare(f"{FOLDS} folds of {SEARCHED} pulses left out", left_out(), 9, 1e-8)
        compare(f"likelihood and gradient, {TRAINED:,} pulses x 20", likelihoods(), 9, 1e-4)
        for kernel, rows in (("rbf", SEARCHED), ("rbf", TRAINED), ("matern52", SEARCHED)):
            compare(
                f"likelihood of one output, {rows:,} pulses, {kernel}", one_output(kernel, rows), 9
            )
        compare(f"kernel and gradient, {TRAINED:,} pulses x 13", kernels(), 9, 1e-6)
        fits = [
            compare(f"contact time, {TRAINED:,} pulses, {s}", contact_time(SETTINGS[s]), 3, 1e-5)
            for s in SETTINGS
        ]
        compare("aliases of 15 factors in 16 runs", alias_tables(), 2)
    print(f"\n{fewest_runs()}")
    return 0 if all(fits) else 1


if __name__ == "__main__":
    sys.exit(main())
