"""The description of the JSON API for its pages: routes by topic with their fields, bounds, units,
answers and examples.

All of it is made of the OpenAPI document that the application serves, and of what operations say of
their requests beyond a JSON schema: units, and which only read.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from ..common.quantities import display_of, shown_in
from ..operations.catalogue import operations
from ..operations.fields import presentation_of
from ..operations.operation import Operation
from .api_examples import CLIENT_CALLS, Example, example_of, example_value
from .api_field import ApiField

Json = Mapping[str, Any]
_METHODS = ("get", "post")
#: Operations whose route is POST because their request is large; they store nothing.
READING_POSTS = frozenset(
    {"predict", "query", "srs", "series-spectrum", "impact-preview", "calibrate"}
)


@dataclass(frozen=True)
class ApiRoute:
    """A route with its fields. `kind`: "reads", "changes" the store, or makes a "job".

    `page` is the page of the application that does the same; `media` the type of its body.
    """

    method: str
    path: str
    text: str
    fields: tuple[ApiField, ...]
    answer: tuple[ApiField, ...]
    answer_type: str
    example: Example
    media: str
    kind: str
    page: str = ""
    methods: tuple[str, ...] = ()

    @property
    def anchor(self) -> str:
        """Of its page."""
        plain = self.path.replace("/", "-").replace("{", "").replace("}", "")
        return f"{self.method.lower()}{plain}"

    @property
    def summary(self) -> str:
        """The first sentence of its text."""
        first = " ".join(self.text.partition("\n\n")[0].split())
        sentence = first.partition(". ")[0]
        return sentence if sentence.endswith(".") else f"{sentence}."

    @property
    def words(self) -> str:
        """What a search looks through."""
        named = " ".join(row.name for row in self.fields)
        return f"{self.method} {self.path} {self.text} {named}".lower()


def routes_by_topic(document: Json, origin: str) -> dict[str, list[ApiRoute]]:
    """All routes of an OpenAPI document, by their tags; `origin` is the server's address in the
    examples."""
    topics: dict[str, list[ApiRoute]] = {}
    for path, methods in document["paths"].items():
        for method in _METHODS:
            if method in methods:
                described = methods[method]
                topic = (described.get("tags") or ["other"])[0]
                topics.setdefault(topic, []).append(
                    _Reader(document).route(origin, path, method, described)
                )
    return topics


@cache
def _operations_by_route() -> dict[tuple[str, str], Operation[Any, Any]]:
    by_route = {}
    for operation in operations():
        method, address = operation.route or ("POST", f"/{operation.name}")
        by_route[method.lower(), f"/api{address}"] = operation
        if operation.also_posted:
            by_route["post", f"/api{address}"] = operation
    return by_route


@dataclass(frozen=True)
class _Reader:
    """Reads routes of one document."""

    document: Json

    def route(self, origin: str, path: str, method: str, described: Json) -> ApiRoute:
        operation = _operations_by_route().get((method, path))
        media, schema = self._body(described)
        variants = [self._resolved(part) for part in schema.get("oneOf", ())]
        fields = (
            *self._parameters(described),
            *(self._of_variants(variants) if variants else self._fields(schema, "body")),
        )
        answer = self._resolved(self._answer(described))
        inner = self._resolved(answer.get("items", {})) if answer.get("type") == "array" else answer
        units = {} if operation is None else _units(operation)
        fields = tuple(_with_unit(row, units) for row in fields)
        methods = tuple(str(part["properties"]["method"]["const"]) for part in variants)
        sent = {row.name: example_value(row) for row in fields if _is_sent(row, methods)}
        if methods:
            sent = {"method": methods[0], **sent}
        return ApiRoute(
            method.upper(),
            path,
            described.get("description") or described.get("summary", ""),
            fields,
            tuple(self._fields(inner, "answer")),
            self._type(answer) or self._answer_type(described),
            example_of(origin, path, method, media, fields, sent, _client_call(operation)),
            media,
            _kind(method, operation),
            "" if operation is None or operation.form is None else _page_of(operation),
            methods,
        )

    def _resolved(self, schema: Json) -> Json:
        """A schema itself in the place of a reference to it."""
        if "$ref" not in schema:
            return schema
        target: Json = self.document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
        return target

    def _parameters(self, described: Json) -> Iterator[ApiField]:
        for item in described.get("parameters", ()):
            schema = {"description": item.get("description", ""), **item.get("schema", {})}
            yield self._field(item["name"], item["in"], schema, bool(item.get("required")))

    def _body(self, described: Json) -> tuple[str, Json]:
        """Media type and schema of what a write sends; ("", {}) for a read."""
        for media, content in described.get("requestBody", {}).get("content", {}).items():
            return media, self._resolved(content.get("schema", {}))
        return "", {}

    @staticmethod
    def _answer(described: Json) -> Json:
        content = described.get("responses", {}).get("200", {}).get("content", {})
        schema: Json = content.get("application/json", {}).get("schema", {})
        return schema

    @staticmethod
    def _answer_type(described: Json) -> str:
        content = described.get("responses", {}).get("200", {}).get("content", {})
        return "JSON" if "application/json" in content else next(iter(content), "JSON")

    def _of_variants(self, variants: Sequence[Json]) -> Iterator[ApiField]:
        """The fields of a body that is one of several, each once for those that have it so."""
        by_field: dict[ApiField, list[str]] = {}
        for schema in variants:
            method = str(schema["properties"]["method"]["const"])
            for row in self._fields(schema, "body"):
                if row.name != "method":
                    by_field.setdefault(row, []).append(method)
        for row, methods in by_field.items():
            own = () if len(methods) == len(variants) else tuple(methods)
            yield ApiField(**{**vars(row), "methods": own})

    def _fields(self, schema: Json, place: str) -> Iterator[ApiField]:
        required = schema.get("required", ())
        for name, item in schema.get("properties", {}).items():
            yield self._field(name, place, item, name in required)

    def _field(self, name: str, place: str, schema: Json, required: bool) -> ApiField:
        with shown_in("si"):
            unit = display_of(name).unit
        default = schema.get("default")
        inner = self._inner(schema)
        limits = {
            "min": inner.get("minimum", inner.get("exclusiveMinimum")),
            "max": inner.get("maximum", inner.get("exclusiveMaximum")),
            "maxlength": inner.get("maxLength"),
        }
        examples = [*schema.get("examples", ()), *inner.get("examples", ())]
        return ApiField(
            name,
            place,
            self._type(schema),
            unit,
            required,
            "" if default is None else json.dumps(default),
            " ".join(str(schema.get("description", "")).split()),
            _bounds(inner),
            self._control(inner),
            _choices(inner),
            tuple((key, f"{value}") for key, value in limits.items() if value is not None),
            str(examples[0]) if examples else "",
        )

    def _inner(self, schema: Json) -> Json:
        """The schema of a value that may also be null."""
        schema = self._resolved(schema)
        kinds = [part for part in schema.get("anyOf", ()) if part.get("type") != "null"]
        return self._resolved(kinds[0]) if len(kinds) == 1 else schema

    @staticmethod
    def _control(inner: Json) -> str:
        if _choices(inner):
            return "select"
        kind, items = inner.get("type"), inner.get("items", {})
        if kind == "array" and items.get("type") in ("string", "integer", "number"):
            return "lines"
        return {"integer": "number", "number": "number", "string": "text"}.get(str(kind), "json")

    def _type(self, schema: Json) -> str:
        """`integer`, `list of string`, `one of gun, hammer`."""
        schema = self._resolved(schema)
        if "anyOf" in schema:
            names = [self._type(item) for item in schema["anyOf"] if item.get("type") != "null"]
            return " or ".join(dict.fromkeys(filter(None, names)))
        if "enum" in schema:
            return f"one of {', '.join(map(str, schema['enum']))}"
        if schema.get("type") == "array":
            return f"list of {self._type(schema.get('items', {})) or 'values'}"
        return str(schema.get("type", ""))


def _choices(inner: Json) -> tuple[str, ...]:
    if inner.get("type") == "boolean":
        return ("true", "false")
    return tuple(map(str, inner.get("enum", ())))


def _bounds(inner: Json) -> str:
    """`1 to 500`, `above 0`, `at most 1000 characters`."""
    low, high = inner.get("minimum"), inner.get("maximum")
    words = []
    if low is not None and high is not None:
        words.append(f"{low:.10g} to {high:.10g}")
    elif low is not None or high is not None:
        words.append(f"at least {low:.10g}" if low is not None else f"at most {high:.10g}")
    if (above := inner.get("exclusiveMinimum")) is not None:
        words.append(f"above {above:.10g}")
    if (below := inner.get("exclusiveMaximum")) is not None:
        words.append(f"below {below:.10g}")
    if (most := inner.get("maxLength")) is not None:
        words.append(f"at most {most:,} characters")
    if (most := inner.get("maxItems")) is not None:
        words.append(f"at most {most:,} values")
    return ", ".join(words)


def _units(operation: Operation[Any, Any]) -> dict[str, str]:
    """Field -> the SI unit of its number."""
    return {
        name: presentation_of(field).unit
        for request in operation.requests()
        for name, field in request.model_fields.items()
        if presentation_of(field).unit
    }


def _with_unit(row: ApiField, units: Mapping[str, str]) -> ApiField:
    unit = units.get(row.name)
    # JSON takes a number in SI as well as a text with a unit: a control for both is one of texts.
    return row if unit is None else ApiField(**{**vars(row), "unit": unit, "control": "text"})


def _is_sent(row: ApiField, methods: Sequence[str]) -> bool:
    """Whether an example has the field: those that a request cannot do without."""
    own = not row.methods or row.methods[0] == methods[0]
    return row.place == "body" and row.required and own


def _kind(method: str, operation: Operation[Any, Any] | None) -> str:
    if operation is not None and operation.long:
        return "job"
    reads = method == "get" or (operation is not None and operation.name in READING_POSTS)
    return "reads" if reads else "changes"


def _page_of(operation: Operation[Any, Any]) -> str:
    """The page with the form of an operation, where its address names nothing of the store."""
    assert operation.form is not None
    return "" if "{" in operation.form.page else operation.form.page


def _client_call(operation: Operation[Any, Any] | None) -> str:
    return "" if operation is None else CLIENT_CALLS.get(operation.name, "")
