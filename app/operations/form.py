"""The form of an operation: a control for each field of its request, and how values are read."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from .faults import Fault, RequestError, bare, bounds, expectation, read, read_variant
from .fields import RecordedFile, TextFile, most_upload_bytes, presentation_of, spelling_of
from .operation import FormPage, Operation, Request

#: Ending of the control that takes a file for a field whose text can be pasted, too.
FILE = ".file"
#: How the help of a field says what holds where nothing is given.
_STATED_DEFAULT = re.compile(r"\s*\[default: ([^\]]+)\]")
#: What a hidden control sends for a checkbox that may be ticked.
UNTICKED = "false"


@dataclass(frozen=True)
class Control:
    """A control of a form, ready for a template.

    `kind` is checkbox, select, lines (a text of several lines), file, number, password or text;
    `choices` are the values of a select or the suggestions of a text; `usual` says what holds where
    the control is empty; `limits` are attributes of HTML.
    """

    name: str
    label: str
    help: str
    kind: str
    value: str
    required: bool
    usual: str = ""
    choices: tuple[str, ...] = ()
    limits: tuple[tuple[str, Any], ...] = ()
    methods: tuple[str, ...] = ()

    @property
    def id(self) -> str:
        """Its own where several methods have controls of one name."""
        return "-".join([self.name, *self.methods[:1]])


def form_page(operation: Operation[Any, Any]) -> FormPage:
    """The page with the form of an operation."""
    usual = f"/ask/{operation.name}"
    return operation.form or FormPage(usual, operation.name, usual)


def controls(
    operation: Operation[Any, Any],
    values: Mapping[str, str] | None = None,
    *,
    names: Collection[str] = (),
    suggestions: Mapping[str, Sequence[str]] | None = None,
    choices: Mapping[str, Sequence[str]] | None = None,
) -> list[Control]:
    """The controls of an operation's fields, in their order; `names`: of these alone.

    `suggestions` of a field are offered beside what is typed; where `choices` are all that it can
    be, it is a select.

    A field that only some variants have says so in `methods`, which `static/plan.js` reads.
    """
    by_control: dict[Control, list[str]] = {}
    for request in operation.requests():
        for name, field in request.model_fields.items():
            if name == "method" or (names and name not in names):
                continue
            given = (values or {}).get(name)
            control = _control(name, field, given, (suggestions or {}).get(name, ()))
            if choices and name in choices:
                control = replace(control, kind="select", choices=tuple(choices[name]), limits=())
            methods = by_control.setdefault(control, [])
            if operation.variants:
                methods.append(str(request.model_fields["method"].default))
    everywhere = len(operation.requests())
    return [
        control if len(methods) in (0, everywhere) else replace(control, methods=tuple(methods))
        for control, methods in by_control.items()
    ]


def _control(name: str, field: FieldInfo, value: str | None, choices: Sequence[str]) -> Control:
    shown, kind, limits = presentation_of(field), bare(field.annotation), bounds(field)
    default = "" if field.default is PydanticUndefined else _text_in(field, field.default)
    label = shown.label or name.replace("_", " ").capitalize()
    if shown.unit:
        label = f"{label} (with its unit, such as {(field.examples or [shown.unit])[0]})"
    attributes: dict[str, Any] = {"step": "any"} if kind is float and not shown.unit else {}
    attributes |= {
        html: limits[limit]
        for limit, html in (("ge", "min"), ("le", "max"), ("max_length", "maxlength"))
        if limit in limits and not (limit == "max_length" and get_origin(kind) is not None)
    }
    stated = _STATED_DEFAULT.search(field.description or "")
    return Control(
        name,
        label,
        _STATED_DEFAULT.sub("", field.description or "").strip(),
        "password" if shown.secret else _control_kind(kind, shown.lines, bool(shown.unit)),
        value if value is not None else default,
        field.is_required(),
        stated[1] if stated else "",
        tuple(choices) or (tuple(map(str, get_args(kind))) if get_origin(kind) is Literal else ()),
        tuple(attributes.items()),
    )


def _control_kind(kind: Any, lines: int, has_unit: bool) -> str:
    if kind is bool:
        return "checkbox"
    if get_origin(kind) is Literal:
        return "select"
    if kind in (TextFile, RecordedFile):
        return "file"
    if lines > 1:
        return "lines"
    return "number" if kind in (int, float) and not has_unit else "text"


def text_of(value: Any) -> str:
    """A value as a control holds it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, TextFile):
        return value.text
    if isinstance(value, Mapping):
        return ",".join(f"{key}={text_of(part)}" for key, part in value.items())
    if isinstance(value, tuple | list):
        if value and isinstance(value[0], tuple | list):
            return ";".join(",".join(map(str, part)) for part in value)
        return ",".join(map(text_of, value))
    return str(value)


def _text_in(field: FieldInfo, value: Any) -> str:
    """A value of a field as its control holds it."""
    spelling = spelling_of(field)
    if spelling is None or not isinstance(value, Mapping):
        return text_of(value)
    return ",".join(f"{key}={spelling.spell(key, part)}" for key, part in value.items())


def texts_of(request: BaseModel, *, everything: bool = False) -> dict[str, str]:
    """The values of a request by control: those that are not the default, or everything."""
    fields = type(request).model_fields
    values = {name: getattr(request, name) for name in fields}
    return {
        name: _text_in(fields[name], value)
        for name, value in values.items()
        if everything or name == "method" or value != fields[name].default
    }


def read_form(
    operation: Operation[Any, Any],
    sent: Mapping[str, Sequence[str]],
    folders: Sequence[Path] = (),
    files: Mapping[str, Any] | None = None,
) -> Request:
    """The request of a form, of which `sent` has all texts of each control: what was left empty has
    its default. `folders` are those that it may name, `files` what a route has read already.

    Raises `faults.RequestError`, whose faults name the controls.
    """
    values: dict[str, Any] = {}
    for name, texts in sent.items():
        field_name = name.removesuffix(FILE)
        filled = [text for text in texts if text.strip()]
        if len(filled) > 1:  # a hidden control stands before a checkbox
            filled = [text for text in filled if text != UNTICKED]
        if filled and (name == field_name or not values.get(field_name)):
            several = len(filled) > 1 and _takes_several(operation, field_name)
            values[field_name] = filled if several else ",".join(filled)
    values.update(files or {})
    missing = [name for name in form_page(operation).required if name not in values]
    if missing:
        fields = operation.request.model_fields
        raise RequestError(
            [
                Fault(
                    name,
                    f"{name} is missing; expected {expectation(fields[name], needed=True)}",
                )
                for name in missing
            ]
        )
    request: Request
    if operation.variants:
        request = read_variant(
            operation.requests(), _own_fields(operation, values), "network", folders
        )
    else:
        request = read(operation.request, _own_fields(operation, values), "network", folders)
    return request


def _takes_several(operation: Operation[Any, Any], name: str) -> bool:
    """Whether a field takes a list: of another one, the texts have commas between them."""
    fields = [request.model_fields.get(name) for request in operation.requests()]
    return any(
        get_origin(bare(field.annotation)) in (tuple, list) for field in fields if field is not None
    )


def is_recording(operation: Operation[Any, Any], name: str) -> bool:
    """Whether a field takes a file of any format, with its name."""
    field = operation.request.model_fields.get(name)
    return field is not None and bare(field.annotation) is RecordedFile


def upload_limits(operation: Operation[Any, Any]) -> dict[str, int]:
    """The largest file of each field that says what it takes."""
    limits = {
        name: most_upload_bytes(field)
        for request in operation.requests()
        for name, field in request.model_fields.items()
    }
    return {name: limit for name, limit in limits.items() if limit is not None}


def _own_fields(operation: Operation[Any, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Without what the form carries beside the fields: its token, and controls of other methods."""
    method = values.get("method")
    requests = [
        request
        for request in operation.requests()
        if method is None
        or not operation.variants
        or request.model_fields["method"].default == method
    ] or operation.requests()
    field_names = {name for request in requests for name in request.model_fields}
    return {name: value for name, value in values.items() if name in field_names}
