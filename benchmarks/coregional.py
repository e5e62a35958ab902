"""`python -m benchmarks.coregional [--full]`: the coregional Gaussian process beside GPyTorch,
BoTorch and GPy.

Loss with gradient, and predictions with spread, of the same pulses and parameters: B = W W' +
diag(kappa), one noise for each output, a squared exponential with a lengthscale for each predictor,
no priors. Every way runs in a process of its own, in turn. Beside the peers stand what one would
write first, two eigendecompositions, and as the limit one Cholesky factorisation of a matrix of
pulses by pulses, which no exact likelihood does without. `--full` adds 720 pulses, where peers take
minutes and 12 GB.

`python -m benchmarks.coregional serve NAME` answers requests of the measurement; `training N`
trains on N pulses and prints what it took as a line of JSON.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, nullcontext, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyroshock.training.gp.kernels import NamedCovariance, kernel_matrix
from pyroshock.training.gp.maximise import one_core
from pyroshock.training.gp.posterior import posterior

from .harness import (
    ABSENT,
    Figure,
    Message,
    Program,
    ProgramError,
    answer_requests,
    beside,
    compared,
    interpreter_with,
    promised,
    report,
    take_turns,
)

Floats = NDArray[np.float64]
#: Gives the negative log likelihood, after computing its gradient.
Evaluate = Callable[[], float]
#: Gives means and standard deviations (asked x outputs) of new measurements, by a process that
#: knows its data.
Predict = Callable[[], tuple[Floats, Floats]]

THEME = "Coregional Gaussian process, 20 outputs, 13 predictors"
OUTPUTS, PREDICTORS, RANK = 20, 13, 6
OURS, PLAIN, GPYTORCH, BOTORCH, GPY = "ours", "eigendecomposition", "GPyTorch", "BoTorch", "GPy"
#: One Cholesky factorisation, or the products that a mean and its spread take.
CHOLESKY = "bound"
#: `Coregional` trains on one core, so that its sums are the same each time; peers may use all.
ONE_CORE = (OURS, CHOLESKY)
#: A peer, the module that it needs, and its model.
PEERS = {
    GPYTORCH: ("gpytorch", "MultitaskKernel"),
    BOTORCH: ("botorch", "KroneckerMultiTaskGP"),
    GPY: ("GPy", "coregionalized regression"),
}
#: Pulses, and how often each way is measured: a peer's likelihood of 180 takes seconds.
SIZES: Mapping[int, int] = {45: 7, 90: 5, 180: 2}
FULL_SIZES: Mapping[int, int] = {**SIZES, 720: 1}
LARGE, QUICK_REPEATS, ASKED, PREDICTED, LIMIT_BYTES = 1440, 9, 20, 10_000, 24 * 10**9
#: Promised: ours over GPyTorch's and BoTorch's from 180 pulses on; factorisations, seconds and
#: bytes at 1,440.
PEER_LIMIT, FACTORISATIONS, FIT_S, PREDICT_S, BYTES, FIT_BYTES = 1 / 200, 4.0, 60.0, 2.0, 1e9, 2e9


def pulses(n: int) -> tuple[Floats, Floats]:
    """n standardised pulses as a hammer's: 13 predictors, a continuous speed among 60 combinations
    of factors."""
    rng = np.random.default_rng(1)
    tips, layers = rng.normal(size=(3, 5)), rng.normal(size=(5, 4))
    tip, layer, held = (rng.integers(size, size=n) for size in (3, 5, 2))
    speed = rng.choice([0.6, 1.3], n) * np.exp(0.15 * rng.standard_normal(n))
    x = np.column_stack(
        [tips[tip], layers[layer], np.column_stack([speed, layer % 3, layer > 2, held])]
    )
    phase = np.linspace(0.0, 1.0, OUTPUTS)
    shape = (
        np.sin(np.pi * np.clip(phase, 0.02, 0.98)) ** (1 + 0.2 * tip + 0.1 * (layer > 2))[:, None]
    )
    y = shape * (speed * np.exp(0.03 * rng.standard_normal(n)))[
        :, None
    ] + 0.01 * rng.standard_normal((n, OUTPUTS))
    return (x - x.mean(axis=0)) / x.std(axis=0), (y - y.mean(axis=0)) / y.std(axis=0)


def new_pulses(count: int) -> Floats:
    """Predictors (count x 13) of others, at most 500."""
    return pulses(500)[0][:count]


@dataclass(frozen=True, eq=False)
class Parameters:
    """Lengthscales (13,), loadings W (20 x `RANK`), and the variances kappa and noise (20,)."""

    lengthscales: Floats
    loadings: Floats
    kappa: Floats
    noise: Floats

    @property
    def b(self) -> Floats:
        return np.asarray(self.loadings @ self.loadings.T + np.diag(self.kappa))


def parameters() -> Parameters:
    rng = np.random.default_rng(2)
    noise = 0.01 * np.exp(0.5 * rng.standard_normal(OUTPUTS))
    loadings = 0.4 * rng.standard_normal((OUTPUTS, RANK))
    return Parameters(rng.uniform(2.0, 6.0, PREDICTORS), loadings, np.full(OUTPUTS, 0.01), noise)


def plain(n: int) -> Evaluate:
    """What one would write first: eigendecompositions of K and of the whitened B, n x n
    products."""
    (x, y), at = pulses(n), parameters()

    def evaluate() -> float:
        a, root = x / at.lengthscales, at.noise**-0.5
        k = kernel_matrix("rbf", a, a)
        lengths, u = np.linalg.eigh(k)
        s, v = np.linalg.eigh(root[:, None] * at.b * root)
        turned = u.T @ (y * root) @ v
        total = s * np.maximum(lengths, 0.0)[:, None] + 1.0
        solved = turned / total
        alpha = u @ solved
        by_k = 0.5 * ((u * (s / total).sum(axis=1)) @ u.T - (alpha * s) @ alpha.T)
        weighted = by_k * k
        (a * a).T @ weighted.sum(axis=1) - (a * (weighted @ a)).sum(axis=0)
        solved.T @ (lengths[:, None] * solved)
        constants = len(y) * np.log(at.noise).sum() + y.size * np.log(2 * np.pi)
        return 0.5 * float((turned * solved).sum() + np.log(total).sum() + constants)

    return evaluate


def cholesky(n: int) -> Evaluate:
    """The yardstick: one factorisation of K + I."""
    from scipy.linalg import cholesky as factorised

    (x, _), at = pulses(n), parameters()
    k = kernel_matrix("rbf", x / at.lengthscales, x / at.lengthscales) + np.eye(n)
    return lambda: float(factorised(k, lower=True, check_finite=False)[0, 0])


def ours(n: int) -> Evaluate:
    """As it is trained, priors included; what it returns is the loss without them."""
    from pyroshock.training.gp.marginal_likelihood import KroneckerMarginalLogLikelihood
    from pyroshock.training.gp.maximise import exactly
    from pyroshock.training.gp.multitask import named_kernel

    model = _multitask(n, named_kernel("rbf", PREDICTORS))
    (x,), y = model.train_inputs, model.train_targets
    objective = KroneckerMarginalLogLikelihood(model.likelihood, model)
    with_priors = _backward(model, lambda: -y.numel() * objective(model(x), y), exactly)

    def log_prior() -> float:
        priors = (
            prior.log_prob(closure(module)) for _, module, prior, closure, _ in model.named_priors()
        )
        return sum(float(log_density.detach().sum()) for log_density in priors)

    return lambda: with_priors() + log_prior()


def peer_likelihood(make: Callable[[int], Any], n: int) -> Evaluate:
    """Without conjugate gradients and random probes, whose likelihood is an estimate."""
    import torch
    from gpytorch import settings

    model, (x, y) = make(n), map(torch.tensor, pulses(n))
    exact = partial(settings.fast_computations, log_prob=False, covar_root_decomposition=False)
    return _backward(model, lambda: -model.likelihood(model(x)).log_prob(y), exact)


def peer_prediction(make: Callable[[int], Any], n: int, asked: int) -> Predict:
    """Mean and standard deviation of new measurements; what follows from the data alone, the first
    call computes.

    BoTorch's spreads are near the exact ones, not equal to them, with its own settings and with
    exact ones.
    """
    import torch
    from gpytorch import settings

    model, at = make(n), torch.tensor(new_pulses(asked))
    model.eval()
    model.likelihood.eval()

    def predict() -> tuple[Floats, Floats]:
        with torch.no_grad(), settings.fast_computations(False, False, False):
            kronecker = hasattr(model, "posterior")
            answer = (
                model.posterior(at, observation_noise=True)
                if kronecker
                else model.likelihood(model(at))
            )
            return np.asarray(answer.mean), np.sqrt(np.asarray(answer.variance))

    return predict


def gpytorch_model(n: int) -> Any:
    from gpytorch.kernels import RBFKernel

    return _multitask(n, RBFKernel(ard_num_dims=PREDICTORS).double())


def botorch_model(n: int) -> Any:
    import torch
    from botorch.models import KroneckerMultiTaskGP

    at, like, (x, y) = parameters(), gpytorch_model(n), map(torch.tensor, pulses(n))
    model = KroneckerMultiTaskGP(
        x, y, likelihood=like.likelihood, data_covar_module=like.kernel, rank=RANK
    )
    model.double().train()
    index = model.covar_module.task_covar_module
    index.covar_factor.data, index.var = map(torch.tensor, (at.loadings, at.kappa))
    return model


def _multitask(n: int, kernel: Any) -> Any:
    from pyroshock.training.gp.multitask import CoregionalModel

    model = CoregionalModel(*pulses(n), kernel, RANK)
    model.set_parameters(**vars(parameters()))
    return model


def _backward(
    model: Any, loss: Callable[[], Any], exact: Callable[[], AbstractContextManager[Any]]
) -> Evaluate:
    def evaluate() -> float:
        model.zero_grad()
        with exact():
            value = loss()
            value.backward()
        return float(value.detach())

    return evaluate


def ours_predicts(n: int, asked: int) -> Predict:
    (x, y), at, new = pulses(n), parameters(), new_pulses(asked)
    covariance = NamedCovariance("rbf", at.lengthscales)
    frozen = posterior(covariance, x, y, at.b, at.noise)
    return lambda: frozen.predict(covariance, new)


def products(n: int, asked: int) -> Predict:
    """The yardstick: the products of (asked x n) with (n x outputs) that a mean takes, and as much
    for the spread."""
    h, weights = np.ones((asked, n)), np.ones((n, OUTPUTS))
    return lambda: (h @ weights, h @ weights)


LIKELIHOODS: Mapping[str, Callable[[int], Evaluate]] = {
    OURS: ours,
    PLAIN: plain,
    CHOLESKY: cholesky,
    GPYTORCH: partial(peer_likelihood, gpytorch_model),
    BOTORCH: partial(peer_likelihood, botorch_model),
}
PREDICTIONS: Mapping[str, Callable[[int, int], Predict]] = {
    OURS: ours_predicts,
    CHOLESKY: products,
    GPYTORCH: partial(peer_prediction, gpytorch_model),
    BOTORCH: partial(peer_prediction, botorch_model),
}


def answering(name: str) -> Callable[[Message], Message]:
    """A way in this process: {"what": "likelihood", "prediction" or "training", "n", "asked"} to
    seconds, values and peak memory. What is asked for twice is prepared once."""
    prepared: dict[tuple[str, int], Callable[[], Any]] = {}

    def answer(request: Message) -> Message:
        what, n = request["what"], request["n"]
        if what == "training":
            return trained(n)
        with one_core() if name in ONE_CORE else nullcontext():
            if (what, n) not in prepared:
                likelihood = what == "likelihood"
                prepared[what, n] = (
                    LIKELIHOODS[name](n) if likelihood else PREDICTIONS[name](n, request["asked"])
                )
            begin = time.perf_counter()
            result = prepared[what, n]()
            seconds = time.perf_counter() - begin
        values = {"value": result}
        if what == "prediction":
            values = {"mean": result[0].tolist(), "spread": result[1].tolist()}
        return {"seconds": seconds, "peak_bytes": peak_bytes(), **values}

    return answer


def peak_bytes() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def write_pulses(folder: Path, n: int, asked: int) -> Path:
    """The same pulses and parameters as a file, for a program that imports nothing of ours."""
    (x, y), file = pulses(n), folder / f"pulses-{n}.npz"
    np.savez(file, x=x, y=y, asked=new_pulses(asked), **vars(parameters()))
    return file


def trained(n: int) -> dict[str, Any]:
    """The whole model, from nothing to convergence, and predictions of other pulses."""
    from pyroshock.training.estimators.coregional import Coregional

    (x, y), (new_inputs, _) = pulses(n), pulses(PREDICTED)
    begin = time.perf_counter()
    model = Coregional().fit(x, y, np.arange(n), np.random.default_rng(0))
    fitted = time.perf_counter()
    model.predict(new_inputs)
    search, seconds = model.maximisation_, time.perf_counter() - fitted
    assert search is not None
    return {"evaluations": len(search.losses), "converged": search.converged,
    "fit_s": fitted - begin,
            "predict_s": seconds, "peak_bytes": peak_bytes()}  # fmt: skip


def measure_coregional(
    folder: Path, full: bool = False, sizes: Mapping[int, int] | None = None, large: int = LARGE
) -> Iterator[Figure]:
    """All of it; pulses for GPy go to `folder`."""
    sizes = sizes or (FULL_SIZES if full else SIZES)
    for n in sizes:
        write_pulses(folder, n, ASKED)
    with ExitStack() as stack:
        programs: dict[str, Program] = {}
        for name in (OURS, PLAIN, CHOLESKY, *PEERS):
            words = (
                ("peer_programs", "gpy", folder) if name == GPY else ("coregional", "serve", name)
            )
            if python := interpreter_with(PEERS[name][0] if name in PEERS else "numpy"):
                program = Program(
                    "-m",
                    f"benchmarks.{words[0]}",
                    *words[1:],
                    python=python,
                    limit_bytes=LIMIT_BYTES,
                )
                programs[name] = stack.enter_context(program)
        for n, repeats in sizes.items():
            yield from _likelihoods(programs, n, repeats, warm=n > min(sizes), last=n == max(sizes))
        yield from _predictions(programs, max(sizes))
        yield from _alone(programs, large)
    yield from _training(large)


def _answers(programs: Mapping[str, Program], what: str, n: int) -> dict[str, Message]:
    """A first answer of each that can give one."""
    answers = {}
    for name, program in programs.items():
        with suppress(ProgramError):
            if not program.why:
                answers[name] = program.ask(what=what, n=n, asked=ASKED)
    return answers


def _timed(
    programs: Mapping[str, Program], names: Iterable[str], what: str, n: int, repeats: int
) -> dict[str, list[float]]:
    questions = {
        name: partial(programs[name].seconds, what=what, n=n, asked=ASKED) for name in names
    }
    return take_turns(questions, repeats, reported=[*questions], warm=False)


def _beside(
    programs: Mapping[str, Program], what: str, seconds: Mapping[str, Any], name: str, **fields: Any
) -> Figure:
    model = f" {PEERS[name][1]}" if name in PEERS else ""
    why = programs[name].why if name in programs else ABSENT
    return beside(THEME, f"{what}, beside {name}{model}", seconds, name, why, **fields)


def _likelihoods(
    programs: Mapping[str, Program], n: int, repeats: int, *, warm: bool, last: bool
) -> Iterator[Figure]:
    """The first answers count as well where every way is `warm`: another of a peer takes
    seconds."""
    first = _answers(programs, "likelihood", n)
    values = {name: [answer["value"]] for name, answer in first.items() if name != CHOLESKY}
    check_agreement(values, 1e-5 * abs(first[OURS]["value"]))
    again = _timed(programs, first, "likelihood", n, max(1, repeats - warm))
    seconds = {name: [first[name]["seconds"]] * warm + more for name, more in again.items()}
    quick = _timed(programs, (OURS, PLAIN, CHOLESKY), "likelihood", n, QUICK_REPEATS)
    for name in (*PEERS, PLAIN):
        binding = name in (GPYTORCH, BOTORCH) and n >= 180
        yield _beside(
            programs, f"loss and gradient, {n} pulses", quick if name == PLAIN else seconds, name,
            binding=binding,
            limit=PEER_LIMIT if binding else 1.0, bound=f"one Cholesky factorisation of {n} x {n}",
            question=f"a coregional GP's loss and gradient, {n} pulses" if last else "",
        )  # fmt: skip


def _predictions(programs: Mapping[str, Program], n: int) -> Iterator[Figure]:
    first = _answers(
        {name: program for name, program in programs.items() if name != PLAIN}, "prediction", n
    )
    means, spreads = (
        {name: np.ravel(a[kind]) for name, a in first.items()} for kind in ("mean", "spread")
    )
    check_agreement({name: mean for name, mean in means.items() if name != CHOLESKY}, 1e-5)
    check_agreement(
        {name: s for name, s in spreads.items() if name not in (CHOLESKY, BOTORCH)}, 1e-5
    )
    seconds = _timed(programs, first, "prediction", n, 5)
    for name in PEERS:
        bound = f"two products of {ASKED} x {n} with {n} x {OUTPUTS}"
        if name == BOTORCH and name in spreads:
            off = np.max(np.abs(spreads[name] - spreads[OURS]))
            bound = f"its spreads are {off:.1g} off the exact ones; {bound}"
        yield _beside(
            programs, f"{ASKED} predictions with spread, {n} pulses learned", seconds, name,
            limit=1.0, binding=False,
            bound=bound, question="a coregional GP's predictions",
        )  # fmt: skip


def _alone(programs: Mapping[str, Program], n: int) -> Iterator[Figure]:
    """Ours and its limit at a size at which the peers have no room."""
    names = (OURS, PLAIN, CHOLESKY)
    peak = _answers({name: programs[name] for name in names}, "likelihood", n)[OURS]["peak_bytes"]
    seconds, what = (
        _timed(programs, names, "likelihood", n, QUICK_REPEATS),
        f"loss and gradient, {n:,} pulses",
    )
    yield compared(
        THEME, f"{what}, over one Cholesky factorisation", seconds[OURS], seconds[CHOLESKY],
        kind="bound",
        limit=FACTORISATIONS,
        bound="the loss alone takes one; the gradient is products of the same size",
    )  # fmt: skip
    yield compared(
        THEME, f"{what}, beside {PLAIN}", seconds[OURS], seconds[PLAIN], limit=1.0, peer_name=PLAIN
    )
    memory = f"peak memory of a likelihood of {n:,} pulses"
    yield promised(THEME, memory, [peak], BYTES, "MB", bound="two matrices of pulses by pulses")


def _training(n: int) -> Iterator[Figure]:
    """In a fresh process. Raises `ProgramError`."""
    with Program("-m", "benchmarks.coregional", "serve", OURS) as program:
        answer = program.ask(what="training", n=n)
    steps = f"{answer['evaluations']} evaluations, converged: {answer['converged']}"
    yield promised(THEME, f"training on {n:,} pulses", [answer["fit_s"]], FIT_S, "s", bound=steps)
    memory, bound = "peak memory of that training", "two matrices of pulses by pulses"
    yield promised(THEME, memory, [answer["peak_bytes"]], FIT_BYTES, "MB", bound=bound)
    predictions, bound = f"{PREDICTED:,} predictions with spread", f"{n:,} pulses learned"
    yield promised(THEME, predictions, [answer["predict_s"]], PREDICT_S, "s", bound=bound)


def check_agreement(numbers: Mapping[str, Any], difference: float) -> None:
    """Raises `ValueError` where a way gives other numbers than ours: another model would be
    measured."""
    for name, values in numbers.items():
        worst = float(np.max(np.abs(np.subtract(values, numbers[OURS]))))
        if not worst <= difference:
            raise ValueError(f"{name}: {worst:.2g} from ours; expected at most {difference:.1g}")


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["training"]:
        sys.stdout.write(json.dumps(trained(int(arguments[1]))) + "\n")
    elif arguments[:1] == ["serve"]:
        answer_requests(answering(arguments[1]))
    else:
        return report(partial(measure_coregional, full="--full" in arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
