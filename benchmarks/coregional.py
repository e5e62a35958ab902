"""`python -m benchmarks.coregional [--full]`: the coregional Gaussian process beside GPyTorch, BoTorch and GPy.

Loss with gradient, and predictions with spread, of the same pulses and parameters; every way in a process of its
own, asked in turn. Beside them what one would write first, two eigendecompositions; and as the limit one Cholesky
factorisation of a matrix of pulses by pulses, which no exact likelihood does without. `--full` goes on to sizes at
which the peers take minutes and 12 GB.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from . import coregional_full
from .apart import Answer, Apart, ApartError, in_turn, interpreter_with
from .coregional_ways import CHOLESKY, ONE_CORE_CHOLESKY, OUTPUTS, PREDICTED, TRAINING, written
from .figures import Figure, missing
from .measuring import ROOT, Spread, ratio
from .peers import ABSENT

THEME = "Coregional Gaussian process, 20 outputs, 13 predictors"
OURS, PLAIN = "pyroshock", "plain eigendecomposition"
YARDSTICKS = (CHOLESKY, ONE_CORE_CHOLESKY)
#: A peer's name, the module it needs, and in a word.
PEERS = (
    ("GPyTorch MultitaskKernel", "gpytorch", "GPyTorch"),
    ("BoTorch KroneckerMultiTaskGP", "botorch", "BoTorch"),
    ("GPy coregionalized regression", "GPy", "GPy"),
)
#: Its predictions' spreads are near the exact ones only; all else agrees to the digits that can be asked for.
INEXACT = "BoTorch KroneckerMultiTaskGP"
#: Pulses, and how often each way is timed, in rising order: a peer's likelihood of 180 takes seconds.
SIZES: Mapping[int, int] = {45: 7, 90: 5, 180: 2}
FULL_SIZES: Mapping[int, int] = {**SIZES, 720: 1}
LARGE, QUICK_REPEATS = 1440, 9
ASKED = 20
#: Promised: times faster than GPyTorch and BoTorch from 180 pulses on; factorisations, seconds and bytes at 1,440.
FASTER, FACTORISATIONS, FIT_S, PREDICT_S, BYTES, FIT_BYTES = 200.0, 4.0, 60.0, 2.0, 1e9, 2e9


@dataclass
class Way:
    """A program that answers, or `why` it ended; `files` hold each size's pulses for one that knows nothing of ours."""

    program: Apart
    files: Mapping[int, Path] = field(default_factory=dict)
    why: str = ""

    def ask(self, what: str, n: int) -> Answer:
        if self.files:
            return self.program.ask(what=what, file=str(self.files[n]))
        return self.program.ask(what=what, n=n, asked=ASKED)

    def seconds(self, what: str, n: int) -> float:
        return float(self.ask(what, n)["seconds"])


def measure_coregional(
    folder: Path, full: bool = False, sizes: Mapping[int, int] | None = None, large: int = LARGE
) -> Iterator[Figure]:
    """All of it; pulses for GPy go to `folder`."""
    sizes = sizes or (FULL_SIZES if full else SIZES)
    files = {n: written(folder / f"pulses-{n}.npz", n, ASKED) for n in sizes}
    with ExitStack() as open_ones:
        ways = {name: open_ones.enter_context(_own(name)) for name in (OURS, PLAIN, *YARDSTICKS)}
        programs = {name: Way(program) for name, program in ways.items()}
        for name, module, _ in PEERS:
            if python := interpreter_with(module):
                by_file = files if module == "GPy" else {}
                limit = coregional_full.LIMIT_BYTES
                peer = Apart("-m", "benchmarks.gpy_peer", python=python, limit_bytes=limit) if by_file else _own(name)
                programs[name] = Way(open_ones.enter_context(peer), by_file)
        for n, repeats in sizes.items():
            yield from _likelihoods(programs, n, repeats, warm=n > min(sizes), last=n == max(sizes))
        yield from _predictions(programs, max(sizes))
        yield from _alone(programs, large)
    yield from _training(large)


def _own(name: str) -> Apart:
    return Apart("-m", "benchmarks.coregional_ways", name, limit_bytes=coregional_full.LIMIT_BYTES)


def _answers(ways: Mapping[str, Way], what: str, n: int) -> dict[str, Answer]:
    """A first answer of each that can give one."""
    found = {}
    for name, way in ways.items():
        try:
            if not way.why:
                found[name] = way.ask(what, n)
        except ApartError as error:
            way.why = str(error)
    return found


def _timed(ways: Mapping[str, Way], names: Sequence[str], what: str, n: int, repeats: int) -> dict[str, list[float]]:
    return in_turn({name: partial(ways[name].seconds, what, n) for name in names}, repeats)


def _likelihoods(ways: Mapping[str, Way], n: int, repeats: int, *, warm: bool, last: bool) -> Iterator[Figure]:
    """The first answers count as well where every way is `warm`: another of a peer takes seconds."""
    first = _answers(ways, "likelihood", n)
    values = {name: [answer["value"]] for name, answer in first.items() if name not in YARDSTICKS}
    _agree(values, 1e-5 * abs(first[OURS]["value"]))
    again = _timed(ways, list(first), "likelihood", n, max(1, repeats - warm))
    beside = {name: [first[name]["seconds"]] * warm + values for name, values in again.items()}
    quick = _timed(ways, (OURS, PLAIN, *YARDSTICKS), "likelihood", n, QUICK_REPEATS)
    nature = f"one Cholesky factorisation of {n} x {n}"
    for name, _, short in (*PEERS, (PLAIN, "", "eigendecomposition")):
        taken = quick if name == PLAIN else beside
        what = f"loss and gradient, {n} pulses, beside {name}"
        question = f"a coregional GP's loss and gradient, {n} pulses" if last else ""
        if name not in taken:
            yield missing(THEME, what, _why(ways, name), ours=_ms(taken[OURS]), question=question, rival=short)
            continue
        binds = name in coregional_full.PEERS and n >= 180
        yield Figure(
            THEME, what, _ms(taken[OURS]), _ms(taken[name]), ratio(taken[name], taken[OURS]), "at least",
            FASTER if binds else 1.0, nature, binding=binds, near=ratio(taken[OURS], _quicker(taken)),
            question=question, rival=short,
        )  # fmt: skip


def _predictions(ways: Mapping[str, Way], n: int) -> Iterator[Figure]:
    them = {name: way for name, way in ways.items() if name != PLAIN}
    first = _answers(them, "prediction", n)
    means, spreads = ({name: np.ravel(told[kind]) for name, told in first.items()} for kind in ("mean", "spread"))
    apart = {name: float(np.max(np.abs(spread - spreads[OURS]))) for name, spread in spreads.items()}
    _agree({name: mean for name, mean in means.items() if name not in YARDSTICKS}, 1e-5)
    _agree({name: spread for name, spread in spreads.items() if name not in (*YARDSTICKS, INEXACT)}, 1e-5)
    taken = _timed(them, list(first), "prediction", n, 5)
    limit = _quicker(taken)
    products = f"two products of {ASKED} x {n} with {n} x {OUTPUTS}"
    for name, _, short in PEERS:
        what = f"{ASKED} predictions with spread, {n} pulses learned, beside {name}"
        if name not in taken:
            yield missing(THEME, what, _why(ways, name), ours=_ms(taken[OURS]), rival=short)
            continue
        nature = products + (f"; its spreads are {apart[name]:.1g} off the exact ones" if name == INEXACT else "")
        yield Figure(
            THEME, what, _ms(taken[OURS]), _ms(taken[name]), ratio(taken[name], taken[OURS]), "at least", 1.0, nature,
            binding=False, near=ratio(taken[OURS], limit), question="a coregional GP's predictions", rival=short,
        )  # fmt: skip


def _alone(ways: Mapping[str, Way], n: int) -> Iterator[Figure]:
    """Ours and its limit at a size at which the peers have no room."""
    mine = {name: ways[name] for name in (OURS, PLAIN, *YARDSTICKS)}
    peak = _answers(mine, "likelihood", n)[OURS]["peak_bytes"]
    taken = _timed(mine, list(mine), "likelihood", n, QUICK_REPEATS)
    limit = _quicker(taken)
    ours, near = taken[OURS], ratio(taken[OURS], limit)
    yield Figure(
        THEME, f"loss and gradient, {n:,} pulses, over one Cholesky factorisation", _ms(ours), _ms(limit), near,
        "at most", FACTORISATIONS, "the loss alone takes one; the gradient is products of the same size", near=near,
        of="bound",
    )  # fmt: skip
    yield Figure(
        THEME, f"loss and gradient, {n:,} pulses, beside {PLAIN}", _ms(ours), _ms(taken[PLAIN]),
        ratio(taken[PLAIN], ours), "at least", 1.0, "as above", near=near, rival="eigendecomposition",
    )  # fmt: skip
    yield _bound(f"peak memory of a likelihood of {n:,} pulses, GB", peak / 1e9, BYTES / 1e9, "pulses by pulses, twice")


def _training(n: int) -> Iterator[Figure]:
    told = trained(n)
    steps = f"{told['evaluations']} evaluations, converged: {told['converged']}"
    yield _bound(f"training on {n:,} pulses, s", told["fit_s"], FIT_S, steps)
    yield _bound(
        "peak memory of that training, GB", told["peak_bytes"] / 1e9, FIT_BYTES / 1e9, "pulses by pulses, twice"
    )
    yield _bound(f"{PREDICTED:,} predictions with spread, s", told["predict_s"], PREDICT_S, f"{n:,} pulses learned")


def trained(n: int) -> dict[str, Any]:
    """In a fresh process, what `coregional_ways.trained` tells. Raises `CalledProcessError`."""
    command = [sys.executable, "-m", "benchmarks.coregional_ways", TRAINING, str(n)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return dict(json.loads(done.stdout.splitlines()[-1]))


def _bound(name: str, value: float, most: float, nature: str) -> Figure:
    share = Spread.of([value / most])
    return Figure(THEME, name, f"{value:.3g}", f"promised {most:g}", share, "at most", 1.0, nature, of="bound")


def _quicker(taken: Mapping[str, Sequence[float]]) -> Sequence[float]:
    """The yardstick on one core or on all, whichever is quicker at this size."""
    return min((taken[name] for name in YARDSTICKS), key=lambda values: Spread.of(values).median)


def _why(ways: Mapping[str, Way], name: str) -> str:
    return ways[name].why if name in ways else ABSENT


def _ms(seconds: Sequence[float]) -> str:
    return Spread.of(seconds).text(" ms", 1e3)


def _agree(found: Mapping[str, Any], apart: float) -> None:
    """Raises `ValueError` where a way gives other numbers than ours: it would be another model that is timed."""
    for name, numbers in found.items():
        worst = float(np.max(np.abs(np.subtract(numbers, found[OURS]))))
        if not worst <= apart:
            raise ValueError(f"{name}: {worst:.2g} from ours; expected at most {apart:.1g}")


def main(arguments: list[str]) -> int:
    if "--full" in arguments:
        return coregional_full.main()
    lost = []
    with tempfile.TemporaryDirectory() as folder:
        for figure in measure_coregional(Path(folder)):
            sys.stdout.write(figure.row() + "\n")
            sys.stdout.flush()
            lost += [figure.name] * (figure.binding and not figure.holds)
    sys.stdout.write(f"\nnot kept: {'; '.join(lost) or 'nothing'}\n")
    return 1 if lost else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
