"""What is wrong with a request: said once, with field, value, what was expected and the cure.

A door changes the spelling of the field alone: `--tank-pressure` on the command line, the control
of a form, `"field"` in JSON.
"""

from __future__ import annotations

import re
import types
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

import annotated_types
from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from pydantic.warnings import UnsupportedFieldAttributeWarning

from ..common.unit_endings import unit_ending
from .fields import presentation_of
from .operation import Request

#: Where the values of a request come from, which says what a text of a file's field is: its path
#: (command), its path unless it has lines (python), or its content (network, and jobs as stored).
Source = Literal["command", "python", "network", "stored"]

_NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")
Asked = TypeVar("Asked", bound=Request)


@dataclass(frozen=True)
class Fault:
    """`message` begins with the name of the `field`; "" of what is about several fields."""

    field: str
    message: str

    def spelled(self, name: str) -> str:
        """The message with the field spelled `name`."""
        return (
            name + self.message.removeprefix(self.field)
            if self.field and self.message.startswith(self.field)
            else self.message
        )


def spelled_as(fault: Fault, request: type[Request], spell: Callable[[str, FieldInfo], str]) -> str:
    """The message with its field as `spell` has it, and other fields that it names with a unit."""
    if (field := request.model_fields.get(fault.field)) is None:
        return fault.message
    message = fault.spelled(spell(fault.field, field))
    for name, other in request.model_fields.items():
        if name != fault.field and unit_ending(name) is not None:
            message = re.sub(rf"\b{name}\b", spell(name, other), message)
    return message


class FieldError(ValueError):
    """A value of one field of a form that cannot be used. `field`: the name of its control."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


@contextmanager
def about_field(name: str) -> Iterator[None]:
    """What is looked up because a field names it: a form shows the error beside that field."""
    try:
        yield
    except LookupError as error:
        error.field = name  # type: ignore[attr-defined]  # `web.forms.field_of` reads it
        raise


class UnknownValueError(LookupError):
    """A value of one field names something that there is not. `field`: the name of its control."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


class RequestError(ValueError):
    """A request that cannot be used; `faults` tell each field."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__("\n  ".join(fault.message for fault in faults))
        self.faults = tuple(faults)


@contextmanager
def about(field: str) -> Iterator[None]:
    """Errors within are about this field, so that a form shows them beside its control."""
    try:
        yield
    except (LookupError, ValueError) as error:
        error.__dict__.setdefault("field", field)
        raise


def read(
    request: type[Asked],
    values: Mapping[str, Any],
    source: Source,
    folders: Sequence[Path] = (),
) -> Asked:
    """The request of these values; `folders` are those that the network may name. Raises
    `RequestError`."""
    context = {"source": source, "folders": folders}
    try:
        return request.model_validate(dict(values), context=context)
    except ValidationError as error:
        raise RequestError(list(faults_of(error, request))) from error
    except _WRONG_KIND as error:
        raise RequestError(list(_faults_of_kind(request, values, context, error))) from error


#: What the reading of a field raises for a value of a kind that it was not written for: a list in
#: place of a mapping, a name that is a list.
_WRONG_KIND = (TypeError, AttributeError, KeyError, IndexError)


def _faults_of_kind(
    request: type[Request], values: Mapping[str, Any], context: Any, error: Exception
) -> Iterator[Fault]:
    """A fault for each field that cannot read its value by itself; one for the whole request where
    each can."""
    unread = []
    for name, value in values.items():
        field = request.model_fields.get(name)
        if field is None:
            continue
        try:
            with warnings.catch_warnings():
                # that a default is checked, too, means nothing for a value that is there
                warnings.simplefilter("ignore", UnsupportedFieldAttributeWarning)
                kind: Any = Annotated[field.annotation, field]
                adapter: TypeAdapter[Any] = TypeAdapter(kind)
            adapter.validate_python(value, context=context)
        except ValidationError as refusal:  # its fault is told beside the others
            unread += [
                _fault({**item, "loc": (name, *item["loc"])}, request) for item in refusal.errors()
            ]
        except _WRONG_KIND:  # the fault says it, as any other value that cannot be used
            unread.append(
                Fault(name, f"{name} is {_shown(value, field)}; expected {expectation(field)}")
            )
    yield from unread or [Fault("", f"a value is of the wrong kind: {error}")]


def read_arguments(request: type[Asked], given: Mapping[str, Any]) -> Asked:
    """The request of arguments, which may be called as its fields are. Raises `RequestError`."""
    names = {argument_of(name, field): name for name, field in request.model_fields.items()}
    try:
        return read(
            request, {names.get(name, name): part for name, part in given.items()}, "python"
        )
    except RequestError as error:
        spelled = [
            Fault(fault.field, spelled_as(fault, request, argument_of)) for fault in error.faults
        ]
        raise RequestError(spelled) from error


def argument_of(name: str, field: FieldInfo) -> str:
    """What Python calls a field."""
    return presentation_of(field).argument or name


def read_variant(
    requests: Sequence[type[Asked]],
    values: Mapping[str, Any],
    source: Source,
    folders: Sequence[Path] = (),
) -> Asked:
    """The request of that variant whose `method` the values name; the first where they name none.

    Raises `RequestError`.
    """
    by_method = {str(request.model_fields["method"].default): request for request in requests}
    given = values.get("method")
    method = next(iter(by_method)) if given in (None, "") else str(given)
    if method not in by_method:
        words = f"method is {given!r}; expected one of {', '.join(by_method)}"
        raise RequestError([Fault("method", words)])
    return read(by_method[method], {**values, "method": method}, source, folders)


def faults_of(error: ValidationError, request: type[Request]) -> Iterator[Fault]:
    """A fault for each value that cannot be used, in the order of the request's fields."""
    for item in error.errors():
        yield _fault(item, request)


def _fault(item: Any, request: type[Request]) -> Fault:
    path = [str(part) for part in item["loc"]]
    name = path[0] if path else ""
    field = request.model_fields.get(name)
    kind, value = item["type"], item.get("input")
    if kind in ("value_error", "assertion_error"):
        problem = item["ctx"]["error"]
        return Fault(name or getattr(problem, "field", ""), str(problem))
    if kind == "missing":
        return Fault(name, f"{name} is missing; expected {expectation(field, needed=True)}")
    if kind == "extra_forbidden":
        field_names = ", ".join(field for field in request.model_fields if field != "method")
        return Fault(name, f"{name} is not known; known: {field_names}")
    expected = expectation(field) if field is not None else item["msg"]
    return Fault(name, f"{name} is {_shown(value, field)}; expected {expected}")


def _shown(value: object, field: FieldInfo | None) -> str:
    """A value as it was given; a number that came as a text, as from a form, as a number."""
    is_number = field is not None and bare(field.annotation) in (int, float)
    text = str(value) if is_number and _NUMBER.fullmatch(str(value)) else repr(value)
    return text if len(text) <= 200 else f"{text[:200]}…"


def bare(annotation: Any) -> Any:
    """The type of a field that may also be None."""
    if get_origin(annotation) in (Union, types.UnionType):
        kinds = [kind for kind in get_args(annotation) if kind is not type(None)]
        return bare(kinds[0]) if len(kinds) == 1 else annotation
    if hasattr(annotation, "__metadata__"):
        return bare(annotation.__origin__)
    return annotation


def bounds(field: FieldInfo) -> dict[str, Any]:
    """`ge`, `gt`, `le`, `lt`, `min_length`, `max_length` of a field, also of those within a union
    with None."""
    limits: dict[str, Any] = {}
    metadata = [*field.metadata]
    pending = [field.annotation]
    while pending:
        annotation = pending.pop()
        metadata += getattr(annotation, "__metadata__", ())
        pending += [kind for kind in get_args(annotation) if kind is not type(None)]
    for entry in metadata:
        if isinstance(entry, FieldInfo):
            metadata_of_field = entry.metadata
        elif isinstance(entry, annotated_types.GroupedMetadata):
            metadata_of_field = list(entry)
        else:
            metadata_of_field = [entry]
        for limit in metadata_of_field:
            for name in ("ge", "gt", "le", "lt", "min_length", "max_length"):
                value = getattr(limit, name, None)
                if value is not None:
                    limits[name] = value
    return limits


def expectation(field: FieldInfo | None, *, needed: bool = False) -> str:
    """What a field takes: `a whole number from 1 to 2000`; `needed`: its default is not taken."""
    if field is None:
        return "a value"
    kind, limits = bare(field.annotation), bounds(field)
    if words := getattr(kind, "expected", ""):
        return str(words)
    if get_origin(kind) is Literal:
        return f"one of {', '.join(map(str, get_args(kind)))}"
    if kind is bool:
        return "true or false"
    if kind in (int, float):
        return _number_words("a whole number" if kind is int else "a number", limits)
    if kind is str:
        least, most = limits.get("min_length", 0), limits.get("max_length")
        if least:
            return "a text" + (f" of at most {most:,} characters" if most else "")
        return f"a text of at most {most:,} characters" if most else "a text"
    if get_origin(kind) in (tuple, list):
        most = limits.get("max_length")
        if needed or field.is_required():
            return "at least one value" + (f", and at most {most}" if most else "")
        return f"a list of at most {most} values" if most else "a list of values"
    return "a value that it can take"


def _number_words(noun: str, limits: Mapping[str, Any]) -> str:
    low = limits.get("ge", limits.get("gt"))
    high = limits.get("le", limits.get("lt"))
    if low is not None and high is not None and "ge" in limits and "le" in limits:
        return f"{noun} from {low:g} to {high:.10g}"
    words = [noun]
    if low is not None:
        words.append(f"of {low:g} or more" if "ge" in limits else f"above {low:g}")
    if high is not None:
        words.append(f"up to {high:.10g}" if "le" in limits else f"below {high:.10g}")
    return ", ".join([" ".join(words[:2]), *words[2:]]) if len(words) > 1 else noun
