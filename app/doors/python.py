"""The Python method of an operation, with the signature and the parameters of its request."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from types import MethodType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pydantic_core import PydanticUndefined

from ..common.errors import argument_names, library_errors
from ..common.frames import step_bar
from ..operations.faults import argument_of, read_arguments
from ..operations.fields import presentation_of
from ..operations.laboratory import Laboratory
from ..operations.operation import Answer, Asked, Operation, Request, Result

#: What a method gives.
Returned = TypeVar("Returned", bound=Result)

if TYPE_CHECKING:
    from typing import Literal, Protocol, overload

    from ...parallel.executor import ExecutorConfig
    from ...schema.session import Store
    from .job_handle import JobHandle

    class Owner(Protocol):
        """An object of the library with an open store."""

        @property
        def store(self) -> Store: ...
        @property
        def url(self) -> str: ...

    class Answers(Protocol):
        """Where the requests of an object of the library go: its store, or a server."""

        def answer(
            self,
            operation: Operation[Any, Answer],
            request: Request,
            progress: bool = True,
            *,
            executor: ExecutorConfig | None = None,
            processes: int | None = None,
        ) -> Answer: ...
        def ask(self, operation: Operation[Any, Answer], request: Request) -> JobHandle[Answer]: ...

    class BoundMethod(Protocol[Returned]):
        """A method with the arguments of a request; `wait=False` gives the job of long work."""

        @overload
        def __call__(
            self, *args: Any, wait: Literal[False], **values: Any
        ) -> JobHandle[Returned]: ...
        @overload
        def __call__(self, *args: Any, wait: Literal[True] = True, **values: Any) -> Returned: ...


Function = TypeVar("Function", bound=Callable[..., Any])
_LATER_SECTION = re.compile(r"\n\n(?=(?:Returns|Raises|Source):\n)")
#: How help says that an option takes several values, and what holds without it.
_REPEATED = re.compile(
    r"Repeat the option, or give a list: \S+\.(?=\s|$)|(?:The option|It) can be repeated\."
)
_STATED_DEFAULT = re.compile(r"\[default:? ([^\]]+)\]")


class PythonMethod(Generic[Answer]):
    """A method of a class of the library that asks for an operation.

    Fields that are positional on the command line may be given without their names.
    `progress=False` shows no bar; `jobs` processes work, where the operation has such.
    """

    def __init__(self, request: type[Asked], operation: Operation[Asked, Answer]) -> None:
        self.request: type[Request] = request
        self.operation: Operation[Any, Answer] = operation

        def method(
            instance: Owner, /, *args: Any, progress: bool = True, wait: bool = True, **values: Any
        ) -> Answer | JobHandle[Answer]:
            with library_errors():
                return self._answer(instance, args, progress, wait, values)

        method.__doc__ = documentation(request, operation)
        method.__signature__ = signature(request, operation)  # type: ignore[attr-defined]
        self.method = method

    def __set_name__(self, owner: type, name: str) -> None:
        self.method.__name__, self.method.__qualname__ = name, f"{owner.__qualname__}.{name}"
        self.method.__module__ = owner.__module__

    def __get__(self, instance: Owner | None, owner: type | None = None) -> BoundMethod[Answer]:
        bound: Any = self.method if instance is None else MethodType(self.method, instance)
        method: BoundMethod[Answer] = bound
        return method

    def _answer(
        self,
        owner: Owner,
        args: tuple[Any, ...],
        progress: bool,
        wait: bool,
        fields: dict[str, Any],
    ) -> Answer | JobHandle[Answer]:
        places = positional_fields(self.request)
        if len(args) > len(places):
            takes = f"{self.method.__name__}() takes {len(places)} positional arguments"
            raise TypeError(f"{takes}, {len(args)} were given")
        processes = fields.pop("jobs", None) if self.operation.processes else None
        values = {**dict(zip(places, args, strict=False)), **fields}
        request = read_arguments(self.request, values)
        answers: Answers = getattr(owner, "answers", None) or StoreAnswers(owner.store, owner.url)
        if wait or not self.operation.long:
            return answers.answer(self.operation, request, progress, processes=processes)
        return answers.ask(self.operation, request)


@dataclass(frozen=True)
class StoreAnswers:
    """Requests are answered here, from an open store."""

    store: Store
    url: str

    def answer(
        self,
        operation: Operation[Any, Answer],
        request: Request,
        progress: bool = True,
        *,
        executor: ExecutorConfig | None = None,
        processes: int | None = None,
    ) -> Answer:
        """The answer, once the work is done."""
        laboratory = Laboratory(self.store, self.url, processes=processes)
        if executor is not None:
            laboratory = replace(laboratory, executor=executor)
        return answer_of(operation, request, laboratory, progress)

    def ask(self, operation: Operation[Any, Answer], request: Request) -> JobHandle[Answer]:
        """The job, which `pyroshock work` or a server of this store does."""
        from .job_handle import LocalJobs

        return LocalJobs(self.store, self.url).ask(operation, request)


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
        stated = inspect.signature(function)
        first = [
            part
            for part in stated.parameters.values()
            if part.kind is not inspect.Parameter.VAR_KEYWORD
        ]
        function.__dict__["__signature__"] = stated.replace(
            parameters=[*first, *_parameters(request)]
        )
        text, *sections = _LATER_SECTION.split(inspect.getdoc(function) or "")
        rows = "\n".join(["Parameters:", *_rows(request)])
        function.__doc__ = "\n\n".join([text, rows, *sections])
        return function

    return documented


def positional_fields(request: type[Request]) -> list[str]:
    """Fields that may be given without their names, in their order."""
    fields = request.model_fields.items()
    return [name for name, field in fields if presentation_of(field).positional]


def signature(request: type[Request], operation: Operation[Any, Any]) -> inspect.Signature:
    """The parameters of a request as a method of the operation has them."""
    keyword = inspect.Parameter.KEYWORD_ONLY
    parameters = [inspect.Parameter("self", inspect.Parameter.POSITIONAL_ONLY)]
    parameters += _parameters(request)
    if operation.processes:
        parameters.append(inspect.Parameter("jobs", keyword, default=None))
    if operation.long:
        parameters.append(inspect.Parameter("progress", keyword, default=True))
        parameters.append(inspect.Parameter("wait", keyword, default=True))
    returned = getattr(operation.keep or operation.run, "__annotations__", {}).get("return", Any)
    return inspect.Signature(parameters, return_annotation=returned)


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
    paragraphs = [" ".join(part.split()) for part in text.split("\n\n")]
    rows = list(_rows(request))
    if operation.processes:
        rows.append(f"    jobs: {_python_words(operation.processes)}")
    if operation.long:
        rows.append("    progress: Show a bar. (default True)")
        rows.append("    wait: Wait for the result; else the work is a job, whose handle is given.")
    sections = ["Parameters:\n" + "\n".join(rows)] if rows else []
    return "\n\n".join([*paragraphs, *sections])


def _rows(request: type[Request]) -> Iterator[str]:
    for name, field in request.model_fields.items():
        if name == "method":
            continue
        unit = presentation_of(field).unit
        facts = [f"in {unit}, as text with a unit, or a quantity of pint"] if unit else []
        words = _python_words(field.description or "")
        stated = field.is_required() or "y default" in words
        if not stated and field.default not in (PydanticUndefined, None, "", (), {}):
            facts.append(f"default {field.default}")
        aside = f" ({'; '.join(facts)})" if facts else ""
        yield f"    {argument_of(name, field)}: {words}{aside}"


def _python_words(words: str) -> str:
    """Help of an option, as it is said of an argument."""
    words = _STATED_DEFAULT.sub(r"By default \1.", _REPEATED.sub("Several are a list.", words))
    return argument_names(words)
