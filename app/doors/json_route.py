"""The JSON route of an operation, with its entry in the OpenAPI description."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from fastapi import APIRouter, Depends
from starlette.requests import Request as HttpRequest

from ..common.number_format import finite
from ..operations.catalogue import topic_of
from ..operations.faults import Fault, RequestError, read, read_variant
from ..operations.fields import without_presentation
from ..operations.operation import Asked, Operation, Request
from ..web.dependencies import InLaboratory, Running
from ..web.guard import INNER_SLASH
from ..web.jobs import ask_operation
from ..web.result_answer import result_answer, wants_result
from ..web.role_needs import role_of


def add_route(router: APIRouter, operation: Operation[Any, Any]) -> None:
    """Offer an operation below /api: the answer as JSON, or the job that works on it."""
    method, address = operation.route or ("POST", f"/{operation.name}")
    _add(router, operation, method, address)
    if operation.also_posted:
        _add(router, operation, "POST", address)


def _add(router: APIRouter, operation: Operation[Any, Any], method: str, address: str) -> None:
    def endpoint(
        http: HttpRequest,
        body: Annotated[bytes, Depends(_body)],
        laboratory: InLaboratory,
        running: Running,
    ) -> Any:
        values = {**_sent(http, method, body), **in_address(http)}
        request = _request(operation, values, laboratory.folders or ())
        if operation.long:
            return ask_operation(operation, request, laboratory, running).as_json()
        if operation.check is not None:
            operation.check(request, laboratory)
        answer = operation.answer(request, laboratory, _no_progress)
        return result_answer(answer) if wants_result(http) else finite(answer.to_network_json())

    router.add_api_route(
        address,
        endpoint,
        methods=[method],
        dependencies=[Depends(role_of(operation))],
        name=operation.name,
        summary=operation.help.partition("\n")[0],
        description=f"{operation.help}\n\nIt needs the role {operation.needed_role}.",
        tags=[topic_of(operation.name)],
        openapi_extra=_openapi(operation, method, address),
    )


async def _body(http: HttpRequest) -> bytes:
    return await http.body()


def _no_progress(_done: int, _total: int, _what: str) -> None:
    pass


def in_address(http: HttpRequest) -> dict[str, str]:
    """The fields of a request that stand in the address."""
    return {name: str(text).replace(INNER_SLASH, "/") for name, text in http.path_params.items()}


def _sent(http: HttpRequest, method: str, body: bytes) -> dict[str, Any]:
    if method == "GET":
        return _of_pairs(http.query_params.multi_items())
    try:
        values = json.loads(body or b"{}", parse_constant=_no_number)
    except ValueError as error:
        raise RequestError([Fault("", f"the body is no JSON: {error}")]) from error
    if not isinstance(values, dict):
        raise RequestError([Fault("", f"the body is {type(values).__name__}; expected an object")])
    return values


def read_pairs(request: type[Asked], pairs: Sequence[tuple[str, str]]) -> Asked:
    """The request in fields of an address. Raises `RequestError`."""
    return read(request, _of_pairs(pairs), "network")


def _of_pairs(pairs: Sequence[tuple[str, str]]) -> dict[str, Any]:
    """A field that stands there several times is a list."""
    texts: dict[str, list[str]] = {}
    for name, text in pairs:
        texts.setdefault(name, []).append(text)
    return {name: own[0] if len(own) == 1 else own for name, own in texts.items()}


def _no_number(constant: str) -> Any:
    """JSON has neither NaN nor infinities, which Python would read."""
    raise ValueError(f"{constant} is no number of JSON ({constant.lower()})")


def _request(
    operation: Operation[Any, Any], values: Mapping[str, Any], folders: Sequence[Path]
) -> Request:
    request: Request
    if operation.variants:
        request = read_variant(operation.requests(), values, "network", folders)
    else:
        request = read(operation.request, values, "network", folders)
    return request


# --- its entry in the description


def _openapi(operation: Operation[Any, Any], method: str, address: str) -> dict[str, Any]:
    schemas = [_schema(request) for request in operation.requests()]
    of_address = [
        {"name": name, "in": "path", "required": True, "schema": part}
        for name, part in schemas[0]["properties"].items()
        if f"{{{name}}}" in address
    ]
    if method == "GET":
        required = schemas[0].get("required", ())
        of_query = [
            {
                "name": name,
                "in": "query",
                "required": name in required,
                "schema": part,
                "description": part.get("description", ""),
            }
            for name, part in schemas[0]["properties"].items()
            if f"{{{name}}}" not in address
        ]
        return {"parameters": of_address + of_query}
    for schema in schemas:
        for entry in of_address:
            schema["properties"].pop(entry["name"], None)
            if entry["name"] in schema.get("required", ()):
                schema["required"].remove(entry["name"])
    body = schemas[0] if len(schemas) == 1 else {"oneOf": schemas}
    content = {"application/json": {"schema": body}}
    return {
        "parameters": of_address,
        "requestBody": {"required": bool(body.get("required")), "content": content},
    }


def _schema(request: type[Request]) -> dict[str, Any]:
    """The schema of a request without references, which would point into this part alone."""
    schema = without_presentation(request.model_json_schema(mode="validation"))
    definitions = schema.pop("$defs", {})
    whole: dict[str, Any] = _resolved(schema, definitions)
    return whole


def _resolved(schema: Any, definitions: Mapping[str, Any]) -> Any:
    if isinstance(schema, list):
        return [_resolved(part, definitions) for part in schema]
    if not isinstance(schema, dict):
        return schema
    reference = schema.get("$ref")
    if reference is not None:
        named = definitions[reference.rsplit("/", 1)[-1]]
        return _resolved({**named, **{k: v for k, v in schema.items() if k != "$ref"}}, definitions)
    return {key: _resolved(part, definitions) for key, part in schema.items()}
