"""Each parameter of the public Python interface is documented, and nothing else is called one."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pyroshock
import pytest
from pyroshock.app.doors.python import PythonMethod
from pyroshock.app.library.laboratory_twin import LaboratoryTwin
from pyroshock.app.library.plans import PlanCollection
from pyroshock.app.operations.diagnose.service import GapDiagnosis
from pyroshock.app.operations.plan.service import PlanQuality
from pyroshock.app.operations.train.contact_model import ContactPulses, StoredModel
from pyroshock.app.operations.train.service import (
    FrozenDataset,
    ModelComparison,
    PromotionDecision,
    TrainingRuns,
)
from pyroshock.app.operations.tune.service import TunedSettings
from pyroshock.app.operations.validate.service import TwinValidation

from tools.reference import api
from tools.reference.rooms import ROOMS

#: Classes that methods of the public names give.
GIVEN = (
    ContactPulses,
    FrozenDataset,
    GapDiagnosis,
    LaboratoryTwin,
    ModelComparison,
    PlanCollection,
    PlanQuality,
    PromotionDecision,
    StoredModel,
    TrainingRuns,
    TunedSettings,
    TwinValidation,
)
_HEADING = re.compile(r"^(Parameters|Returns|Raises|Source):$", re.MULTILINE)
_ENTRY = re.compile(r"^ {4}(\w+): (.*)$", re.MULTILINE)


def sections(doc: str | None) -> dict[str, str]:
    """Heading -> the indented lines below it."""
    parts = _HEADING.split(inspect.cleandoc(doc or ""))
    return dict(zip(parts[1::2], parts[2::2], strict=True))


def entries(doc: str | None, heading: str) -> dict[str, str]:
    """Name -> the first line of what is said of it."""
    return dict(_ENTRY.findall(sections(doc).get(heading, "")))


def parameters(function: Callable[..., Any]) -> list[str]:
    """Names in the order of the signature, without the instance."""
    names = inspect.signature(function).parameters
    return [name for name in names if name not in ("self", "cls") and not name.startswith("_")]


def methods(kind: type) -> Iterator[Callable[..., Any]]:
    """Public methods of a class and of the classes of the package that it derives from."""
    for name in dir(kind):
        plain = getattr(inspect.getattr_static(kind, name), "__func__", getattr(kind, name))
        if not name.startswith("_") and inspect.isfunction(plain):
            yield plain


def promised() -> dict[str, Callable[..., Any]]:
    """Functions of `import pyroshock`, methods of its classes, and of what these give."""
    public = [getattr(pyroshock, name) for name in pyroshock.__all__]
    functions: list[Callable[..., Any]] = list(filter(inspect.isfunction, public))
    kinds = [member for member in public if inspect.isclass(member)]
    functions += [method for kind in (*kinds, *GIVEN) for method in methods(kind)]
    return {f"{item.__module__}.{item.__qualname__}": item for item in functions}


PROMISED = promised()


@pytest.mark.parametrize("function", PROMISED.values(), ids=PROMISED)
def test_each_parameter_of_a_public_name_is_documented_and_no_other(function) -> None:
    documented = entries(function.__doc__, "Parameters")
    assert sorted(documented) == sorted(parameters(function))
    assert all(documented.values())


def test_methods_of_operations_are_among_the_public_names() -> None:
    assert "pyroshock.app.library.experiment_store.ExperimentStore.ingest" in PROMISED
    assert "pyroshock.app.library.plans.PlanCollection.lhs" in PROMISED
    assert isinstance(inspect.getattr_static(PlanCollection, "lhs"), PythonMethod)


def of_room(room: str) -> dict[str, Callable[..., Any]]:
    """Functions and methods of the reference of a room, each once."""
    members = [member for module in api.modules(room) for member in api.members(module)]
    functions = [item for member in members for item in _parts(member)]
    return {f"{item.__module__}.{item.__qualname__}": item for item in functions}


def _parts(member: Any) -> list[Callable[..., Any]]:
    if not inspect.isclass(member):
        return [member]
    return [item for item in methods(member) if item.__module__.startswith("pyroshock")]


@pytest.mark.parametrize("room", ROOMS)
def test_each_parameter_of_the_reference_is_documented_and_no_other(room: str) -> None:
    for name, function in of_room(room).items():
        documented = entries(function.__doc__, "Parameters")
        assert sorted(documented) == sorted(parameters(function)), name
        assert all(documented.values()), name
