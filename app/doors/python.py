"""The Python method of an operation, with the signature and the parameters of its request."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from pydantic_core import PydanticUndefined

from ..common.errors import library_errors
from ..common.frames import step_bar
from ..operations.faults import argument_of, read_arguments
from ..operations.fields import presentation_of
from ..operations.laboratory import Laboratory
from ..operations.operation import Answer, Asked, Operation, Request

if TYPE_CHECKING:
    from typing import Protocol

    from ...schema.session import Store

    class Owner(Protocol):
        """An object of the library with an open store."""

        @property
        def store(self) -> Store: ...
        @property
        def url(self) -> str: ...


Function = TypeVar("Function", bound=Callable[..., Any])


class PythonMethod(Generic[Answer]):
    """A method of a class of the library that asks for an operation.

    Fields that are positional on the command line may be given without their names.
    `progress=False` shows no bar; `jobs` processes work, where the operation has such.
    """

    def __init__(self, request: type[Asked], operation: Operation[Asked, Answer]) -> None:
        self.request: type[Request] = request
        self.operation: Operation[Any, Answer] = operation
        self.__doc__ = documentation(request, operation)
        self.__signature__ = signature(request, operation)

    def __set_name__(self, owner: type, name: str) -> None:
        self.__name__, self.__qualname__ = name, f"{owner.__qualname__}.{name}"

    def __get__(self, instance: Owner | None, owner: type | None = None) -> Callable[..., Answer]:
        if instance is None:
            return cast(Callable[..., Answer], self)  # what help() and Sphinx read

        def call(*args: Any, progress: bool = True, **given: Any) -> Answer:
            with library_errors():
                return self._answer(instance, args, progress, given)

        call.__doc__, call.__name__ = self.__doc__, self.__name__
        call.__signature__ = self.__signature__  # type: ignore[attr-defined]
        return call

    def _answer(
        self, owner: Owner, args: tuple[Any, ...], progress: bool, given: dict[str, Any]
    ) -> Answer:
        places = positional_fields(self.request)
        if len(args) > len(places):
            takes = f"{self.__name__}() takes {len(places)} positional arguments"
            raise TypeError(f"{takes}, {len(args)} were given")
        processes = given.pop("jobs", None) if self.operation.processes else None
        values = {**dict(zip(places, args, strict=False)), **given}
        request = read_arguments(self.request, values)
        laboratory = Laboratory(owner.store, owner.url, processes=processes)
        return answer_of(self.operation, request, laboratory, progress)


def answer_of(
    operation: Operation[Any, Answer],
    request: Request,
    laboratory: Laboratory,
    progress: bool = True,
) -> Answer:
    """The answer to a request, with a bar where it takes long and `progress` is wanted."""
    if operation.check is not None:
        operation.check(request, laboratory)
    shown = progress and operation.long
    with step_bar(operation.title(request).lower(), operation.steps, shown) as step:
        return operation.answer(request, laboratory, step)


def with_arguments_of(request: type[Request]) -> Callable[[Function], Function]:
    """Give a function with `**arguments` the signature and the parameters of a request."""

    def documented(function: Function) -> Function:
        stated = inspect.signature(function).parameters.values()
        own = [part for part in stated if part.kind is not inspect.Parameter.VAR_KEYWORD]
        function.__dict__["__signature__"] = inspect.Signature([*own, *_parameters(request)])
        function.__doc__ = f"{inspect.getdoc(function)}\n\n{_rows(request)}"
        return function

    return documented


def positional_fields(request: type[Request]) -> list[str]:
    """Fields that may be given without their names, in their order."""
    fields = request.model_fields.items()
    return [name for name, field in fields if presentation_of(field).positional]


def signature(request: type[Request], operation: Operation[Any, Any]) -> inspect.Signature:
    """The parameters of a request as a method of the operation has them."""
    parameters = [inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)]
    parameters += _parameters(request)
    if operation.processes:
        keyword = inspect.Parameter.KEYWORD_ONLY
        parameters.append(inspect.Parameter("jobs", keyword, default=None))
    return inspect.Signature(parameters)


def _parameters(request: type[Request]) -> Iterator[inspect.Parameter]:
    places = positional_fields(request)
    for name in [*places, *(name for name in request.model_fields if name not in places)]:
        if name == "method":
            continue
        field = request.model_fields[name]
        kind = (
            inspect.Parameter.POSITIONAL_OR_KEYWORD
            if name in places
            else inspect.Parameter.KEYWORD_ONLY
        )
        drawn = None if field.default is PydanticUndefined else field.default
        default = inspect.Parameter.empty if field.is_required() else drawn
        yield inspect.Parameter(argument_of(name, field), kind, default=default)


def documentation(request: type[Request], operation: Operation[Any, Any]) -> str:
    """A docstring with a section of parameters: help, unit, bounds and default of each."""
    text = (request.__doc__ if operation.variants else operation.help) or operation.help
    lines = [" ".join(part.split()) for part in text.split("\n\n")]
    jobs = f"\n    jobs: {operation.processes}" if operation.processes else ""
    return "\n\n".join([*lines, _rows(request)]) + jobs


def _rows(request: type[Request]) -> str:
    rows = ["Parameters:"]
    for name, field in request.model_fields.items():
        if name == "method":
            continue
        unit = presentation_of(field).unit
        facts = [f"in {unit}, as text with a unit, or a quantity of pint"] if unit else []
        if not field.is_required() and field.default not in (PydanticUndefined, None, "", (), {}):
            facts.append(f"default {field.default}")
        aside = f" ({'; '.join(facts)})" if facts else ""
        rows.append(f"    {argument_of(name, field)}: {field.description}{aside}")
    return "\n".join(rows)
