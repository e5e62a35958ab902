"""The job of an operation: its arguments are the request as JSON, its ending keeps the result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from urllib.parse import quote

from ..common.number_format import finite
from ..operations.faults import read, read_variant
from ..operations.form import form_page, texts_of
from ..operations.laboratory import Laboratory
from ..operations.machine_paths import MachinePath, scratches_of
from ..operations.operation import Operation, Request, Result
from ..operations.upload_folders import discard
from .kept_result import whole_of
from .kind import Ending, JobForm, JobResult, Kind, RunningJob


def kind_of(operation: Operation[Any, Any]) -> Kind[Any]:
    """The kind of job that does an operation."""

    def do(work: RunningJob, request: Request) -> Ending:
        laboratory = Laboratory(work.store, work.db, folders=work.folders, job=work.job)
        made = operation.run(request, laboratory, work.step)

        def ending() -> JobResult:
            kept = made if operation.keep is None else operation.keep(made, laboratory)
            address = operation.result_page.format(job=work.job) or kept.address()
            return JobResult(address, kept.summary(), finite(_job_data(kept)), whole_of(kept))

        return ending

    return Kind(
        operation.name,
        operation.request,
        do,
        _keep_uploads if operation.keeps_uploads else discard_uploads,
        form=lambda request: _form(operation, request),
        read_stored=lambda stored: _read(operation, stored),
    )


def _keep_uploads(_: Request) -> None:
    pass


def discard_uploads(request: Request) -> None:
    """Remove the uploads that a request was about."""
    for scratch in scratches_of(request):
        discard(scratch)


def _read(operation: Operation[Any, Any], stored: Mapping[str, Any]) -> Request:
    requests = operation.requests()
    request: Request = (
        read_variant(requests, stored, "stored")
        if operation.variants
        else read(operation.request, stored, "stored")
    )
    return request


def _job_data(result: Result) -> Any:
    keys = result.stored_keys()
    return {**keys, **result.job_data()} if keys else result.job_data()


def _form(operation: Operation[Any, Any], request: Request) -> JobForm | None:
    if "form" in operation.absent and operation.form is None:
        return None
    shown = form_page(operation)
    values = {
        name: quote(text, safe="") for name, text in texts_of(request, everything=True).items()
    }
    address = shown.page.format(**values)
    if not shown.form:
        return JobForm(address)
    fields: dict[str, str | list[str]] = {}
    for name, text in texts_of(request).items():
        value = getattr(request, name)
        if isinstance(value, MachinePath) and value.scratch:  # a page cannot choose the files
            continue
        if f"{{{name}}}" in shown.page.partition("?")[0]:  # the address has it
            continue
        several = isinstance(value, tuple) and all(isinstance(part, str) for part in value)
        fields[name] = list(value) if several else text
    if not scratches_of(request):
        return JobForm(address, shown.form, fields)
    # the page tells that the files are to be sent again, also where all else is as usual
    return JobForm(address, shown.upload, fields or _usual_texts(request))


def _usual_texts(request: Request) -> dict[str, str | list[str]]:
    """The texts of fields that have one, without files and what is ticked."""
    return {
        name: text
        for name, text in texts_of(request, everything=True).items()
        if text and not isinstance(getattr(request, name), bool | MachinePath)
    }
