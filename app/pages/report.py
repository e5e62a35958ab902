"""Reports as files: a campaign, a diagnosis or a model as one page or PDF."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from starlette.responses import Response

from ..documents.document import Document
from ..documents.write import report_content
from ..doors.python import answer_of
from ..operations.faults import read
from ..operations.laboratory import Laboratory
from ..operations.report.report import REPORT, ReportRequest
from ..web.dependencies import Configured, Key, Name, OpenStore
from ..web.rendering import named_file

router = APIRouter(prefix="/reports")
Ending = Literal["html", "pdf"]
_TYPES = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}


@router.get("/campaign/{name}.{ending}")
def campaign(name: Name, ending: Ending, store: OpenStore, settings: Configured) -> Response:
    return _file(store, settings.db, f"campaign:{name}", name, ending)


@router.get("/diagnosis/{diagnosis}.{ending}")
def diagnosis(diagnosis: Key, ending: Ending, store: OpenStore, settings: Configured) -> Response:
    return _file(store, settings.db, f"diagnosis:{diagnosis}", f"diagnosis-{diagnosis}", ending)


@router.get("/model/{name}/{version}.{ending}")
def model(
    name: Name, version: Key, ending: Ending, store: OpenStore, settings: Configured
) -> Response:
    return _file(store, settings.db, f"models:/{name}@{version}", f"{name}-{version}", ending)


def _file(store: OpenStore, db: str, subject: str, name: str, ending: Ending) -> Response:
    request = read(ReportRequest, {"subject": subject}, "network")
    return report_file(answer_of(REPORT, request, Laboratory(store, db)).document, name, ending)


def report_file(document: Document, name: str, ending: Ending) -> Response:
    """A report as the file `name` with that ending."""
    return named_file(report_content(document, f".{ending}"), name, ending, _TYPES[ending])
