"""The page of an operation's form, and what answers when it is sent: the page of a result, the page
of its job, or the faults beside their controls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from fastapi import APIRouter, Depends
from starlette.datastructures import UploadFile
from starlette.requests import Request as HttpRequest
from starlette.responses import RedirectResponse, Response

from ..operations.faults import Fault, RequestError, read
from ..operations.fields import RecordedFile
from ..operations.form import FILE, controls, form_page, is_recording, read_form, upload_limits
from ..operations.laboratory import Laboratory
from ..operations.operation import Operation, Request
from ..web.dependencies import InLaboratory, Running
from ..web.jobs import ask_operation, followed
from ..web.rendering import page
from ..web.role_needs import role_of
from .json_route import in_address

#: Larger files are given by their path, but to fields that say what they take.
_MOST_BYTES = 2_000_000


async def sent_texts(http: HttpRequest) -> dict[str, list[str]]:
    """The texts of each control and of each file that was sent, and what the address holds."""
    return await _sent(http, {})


async def _sent(http: HttpRequest, limits: Mapping[str, int]) -> dict[str, list[str]]:
    """`limits` are the largest files of the fields that say it; such a file is no text."""
    texts: dict[str, list[str]] = {}
    http.state.uploads = {}
    async with http.form() as form:
        for name, value in form.multi_items():
            if isinstance(value, UploadFile):
                field_name = name.removesuffix(FILE)
                most_bytes = limits.get(field_name, _MOST_BYTES)
                content = await value.read(most_bytes + 1)
                if len(content) > most_bytes:
                    words = f"{value.filename!r:.120} has more than {most_bytes:,} bytes"
                    raise RequestError([Fault(name, f"{name}: {words}; expected a smaller file")])
                if field_name not in limits:
                    texts[name] = [content.decode("utf-8-sig", "replace")]
                if value.filename:
                    uploaded = RecordedFile(name=value.filename, content=content)
                    http.state.uploads[field_name] = uploaded
            else:
                texts.setdefault(name, []).append(value)
    return texts | {name: [text] for name, text in in_address(http).items()}


SentTexts = Annotated[Mapping[str, list[str]], Depends(sent_texts)]


def add_form(router: APIRouter, operation: Operation[Any, Any]) -> None:
    """Answer the form of an operation, and show it where no page of its own does."""
    action = form_page(operation).action
    limits = upload_limits(operation)

    async def texts_sent(http: HttpRequest) -> dict[str, list[str]]:
        return await _sent(http, limits)

    def send(
        http: HttpRequest,
        laboratory: InLaboratory,
        running: Running,
        texts: Mapping[str, list[str]] = Depends(texts_sent),
    ) -> Response:
        files = {
            name: uploaded
            for name, uploaded in http.state.uploads.items()
            if is_recording(operation, name)
        }
        request = read_form(operation, texts, laboratory.folders or (), files)
        if operation.long:
            return followed(ask_operation(operation, request, laboratory, running))
        if operation.check is not None:
            operation.check(request, laboratory)
        return tell(http, request, laboratory)

    def tell(http: HttpRequest, request: Request, laboratory: Laboratory) -> Response:
        answer = operation.answer(request, laboratory, lambda _done, _total, _what: None)
        if fault := answer.fault():
            raise ValueError(fault)
        if operation.answered_here:
            return page(http, "answer.html", operation=operation, answer=answer)
        return RedirectResponse(answer.address(), 303)

    def show(http: HttpRequest, laboratory: InLaboratory) -> Response:
        if operation.listing:
            request = read(operation.request, dict(http.query_params), "network")
            return tell(http, request, laboratory)
        return page(
            http,
            "operation.html",
            operation=operation,
            controls=controls(operation, dict(http.query_params)),
            methods=[request.model_fields["method"].default for request in operation.variants],
        )

    needed = [Depends(role_of(operation))]
    if action:
        router.add_api_route(action, send, methods=["POST"], dependencies=needed)
    if operation.form is None:
        router.add_api_route(action, show, methods=["GET"], dependencies=needed)
