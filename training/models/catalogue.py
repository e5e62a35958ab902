"""The models by the names under which the command line knows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from ...parallel.executor import HERE, ExecutorConfig
from ...plugins import taken
from ..estimators.base import Estimator
from .base import ContactModel
from .serialization import added_kinds, build

Budget = Literal["small", "reduced", "full"]


@dataclass(frozen=True)
class BuildOptions:
    """What may differ from training to training. `budget` is the genetic search's.

    `tuned_time` are settings of the contact-time process that were found already; None lets the
    model search. `journal` is where a search keeps what it has done, `progress` hears of it,
    `executor` does it; none changes a model.
    """

    budget: Budget = "reduced"
    tuned_time: Mapping[str, Any] | None = None
    journal: Path | None = None
    progress: Callable[[int, int, str], None] | None = None
    executor: ExecutorConfig = HERE


@dataclass(frozen=True)
class ModelSpec:
    """A model that `train` knows by name.

    `shares_time` models take the contact-time process that was searched once for all. One that
    `searches` has an executor of its own for it.
    """

    make: Callable[[BuildOptions], ContactModel]
    shares_time: bool = False
    searches: bool = False


def entry_of(name: str) -> ModelSpec:
    """The model that `train` knows by a name.

    Parameters:
        name: "hybrid" or another name of `MODEL_SPECS`, or that of a model of another package.

    Raises:
        LookupError: For an unknown name, with the names that there are; for a model of another
            package that cannot be used, with the cause.
    """
    if name in MODEL_SPECS:
        return MODEL_SPECS[name]
    specs = model_specs()
    if name in specs:
        return specs[name]
    if name in (failures := added_kinds().failures):
        raise LookupError(failures[name])
    raise LookupError(f"no model {name!r}; there are: {', '.join(specs)}")


def model_specs() -> dict[str, ModelSpec]:
    """Those that are shipped, then those of other packages by name. Raises `PluginError` for a name
    that is taken."""
    added = added_kinds()
    for name in added.objects:
        if name in MODEL_SPECS:
            raise taken(added.plugins[name], "pyroshock has a model of this name itself")
    return MODEL_SPECS | {
        name: _calibrated_spec(name) if issubclass(made, ContactModel) else _twice(name)
        for name, made in added.objects.items()
    }


def models_of(names: str) -> list[str]:
    """Names of models, each once, in the order of a text.

    Parameters:
        names: The names with commas between them; "all", or "usual" for those of `USUAL_MODELS`.

    Raises:
        LookupError: For an unknown name.
        ValueError: Where no name is given.
    """
    if names.strip() == "all":
        return list(model_specs())
    if names.strip() == "usual":
        return list(USUAL_MODELS)
    chosen = list(dict.fromkeys(name.strip() for name in names.split(",") if name.strip()))
    if not chosen:
        choices = ", ".join((*model_specs(), "usual"))
        raise ValueError(f"no model is named; name some of {choices}, or all")
    for name in chosen:
        entry_of(name)
    return chosen


def _built(kind: str, **settings: Any) -> Any:
    """A model or regression of `serialization.KINDS`, which alone says where its class stands."""
    return build({"kind": kind, "settings": settings})


def _calibrated(model: ContactModel) -> ContactModel:
    from .calibrated import Calibrated

    return Calibrated(model)


def _calibrated_spec(kind: str) -> ModelSpec:
    return ModelSpec(lambda _: _calibrated(_built(kind)))


def _twice(kind: str) -> ModelSpec:
    """One family for force and for time, as Table 4.4 pairs them."""

    def model(_: BuildOptions) -> ContactModel:
        from .pair import Pair

        return _calibrated(Pair(_built(kind), _built(kind)))

    return ModelSpec(model)


def _with_time_process(kind: str, scaling: str = "none", **settings: Any) -> ModelSpec:
    """A force model beside the contact-time process of section 4.4; `scaling` as in
    `models.pair.SCALINGS`."""
    return ModelSpec(
        lambda making: _beside_time_process(_built(kind, **settings), making, scaling),
        shares_time=True,
    )


def _beside_time_process(force: Estimator, making: BuildOptions, scaling: str) -> ContactModel:
    from ..estimators.contact_time import ContactTimeProcess
    from .pair import Pair

    return _calibrated(Pair(force, ContactTimeProcess(tuned=making.tuned_time), scaling))


#: Sizes of the genetic search, which differ from the defaults of `GeneticNetwork`; the full one is
#: the thesis's.
_SEARCHES: dict[Budget, dict[str, int]] = {
    "small": {"population": 6, "generations": 3},
    "reduced": {},
    "full": {"population": 50, "generations": 50},
}


def search_size(name: str, budget: Budget) -> tuple[int, int] | None:
    """Candidates and later generations of a model's genetic search; None for a model without.

    Parameters:
        name: As `entry_of` takes and refuses it.
        budget: The size that the search gets.
    """
    if not entry_of(name).searches:
        return None
    network = _built("genetic-network", **_SEARCHES[budget])
    return network.population, network.generations


def _genetic(making: BuildOptions) -> ContactModel:
    network = _built("genetic-network", **_SEARCHES[making.budget])
    network.journal, network.progress, network.executor = (
        making.journal,
        making.progress,
        making.executor,
    )
    return _beside_time_process(network, making, "none")


def _law(name: str) -> ModelSpec:
    return ModelSpec(lambda _: _built("analytic", law=name))


#: The cheap ones first, so that the first results come soon.
MODEL_SPECS: dict[str, ModelSpec] = {
    "hunter": _law("hunter"),
    "reed": _law("reed"),
    "hann": _law("hann"),
    "hertz": _law("hertz"),
    "hunt-crossley": _law("hunt-crossley"),
    "linear": _twice("linear"),
    "pls": _twice("pls"),
    "tree": _twice("tree"),
    "ensemble": _twice("ensemble"),
    "kernel-ridge": _twice("kernel-ridge"),
    "svr": _twice("svr"),
    "svr-kernel": _twice("svr-kernel"),
    # A process has one noise level for all pulses, so it learns force in a unit that makes their
    # noise alike; the thesis's other families learn newtons, as there, and do without the
    # impactor's mass.
    "coregional-gp": _with_time_process("coregional", "momentum"),
    "gp": _with_time_process("single-outputs", "momentum"),
    "hybrid": _calibrated_spec("hybrid"),
    "single-pass": _calibrated_spec("single-pass"),
    # Hidden layers of MATLAB's presets, which Table 4.5 names.
    "nn-narrow": _with_time_process("network", layers=(10,)),
    "nn-medium": _with_time_process("network", layers=(25,)),
    "nn-wide": _with_time_process("network", layers=(100,)),
    "nn-bilayer": _with_time_process("network", layers=(10, 10)),
    "nn-trilayer": _with_time_process("network", layers=(10, 10, 10)),
    "nn-ga": ModelSpec(_genetic, shares_time=True, searches=True),
}
#: The four models of contact that laboratories use, and the line that each of them must beat.
USUAL_MODELS = ("linear", "tree", "gp", "coregional-gp", "nn-ga")
