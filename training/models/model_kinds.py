"""Every kind of model and estimator that may be read back from a file, and where its class stands."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from typing import Any

from ..estimators.base import Estimator
from .base import ContactModel

#: Kind -> module under `training`, class. Nothing else is ever imported for a file's sake.
KINDS: dict[str, tuple[str, str]] = {
    "pair": ("models.pair", "Pair"),
    "single-pass": ("models.single_pass", "SinglePass"),
    "hybrid": ("models.hybrid", "Hybrid"),
    "calibrated": ("models.calibrated", "Calibrated"),
    "analytic": ("models.analytic", "Analytic"),
    "tree": ("estimators.tree", "DecisionTree"),
    "ensemble": ("estimators.ensemble", "TreeEnsemble"),
    "svr": ("estimators.svr", "SupportVectors"),
    "svr-kernel": ("estimators.svr_kernel", "SupportVectorKernel"),
    "kernel-ridge": ("estimators.kernel_ridge", "KernelRidge"),
    "linear": ("estimators.linear", "LinearPowers"),
    "pls": ("estimators.pls", "PartialLeastSquares"),
    "network": ("estimators.network", "Network"),
    "genetic-network": ("estimators.genetic_network", "GeneticNetwork"),
    "coregional": ("estimators.coregional", "Coregional"),
    "single-outputs": ("estimators.single_outputs", "SingleOutputs"),
    "turned": ("estimators.rotated_outputs", "Turned"),
    "contact-time": ("estimators.contact_time", "ContactTimeProcess"),
}

_ROOT = __package__.rpartition(".")[0]


class UnknownKindError(ValueError):
    """A file names a kind of model that this software does not have."""


def build(description: Mapping[str, Any]) -> ContactModel | Estimator:
    """The unfitted object of {"kind", "settings"}; a setting of that form is built first.

    Raises `UnknownKindError`, and `ValueError` for settings that the kind does not take.
    """
    kind = description["kind"]
    if kind not in KINDS:
        raise UnknownKindError(f"unknown kind of model {kind!r}; known: {', '.join(KINDS)}; is pyroshock up to date?")
    module, name = KINDS[kind]
    made = getattr(importlib.import_module(f".{module}", _ROOT), name)
    try:
        built = made(**{key: _built(value) for key, value in description["settings"].items()})
    except TypeError as error:
        raise ValueError(f"a model of kind {kind!r} does not take these settings: {error}") from error
    assert isinstance(built, ContactModel | Estimator)
    return built


def describe(thing: ContactModel | Estimator) -> dict[str, Any]:
    """What `build` makes the same unfitted object of."""
    return {"kind": thing.kind, "settings": thing.settings()}


def parts_within(description: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """{"kind", "settings"} itself and every part that its settings describe."""
    yield description
    for value in description["settings"].values():
        if _is_part(value):
            yield from parts_within(value)


def _is_part(value: Any) -> bool:
    return isinstance(value, dict) and value.keys() == {"kind", "settings"}


def _built(value: Any) -> Any:
    return build(value) if _is_part(value) else value
