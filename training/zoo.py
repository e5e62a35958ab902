"""The models by the names under which the command line knows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ..compute.crew import HERE, Crew
from .estimators.base import Estimator
from .models.base import ContactModel

Budget = Literal["reduced", "full"]
BUDGETS: tuple[Budget, ...] = ("reduced", "full")


@dataclass(frozen=True)
class Making:
    """What may differ from training to training. `budget` is the genetic search's.

    `tuned_time` are settings of the contact-time process that were found already; None lets the model search.
    `journal` is where a search keeps what it has done, `tell` hears of it, and `crew` does it: none changes a model.
    """

    budget: Budget = "reduced"
    tuned_time: Mapping[str, Any] | None = None
    journal: Path | None = None
    tell: Callable[[str], None] | None = None
    crew: Crew = HERE


@dataclass(frozen=True)
class Entry:
    """A model of the zoo.

    `shares_time` models take the contact-time process that was searched once for all. One that `searches` has a crew
    of its own for it.
    """

    make: Callable[[Making], ContactModel]
    shares_time: bool = False
    searches: bool = False


def entry_of(name: str) -> Entry:
    """Raises `LookupError` that names those there are."""
    if name not in ZOO:
        raise LookupError(f"no model {name!r}; there are: {', '.join(ZOO)}")
    return ZOO[name]


def models_of(names: str) -> list[str]:
    """Names from a comma list, or of "all". Raises `LookupError` for an unknown one, `ValueError` for none."""
    if names.strip() == "all":
        return list(ZOO)
    chosen = list(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    if not chosen:
        raise ValueError(f"no model is named; name some of {', '.join(ZOO)}, or all")
    for name in chosen:
        entry_of(name)
    return chosen


def _calibrated(model: ContactModel) -> ContactModel:
    from .models.calibrated import Calibrated

    return Calibrated(model)


def _twice(make: Callable[[], Estimator], scaling: str = "none") -> Entry:
    """One family for force and for time, as Table 4.4 pairs them; `scaling` as in `models.pair.SCALINGS`."""

    def model(_making: Making) -> ContactModel:
        from .models.pair import Pair

        return _calibrated(Pair(make(), make(), scaling))

    return Entry(model)


def _with_time_process(make: Callable[[Making], Estimator], scaling: str = "none", searches: bool = False) -> Entry:
    """A force model beside the contact-time process of section 4.4; `scaling` as in `models.pair.SCALINGS`."""

    def model(making: Making) -> ContactModel:
        from .estimators.contact_time import ContactTimeProcess
        from .models.pair import Pair

        return _calibrated(Pair(make(making), ContactTimeProcess(tuned=making.tuned_time), scaling))

    return Entry(model, shares_time=True, searches=searches)


def _network(*layers: int) -> Entry:
    def estimator(_making: Making) -> Estimator:
        from .estimators.network import Network

        return Network(layers=layers)

    return _with_time_process(estimator)


def _genetic(making: Making) -> Estimator:
    from .estimators.genetic_network import GeneticNetwork

    full = {"population": 50, "generations": 50} if making.budget == "full" else {}
    network = GeneticNetwork(**full)
    network.journal, network.progress, network.crew = making.journal, making.tell, making.crew
    return network


def _law(name: str) -> Entry:
    def model(_making: Making) -> ContactModel:
        from .models.analytic import Analytic

        return Analytic(name)

    return Entry(model)


def _tree() -> Estimator:
    from .estimators.tree import DecisionTree

    return DecisionTree()


def _ensemble() -> Estimator:
    from .estimators.ensemble import TreeEnsemble

    return TreeEnsemble()


def _svr() -> Estimator:
    from .estimators.svr import SupportVectors

    return SupportVectors()


def _svr_kernel() -> Estimator:
    from .estimators.svr_kernel import SupportVectorKernel

    return SupportVectorKernel()


def _kernel_ridge() -> Estimator:
    from .estimators.kernel_ridge import KernelRidge

    return KernelRidge()


def _linear() -> Estimator:
    from .estimators.linear import LinearPowers

    return LinearPowers()


def _pls() -> Estimator:
    from .estimators.pls import PartialLeastSquares

    return PartialLeastSquares()


def _single_outputs(_making: Making) -> Estimator:
    from .estimators.single_outputs import SingleOutputs

    return SingleOutputs()


def _coregional(_making: Making) -> Estimator:
    from .estimators.coregional import Coregional

    return Coregional()


def _single_pass(_making: Making) -> ContactModel:
    from .models.single_pass import SinglePass

    return _calibrated(SinglePass())


def _hybrid(_making: Making) -> ContactModel:
    from .models.hybrid import Hybrid

    return _calibrated(Hybrid())


#: The cheap ones first, so that the first results come soon.
ZOO: dict[str, Entry] = {
    "hunter": _law("hunter"),
    "reed": _law("reed"),
    "hann": _law("hann"),
    "hertz": _law("hertz"),
    "hunt-crossley": _law("hunt-crossley"),
    "linear": _twice(_linear),
    "pls": _twice(_pls),
    "tree": _twice(_tree),
    "ensemble": _twice(_ensemble),
    "kernel-ridge": _twice(_kernel_ridge),
    "svr": _twice(_svr),
    "svr-kernel": _twice(_svr_kernel),
    # A process has one noise level for all pulses, so it learns force in a unit that makes their noise alike; the
    # thesis's other families learn newtons, as there, and do without the impactor's mass.
    "coregional-gp": _with_time_process(_coregional, "momentum"),
    "gp": _with_time_process(_single_outputs, "momentum"),
    "hybrid": Entry(_hybrid),
    "single-pass": Entry(_single_pass),
    "nn-narrow": _network(10),
    "nn-medium": _network(25),
    "nn-wide": _network(100),
    "nn-bilayer": _network(10, 10),
    "nn-trilayer": _network(10, 10, 10),
    "nn-ga": _with_time_process(_genetic, searches=True),
}
