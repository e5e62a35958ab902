"""The description of the JSON API for its page: routes by topic with parameters, units, answers and
examples.

All of it is made of the OpenAPI document that the application serves.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ..common.quantities import display_of, shown_in

Json = Mapping[str, Any]
_METHODS = ("get", "post")
#: What an example writes for a value of a type, where the schema has no default.
_EXAMPLES: dict[str, Any] = {
    "integer": 1,
    "number": 1.0,
    "boolean": True,
    "array": [],
    "object": {},
    "string": "NAME",
}


@dataclass(frozen=True)
class ApiField:
    """A parameter or a field of a body or an answer. `place`: "path", "query", "body" or
    "answer"."""

    name: str
    place: str
    type: str
    unit: str
    required: bool
    default: str


@dataclass(frozen=True)
class ApiRoute:
    """A route with its fields, and how to call it from a shell and from Python."""

    method: str
    path: str
    text: str
    fields: tuple[ApiField, ...]
    answer: tuple[ApiField, ...]
    answer_type: str
    curl: str
    python: str

    @property
    def anchor(self) -> str:
        """Of the page."""
        return (
            f"{self.method.lower()}{self.path.replace('/', '-').replace('{', '').replace('}', '')}"
        )


def routes_by_topic(document: Json, origin: str) -> dict[str, list[ApiRoute]]:
    """All routes of an OpenAPI document, by their tags; `origin` is the server's address in the
    examples."""
    topics: dict[str, list[ApiRoute]] = {}
    for path, methods in document["paths"].items():
        for method in _METHODS:
            if method in methods:
                operation = methods[method]
                topic = (operation.get("tags") or ["other"])[0]
                topics.setdefault(topic, []).append(
                    _route(document, origin, path, method, operation)
                )
    return topics


def _route(document: Json, origin: str, path: str, method: str, operation: Json) -> ApiRoute:
    parameters = tuple(_parameters(document, operation))
    media, schema = _body(document, operation)
    body = tuple(_fields(document, schema, "body"))
    answer = _resolved(document, _answer(operation))
    inner = (
        _resolved(document, answer.get("items", {})) if answer.get("type") == "array" else answer
    )
    wanted = {item.name: _example(document, schema, item.name) for item in body if item.required}
    address = _address(path, parameters)
    return ApiRoute(
        method.upper(),
        path,
        operation.get("description") or operation.get("summary", ""),
        parameters + body,
        tuple(_fields(document, inner, "answer")),
        _type(document, answer) or "JSON",
        _curl(f"{origin}{address}", method, media, wanted),
        _python(address, method, media, wanted),
    )


def _resolved(document: Json, schema: Json) -> Json:
    """A schema itself in the place of a reference to it."""
    if "$ref" not in schema:
        return schema
    target: Json = document["components"]["schemas"][schema["$ref"].rsplit("/", 1)[1]]
    return target


def _parameters(document: Json, operation: Json) -> Iterator[ApiField]:
    for item in operation.get("parameters", ()):
        schema = item.get("schema", {})
        yield _field(document, item["name"], item["in"], schema, bool(item.get("required")))


def _body(document: Json, operation: Json) -> tuple[str, Json]:
    """Media type and schema of what a write sends; ("", {}) for a read."""
    for media, content in operation.get("requestBody", {}).get("content", {}).items():
        return media, _resolved(document, content.get("schema", {}))
    return "", {}


def _answer(operation: Json) -> Json:
    content = operation.get("responses", {}).get("200", {}).get("content", {})
    schema: Json = content.get("application/json", {}).get("schema", {})
    return schema


def _fields(document: Json, schema: Json, place: str) -> Iterator[ApiField]:
    required = schema.get("required", ())
    for name, item in schema.get("properties", {}).items():
        yield _field(document, name, place, item, name in required)


def _field(document: Json, name: str, place: str, schema: Json, required: bool) -> ApiField:
    with shown_in("si"):
        unit = display_of(name).unit
    default = schema.get("default")
    shown = "" if default is None else json.dumps(default)
    return ApiField(name, place, _type(document, schema), unit, required, shown)


def _type(document: Json, schema: Json) -> str:
    """`integer`, `list of string`, `one of gun, hammer`."""
    schema = _resolved(document, schema)
    if "anyOf" in schema:
        names = [_type(document, item) for item in schema["anyOf"] if item.get("type") != "null"]
        return " or ".join(dict.fromkeys(filter(None, names)))
    if "enum" in schema:
        return f"one of {', '.join(map(str, schema['enum']))}"
    if schema.get("type") == "array":
        return f"list of {_type(document, schema.get('items', {})) or 'values'}"
    return str(schema.get("type", ""))


def _example(document: Json, schema: Json, name: str) -> Any:
    item = _resolved(document, schema["properties"][name])
    item = _resolved(document, next(iter(item.get("anyOf", ())), item))
    return item.get("default", item.get("enum", [_EXAMPLES.get(item.get("type", ""), "VALUE")])[0])


def _address(path: str, parameters: tuple[ApiField, ...]) -> str:
    """The path with names in capitals, and with the parameters that it cannot do without."""
    for item in parameters:
        path = path.replace(f"{{{item.name}}}", item.name.upper())
    needed = "&".join(
        f"{item.name}=VALUE" for item in parameters if item.place == "query" and item.required
    )
    return f"{path}?{needed}" if needed else path


def _curl(address: str, method: str, media: str, body: Json) -> str:
    if method == "get":
        return f"curl '{address}'"
    # the name of a shell's variable
    token = '-b cookies.txt -H "X-CSRF-Token: $TOKEN"'  # noqa: S105
    if media.startswith("multipart/"):
        return f"curl {token} -F 'files=@FILE' '{address}'"
    return f"curl {token} -H 'Content-Type: application/json' -d '{json.dumps(body)}' '{address}'"


def _python(address: str, method: str, media: str, body: Json) -> str:
    if media.startswith("multipart/"):
        return ""  # the standard library has no upload of files
    return f'call("{address}")' if method == "get" else f'call("{address}", {body!r})'
