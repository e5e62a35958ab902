"""Reports as files: a campaign, a diagnosis or a model as one page or PDF."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter
from starlette.responses import Response

from ..documents.document import Document
from ..documents.write import report_content
from ..report.dispatch import CAMPAIGN, DIAGNOSIS, MODEL, report_on
from ..web.dependencies import Configured, Key, Name, OpenStore
from ..web.rendering import named_file

router = APIRouter(prefix="/reports")
Ending = Literal["html", "pdf"]
_TYPES = {"html": "text/html; charset=utf-8", "pdf": "application/pdf"}


@router.get("/campaign/{name}.{ending}")
def campaign(name: Name, ending: Ending, store: OpenStore, settings: Configured) -> Response:
    return _file(store, settings.db, f"{CAMPAIGN}{name}", name, ending)


@router.get("/diagnosis/{diagnosis}.{ending}")
def diagnosis(diagnosis: Key, ending: Ending, store: OpenStore, settings: Configured) -> Response:
    return _file(store, settings.db, f"{DIAGNOSIS}{diagnosis}", f"diagnosis-{diagnosis}", ending)


@router.get("/model/{name}/{version}.{ending}")
def model(
    name: Name, version: Key, ending: Ending, store: OpenStore, settings: Configured
) -> Response:
    return _file(store, settings.db, f"{MODEL}{name}@{version}", f"{name}-{version}", ending)


def _file(store: OpenStore, db: str, word: str, name: str, ending: Ending) -> Response:
    return report_file(report_on(store, db, word), name, ending)


def report_file(document: Document, name: str, ending: Ending) -> Response:
    """A report as the file `name` with that ending."""
    return named_file(report_content(document, f".{ending}"), name, ending, _TYPES[ending])
